//! One step from a frame and the last state to pose, displacements and a confidence report.

mod align;
mod calm;
mod confidence;
mod config;
mod hypotheses;
mod kinematics;
mod limb;
mod model;
mod place;
mod report;
mod rescue;
mod size;
mod sleeve;
mod stand;
mod state;
mod step;
mod surface;
mod unchanged;
mod workspace;

pub use confidence::{JointConfidence, Reason};
pub use config::{Normals, TrackerConfig};
pub use model::TrackerModel;
pub use report::{Skipped, StagesMs, StepError, StepReport};
pub use size::SizeEstimate;
pub use state::{LostReason, Status, TrackerState};
pub use step::step;
pub use surface::SurfaceStatistics;
pub use workspace::Workspace;
