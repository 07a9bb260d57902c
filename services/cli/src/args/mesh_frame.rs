//! Unit and axes of mesh files.

use clap::Args;
use tryon::formats::mesh_frame::metres_per_unit;
use tryon::formats::{MeshAxis, MeshFrame};

/// Unit and axes of a garment's file.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct MeshFrameArgs {
    /// Unit of the mesh: m, dm, cm, mm, inch, foot, or metres as a number. Found from the mesh without it.
    #[arg(long, value_parser = metres_per_unit, value_name = "UNIT")]
    unit: Option<f64>,
    /// Axis of the mesh that points up: y, z, -y … Found from the mesh without it.
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    up: Option<MeshAxis>,
    /// Axis of the mesh that points ahead of the wearer. Found from the mesh without it.
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    facing: Option<MeshAxis>,
}

impl MeshFrameArgs {
    /// The options as one value.
    pub(crate) fn stated(&self) -> MeshFrame {
        MeshFrame {
            metres_per_unit: self.unit,
            up: self.up,
            facing: self.facing,
        }
    }
}
