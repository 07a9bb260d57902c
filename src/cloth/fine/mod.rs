//! Offline cloth on contact that never fails: steps, static drape, animation, checkpoints, obstacle springs.

pub(crate) mod air_drag;
pub(crate) mod animation;
pub(crate) mod checkpoint;
mod checks;
pub(crate) mod contacts;
pub(crate) mod drape;
mod elastic_term;
pub(crate) mod energy_term;
mod error;
pub(crate) mod garment_cloth;
pub(crate) mod integrator;
mod linear_solver;
mod model;
pub(crate) mod newton;
pub(crate) mod obstacle;
pub(crate) mod potential;
pub(crate) mod problem;
pub(crate) mod sleep;
pub(crate) mod sleepers;
pub(crate) mod start;
pub(crate) mod step;
mod stitch;
mod targets;
#[cfg(test)]
mod tests;

pub use crate::settings::{
    ContactSettings, DrapeSettings, NewtonSettings, ObstacleSpring, OfflineSettings,
    OfflineStartSettings, SleepSettings, TimeScheme,
};
pub use air_drag::AirDrag;
pub use animation::AnimationProgress;
pub use checkpoint::{checkpoint_frame, checkpoint_state};
pub use contacts::ContactReport;
pub use drape::DrapeReport;
pub use elastic_term::ElasticTerm;
pub use energy_term::{ElementTerm, EnergyElements, EnergyTerm};
pub use error::{NewtonFault, OfflineError};
pub use integrator::{MotionState, OfflineState};
pub use model::{OfflineCloth, PinTarget};
pub use newton::NewtonReport;
pub use start::{JoinedSurfaces, StartReport};
pub use step::{OfflineFrameReport, OfflineSolver};
pub use stitch::{StitchSprings, sewn_pairs};
pub use targets::FrameTargets;
