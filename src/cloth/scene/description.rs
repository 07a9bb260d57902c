//! A scene in memory.

use super::Collider;
use crate::fine::OfflineError;
use crate::live::{ClothError, Config, Sheet};
use crate::settings::SceneSettings;
use tryon_formats::FormatError;
use tryon_garment::Material;
use tryon_geometry::math::{P3, V3d};
use tryon_geometry::mesh::Face;

/// A scene that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file of the scene cannot be read.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A field holds something that cannot be used.
    #[error("{scene}: {field}: {why}")]
    Field {
        /// The scene file.
        scene: String,
        /// The field.
        field: String,
        /// Fault of the field.
        why: String,
    },
    /// The sheet or its simulation is at fault.
    #[error(transparent)]
    Cloth(#[from] ClothError),
    /// The offline solver is at fault.
    #[error(transparent)]
    Offline(Box<OfflineError>),
    /// A step of the live solver that gave no result.
    #[error("frame {frame}: {why}")]
    Unsolved {
        /// Frame of the output.
        frame: usize,
        /// The fault.
        why: String,
    },
}

/// A scene, checked.
#[derive(Debug)]
pub struct Scene {
    /// The cloth.
    pub sheet: Sheet,
    /// Its fabric.
    pub material: Material,
    /// Its triangles.
    pub faces: Vec<Face>,
    /// Start positions in the world (y up), which are the rest shape (m).
    pub start: Vec<P3>,
    /// Pinned vertices.
    pub pins: Vec<u32>,
    /// Collider that carries the pins; `None` holds them in the world.
    pub pinned_to: Option<usize>,
    /// Solid bodies.
    pub colliders: Vec<Collider>,
    /// m/s².
    pub gravity: V3d,
    /// Length (s).
    pub duration: f64,
    /// Frames a second of the output.
    pub rate: f64,
    /// Settings of the live step.
    pub settings: SceneSettings,
}

impl Scene {
    /// Number of frames of the output, the start included.
    pub fn frames(&self) -> usize {
        (self.duration * self.rate).round() as usize + 1
    }

    /// Friction of cloth on solids: that of the first solid, else of the material.
    pub(super) fn friction(&self) -> f64 {
        let solid = self.colliders.first();
        solid.map_or(self.material.friction, |c| c.friction)
    }

    /// Settings of the live solver: as many substeps as the fabric needs, cloth that never sleeps, hard and exact solids.
    pub fn config(&self) -> Config {
        Config {
            gravity: self.gravity.into(),
            offset: self.settings.offset,
            most_steps: self.settings.most_steps,
            sleep: false,
            max_speed: f32::INFINITY,
            teleport: f64::INFINITY,
            ..Config::default()
        }
    }
}
