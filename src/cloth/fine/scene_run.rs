//! Scene files by the offline solver: scene in, positions of every frame out.

use super::garment_cloth::fabric_of;
use super::{
    AnimationProgress, ElasticTerm, FrameTargets, MotionState, OfflineCloth, OfflineError,
    OfflineSettings, OfflineSolver, OfflineState, PinTarget, solid_mesh::solid_mesh,
};
use crate::elastic::{BendingModel, ClothModel, RestSheet};
use crate::live::scene::Scene;
use nalgebra::{Point3, Vector2};
use std::ops::ControlFlow;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;
use tryon_geometry::par::Par;

/// Scene as the offline solver needs it.
#[derive(Debug)]
pub struct OfflineScene<'a> {
    scene: &'a Scene,
    cloth: OfflineCloth,
    /// Surface of all solids, each in its own frame (m), with the number of its collider.
    solids: Vec<(V3d, usize)>,
    faces: Vec<Face>,
}

/// A triangle laid flat, its first edge along u.
fn flat(corners: [V3d; 3]) -> [Vector2<f64>; 3] {
    let (e, d) = (corners[1] - corners[0], corners[2] - corners[0]);
    let length = e.norm().max(f64::MIN_POSITIVE);
    [
        Vector2::zeros(),
        Vector2::new(length, 0.0),
        Vector2::new(d.dot(&e), e.cross(&d).norm()) / length,
    ]
}

impl<'a> OfflineScene<'a> {
    /// Cloth and solids of a scene; the start is the rest shape.
    ///
    /// # Errors
    /// Names the face or modulus at fault.
    pub fn new(scene: &'a Scene) -> Result<Self, OfflineError> {
        let x: Vec<V3d> = scene.start.iter().map(|p| p.coords.cast()).collect();
        let corners = scene.faces.iter().map(|f| flat(f.map(|v| x[v as usize])));
        let rest = RestSheet {
            faces: scene.faces.clone(),
            corners: corners.collect(),
            folded: Some(x.clone()),
        };
        let fabric = fabric_of(&scene.material);
        let model = ClothModel::new(&rest, x.len(), fabric, BendingModel::default())?;
        let mass = model.masses().to_vec();
        let terms = vec![Box::new(ElasticTerm::new(model)) as Box<_>];
        let (mut solids, mut faces) = (Vec::new(), Vec::new());
        for (number, collider) in scene.colliders.iter().enumerate() {
            let (x, own) = solid_mesh(&collider.shape);
            let first = solids.len() as u32;
            faces.extend(own.iter().map(|f| f.map(|v| v + first)));
            solids.extend(x.into_iter().map(|p| (p, number)));
        }
        Ok(Self {
            cloth: OfflineCloth::new(mass, scene.faces.clone(), scene.gravity, terms)?,
            scene,
            solids,
            faces,
        })
    }

    /// Surface of the solids at a time (m).
    fn obstacle(&self, time: f64) -> Vec<V3d> {
        let placements: Vec<_> = (self.scene.colliders.iter())
            .map(|c| c.placement(time))
            .collect();
        let place = |(p, n): &(V3d, usize)| (placements[*n] * Point3::from(*p)).coords;
        self.solids.iter().map(place).collect()
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
            let solid = self.scene.colliders.first();
            contact.friction = solid.map_or(self.scene.material.friction, |c| c.friction);
        }
        let (start, interval) = (self.obstacle(0.0), 1.0 / self.scene.rate);
        let state = OfflineState {
            now: MotionState {
                x: self.scene.start.iter().map(|p| p.coords.cast()).collect(),
                v: vec![V3d::zeros(); self.cloth.len()],
            },
            obstacle: [start.clone(), start],
            ..OfflineState::default()
        };
        let mut solver = OfflineSolver::new(&self.cloth, &self.faces, state, settings, par)?;
        let frames = self.scene.frames().saturating_sub(1);
        let first = match checkpoint {
            Some(bytes) => solver.resume(bytes)? as usize,
            None => 0,
        };
        let script: Vec<_> = (0..=frames)
            .map(|k| interval * k as f64)
            .map(|t| (self.pins(t), self.obstacle(t)))
            .collect();
        solver.animate(
            interval,
            (first, frames),
            |k| FrameTargets {
                pins: &script[k].0,
                obstacle: &script[k].1,
            },
            frame,
        )
    }
}
