//! Specimen under gravity at rest, by either solver.

use super::{FabricSolver, FabricTestReport, FabricTrial, carried};
use crate::elastic::{ClothModel, ElasticFabric, RestSheet};
use crate::fine::{
    ElasticTerm, FrameTargets, MotionState, OfflineCloth, OfflineError, OfflineSettings,
    OfflineSolver, OfflineState, PinTarget,
};
use crate::live::Sheet;
use crate::scene::{Scene, SceneError, run};
use crate::settings::{FabricTestSettings, SceneSettings};
use nalgebra::Vector2;
use std::ops::ControlFlow;
use tryon_geometry::math::{P3, V3d};
use tryon_geometry::mesh::Face;
use tryon_geometry::par::Par;

/// Flat specimen, partly held.
pub(super) struct Specimen {
    /// Material coordinates (m), u along the weft.
    pub(super) at: Vec<Vector2<f64>>,
    /// Triangles.
    pub(super) faces: Vec<Face>,
    /// Start (m); the first `held` vertices stay there.
    pub(super) start: Vec<V3d>,
    pub(super) held: usize,
}

impl Specimen {
    /// Positions at rest (m); `report` receives the limit of a real-time mesh, and what still moves.
    pub(super) fn rest(
        &self,
        trial: &FabricTrial,
        settings: &FabricTestSettings,
        report: &mut FabricTestReport,
    ) -> Result<Vec<V3d>, SceneError> {
        match trial.solver {
            FabricSolver::Offline => {
                let offline = self.offline(trial, settings);
                let (x, moving) = offline.map_err(|e| SceneError::Offline(Box::new(e)))?;
                report.note_rest(moving);
                Ok(x)
            }
            FabricSolver::Realtime => self.realtime(trial, settings, report),
        }
    }

    fn offline(
        &self,
        trial: &FabricTrial,
        settings: &FabricTestSettings,
    ) -> Result<(Vec<V3d>, Option<String>), OfflineError> {
        let rest = RestSheet::flat(self.faces.clone(), &self.at)?;
        let fabric = ElasticFabric::of_material(&trial.fabric.material);
        let model = ClothModel::new(&rest, self.at.len(), fabric)?;
        let mass = model.masses().to_vec();
        let terms = vec![Box::new(ElasticTerm::new(model)) as Box<_>];
        let gravity = V3d::new(0.0, -settings.gravity, 0.0);
        let mut cloth = OfflineCloth::new(mass, self.faces.clone(), gravity, terms)?;
        let offline = OfflineSettings {
            newton: settings.newton,
            contact: None,
            ..OfflineSettings::default()
        };
        let pin = |v: usize| PinTarget {
            vertex: v as u32,
            target: self.start[v],
        };
        let pins: Vec<PinTarget> = (0..self.held).map(pin).collect();
        let targets = FrameTargets {
            pins: &pins,
            ..FrameTargets::default()
        };
        let (mut x, mut moving) = (self.start.clone(), None);
        for share in settings.loading {
            cloth.gravity = gravity * share;
            let state = OfflineState {
                now: MotionState {
                    v: vec![V3d::zeros(); x.len()],
                    x,
                },
                ..OfflineState::default()
            };
            let mut solver = OfflineSolver::new(&cloth, &[], state, offline, Par::Rayon)?;
            let go_on = |_: &_| ControlFlow::Continue(());
            let report = solver.drape_to(&settings.drape, &targets, go_on)?;
            moving = (!report.settled).then(|| report.to_string());
            x = solver.state().now.x.clone();
        }
        Ok((x, moving))
    }

    fn realtime(
        &self,
        trial: &FabricTrial,
        settings: &FabricTestSettings,
        report: &mut FabricTestReport,
    ) -> Result<Vec<V3d>, SceneError> {
        let rest: Vec<[[f64; 2]; 3]> = (self.faces.iter())
            .map(|f| f.map(|v| self.at[v as usize].into()))
            .collect();
        let (limit, mut material) = carried(trial, &rest);
        report.resolution = Some(limit);
        material.damping = settings.damping;
        let scene = Scene {
            sheet: Sheet::new(self.at.len(), &self.faces, &rest, &material, None)?,
            material,
            faces: self.faces.clone(),
            start: self.start.iter().map(|p| P3::from(p.cast())).collect(),
            pins: (0..self.held as u32).collect(),
            pinned_to: None,
            colliders: Vec::new(),
            gravity: V3d::new(0.0, -settings.gravity, 0.0),
            duration: settings.duration,
            rate: settings.rate,
            settings: SceneSettings::default(),
        };
        let mut last = [Vec::new(), Vec::new()];
        run(&scene, &scene.config(), |_, x| {
            last.swap(0, 1);
            last[1] = x.to_vec();
            ControlFlow::Continue(())
        })?;
        let speeds = last[1].iter().zip(&last[0]);
        let speeds = speeds.map(|(b, a)| f64::from((b - a).norm()) * settings.rate);
        let fastest = speeds.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        report.note_rest(fastest.filter(|f| f.1 > settings.still).map(|(v, speed)| {
            let speed = speed * 1e3;
            format!("not at rest: vertex {v} moves at {speed:.1} mm/s")
        }));
        Ok(last[1].iter().map(|p| p.coords.cast()).collect())
    }
}
