//! Scenes by the offline solver: scene in, positions of every frame out.

use super::Scene;
use super::file::flat;
use super::solids::Solids;
use crate::elastic::{ClothModel, ElasticFabric, RestSheet};
use crate::fine::{
    AnimationProgress, ElasticTerm, FrameTargets, MotionState, OfflineCloth, OfflineError,
    OfflineSettings, OfflineSolver, OfflineState, PinTarget,
};
use nalgebra::{Point3, Vector2};
use std::ops::ControlFlow;
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Scene as the offline solver needs it.
#[derive(Debug)]
pub struct OfflineScene<'a> {
    scene: &'a Scene,
    cloth: OfflineCloth,
    solids: Solids<'a>,
}

impl<'a> OfflineScene<'a> {
    /// Cloth and solids of a scene; the start is the rest shape.
    ///
    /// # Errors
    /// Names the face or modulus at fault.
    pub fn new(scene: &'a Scene) -> Result<Self, OfflineError> {
        let x: Vec<V3d> = scene.start.iter().map(|p| p.coords.cast()).collect();
        let corners = scene
            .faces
            .iter()
            .map(|f| flat(f.map(|v| x[v as usize])).map(Vector2::from));
        let rest = RestSheet {
            faces: scene.faces.clone(),
            corners: corners.collect(),
            folded: Some(x.clone()),
        };
        let fabric = ElasticFabric::of_material(&scene.material);
        let model = ClothModel::new(&rest, x.len(), fabric)?;
        let mass = model.masses().to_vec();
        let terms = vec![Box::new(ElasticTerm::new(model)) as Box<_>];
        Ok(Self {
            cloth: OfflineCloth::new(mass, scene.faces.clone(), scene.gravity, terms)?,
            solids: Solids::new(scene),
            scene,
        })
    }

    fn pins(&self, time: f64) -> Vec<PinTarget> {
        let carrier = self.scene.pinned_to.map(|c| &self.scene.colliders[c]);
        let moved = carrier.map(|c| c.placement(time) * c.placement(0.0).inverse());
        let target = |v: &u32| {
            let p: Point3<f64> = self.scene.start[*v as usize].cast();
            PinTarget {
                vertex: *v,
                target: moved.map_or(p, |m| m * p).coords,
            }
        };
        self.scene.pins.iter().map(target).collect()
    }

    /// Simulates all frames, or those after `checkpoint`. `frame` receives the progress and the solver after each, and may
    /// break off; returns the last frame. Friction is that of the first solid, else of the material.
    ///
    /// # Errors
    /// A step that is not solved; a checkpoint of another scene.
    pub fn run(
        &self,
        settings: &OfflineSettings,
        par: Par,
        checkpoint: Option<&[u8]>,
        frame: impl FnMut(&AnimationProgress, &OfflineSolver<'_>) -> ControlFlow<()>,
    ) -> Result<usize, OfflineError> {
        let mut settings = *settings;
        if let Some(contact) = &mut settings.contact {
            contact.friction = self.scene.friction();
        }
        let (start, interval) = (self.solids.at(0.0), 1.0 / self.scene.rate);
        let state = OfflineState {
            now: MotionState {
                x: self.scene.start.iter().map(|p| p.coords.cast()).collect(),
                v: vec![V3d::zeros(); self.cloth.len()],
            },
            obstacle: [start.clone(), start],
            ..OfflineState::default()
        };
        let mut solver = OfflineSolver::new(&self.cloth, &self.solids.faces, state, settings, par)?;
        let frames = self.scene.frames().saturating_sub(1);
        let first = match checkpoint {
            Some(bytes) => solver.resume(bytes)? as usize,
            None => 0,
        };
        let script: Vec<_> = (0..=frames)
            .map(|k| interval * k as f64)
            .map(|t| (self.pins(t), self.solids.at(t)))
            .collect();
        solver.animate(
            interval,
            first + 1..=frames,
            |k| FrameTargets {
                pins: &script[k].0,
                obstacle: &script[k].1,
            },
            frame,
        )
    }
}
