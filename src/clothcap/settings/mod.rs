//! Settings of a capture: one struct a stage, each field with its documentation and default side by side.

mod align;
mod garment;
mod image;
mod labels;
mod scan;
mod turn;

pub use align::{
    AlignmentSettings, ArmSearchSettings, FitStage, FreeSurfaceSettings, LegSettings,
    ModelFitSettings, PersonSearchSettings, SurfaceFitSettings, SurfaceStage,
};
pub use garment::{
    PartCutSettings, PartFitConfig, PenetrationSettings, TopologySettings, UndressSettings,
};
pub use image::{ChartSettings, PaintSettings, PictureSettings, TextureSettings};
pub use labels::{
    CameraGainSettings, IslandSettings, LabelSettings, MixtureSettings, OutfitLabelSettings,
    ScanLabelSettings, TorsoSettings, UnseenSettings,
};
pub use scan::{CloudSettings, ScanFloorSettings, ScanSettings};
pub use turn::{FramePointSettings, FusedCloudSettings, MultiViewSettings, TurnConfig};

use tryon_geometry::settings;
