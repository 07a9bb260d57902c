//! Unit and axes of mesh files, and bodies with theirs.

use clap::Args;
use std::path::{Path, PathBuf};
use tryon::formats::mesh_frame::metres_per_unit;
use tryon::formats::{FrameOptions, MeshAxis, MeshFrame};

/// Options of one file's frame, named with a prefix: a command reads several files, each in a frame of its own.
macro_rules! frame_args {
    ($(#[$doc:meta])* $name:ident, $prefix:literal, $file:literal $(, requires = $file_option:literal)?) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Args)]
        pub(crate) struct $name {
            #[arg(
                id = concat!($prefix, "unit"),
                long = concat!($prefix, "unit"),
                value_parser = metres_per_unit,
                value_name = "UNIT",
                help = concat!(
                    "Unit of ", $file, ": m, dm, cm, mm, inch, foot, or metres as a number. Found from it without this"
                ),
                $(requires = $file_option,)?
            )]
            unit: Option<f64>,
            #[arg(
                id = concat!($prefix, "up"),
                long = concat!($prefix, "up"),
                value_name = "AXIS",
                allow_hyphen_values = true,
                help = concat!("Axis of ", $file, " that points up: y, z, -y … Found from it without this"),
                $(requires = $file_option,)?
            )]
            up: Option<MeshAxis>,
            #[arg(
                id = concat!($prefix, "facing"),
                long = concat!($prefix, "facing"),
                value_name = "AXIS",
                allow_hyphen_values = true,
                help = concat!("Axis of ", $file, " that points ahead of the person. Found from it without this"),
                $(requires = $file_option,)?
            )]
            facing: Option<MeshAxis>,
        }

        impl $name {
            /// The options as one value.
            pub(crate) fn stated(&self) -> MeshFrame {
                MeshFrame {
                    metres_per_unit: self.unit,
                    up: self.up,
                    facing: self.facing,
                    options: FrameOptions {
                        unit: concat!("--", $prefix, "unit"),
                        up: concat!("--", $prefix, "up"),
                        facing: concat!("--", $prefix, "facing"),
                    },
                }
            }
        }
    };
}

frame_args!(
    /// Unit and axes of the mesh that a command is about.
    MeshFrameArgs,
    "",
    "the mesh"
);
frame_args!(
    /// Unit and axes of `--body`.
    BodyFrameArgs,
    "body-",
    "the body",
    requires = "body"
);
frame_args!(
    /// Unit and axes of `--garment-body`.
    GarmentBodyFrameArgs,
    "garment-body-",
    "the body under the garments",
    requires = "garment_body"
);

/// Body template and the frame of its file.
#[derive(Clone, Debug, Args)]
pub(crate) struct BodyArgs {
    /// Body template in SMPL layout; the embedded body without it.
    #[arg(long, value_name = "NPZ")]
    body: Option<PathBuf>,
    #[command(flatten)]
    frame: BodyFrameArgs,
}

impl BodyArgs {
    /// The body's file, if one is given.
    pub(crate) fn file(&self) -> Option<&Path> {
        self.body.as_deref()
    }
    /// Unit and axes of the file as stated.
    pub(crate) fn stated(&self) -> MeshFrame {
        self.frame.stated()
    }
}

/// Body that mesh garments were made on, and the frame of its file.
#[derive(Clone, Debug, Args)]
pub(crate) struct GarmentBodyArgs {
    /// The body that mesh garments were made on (.npz in SMPL layout, or an .obj that stands upright; MakeHuman clothes:
    /// its base mesh with the helpers). Without it the garment's own place and size are guessed from.
    #[arg(long, value_name = "NPZ|OBJ")]
    garment_body: Option<PathBuf>,
    #[command(flatten)]
    frame: GarmentBodyFrameArgs,
}

impl GarmentBodyArgs {
    /// The body's file and its frame as stated, if one is given.
    pub(crate) fn given(&self) -> Option<(&Path, MeshFrame)> {
        let file = self.garment_body.as_deref()?;
        Some((file, self.frame.stated()))
    }
}
