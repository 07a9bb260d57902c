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
    CollisionConfig, JointClearanceSettings, MapDetail, MapSettings, PartClearanceSettings,
    SkinQuerySettings,
};
pub use elastic::ElasticSettings;
pub use fine::{
    AirSettings, ContactSettings, DrapeSettings, NewtonSettings, ObstacleSpring, OfflineSettings,
    OfflineStartSettings, SleepSettings, TimeScheme,
};
pub use live::{
    ClothContactSettings, Config, LiveStepSettings, NearPairSettings, ResolutionSettings,
};
pub use repair::{ClothRepairSettings, UntanglerSettings};
pub use scene::{FabricTestSettings, SceneSettings};
pub use solver::SolverSettings;
pub use stillness::StillnessSettings;

use tryon_geometry::settings;
