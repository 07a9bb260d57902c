//! Settings of cloth: one struct a stage, each field with its documentation and default side by side.

mod contact;
mod elastic;
mod fine;
mod live;
mod repair;
mod scene;
mod solver;
mod stillness;

pub use contact::{
    CollisionConfig, JointClearanceSettings, MapSettings, PartClearanceSettings, SurfaceSettings,
};
pub use elastic::ElasticSettings;
pub use fine::{
    ContactSettings, DrapeSettings, NewtonSettings, ObstacleSpring, OfflineSettings, SleepSettings,
    StartSettings,
};
pub use live::{ClothContactSettings, Config, SelfContactSettings, StepSettings};
pub use repair::{RepairSettings, SleeveSettings, UntanglerSettings};
pub use scene::SceneSettings;
pub use solver::{FoldSettings, SolverSettings};
pub use stillness::StillnessSettings;

use tryon_geometry::settings;
