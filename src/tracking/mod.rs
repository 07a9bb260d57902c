//! One step from a frame and the last state to pose, displacements and a confidence report.
//!
//! ```
//! use tryon::body::embedded;
//! use tryon::synth::{Actor, Routine, Sequence, Setting};
//! use tryon::tracking::{TrackerConfig, TrackerModel, TrackerState, Workspace, step};
//!
//! // A synthetic subject before a depth camera; `formats::open_recording` reads recorded ones.
//! let setting = Setting { routine: Routine::Still, color: false, ..Setting::default() };
//! let sequence = Sequence::new(Actor::default(), setting);
//! let model = TrackerModel::new(
//!     embedded::template(),
//!     sequence.calibration().clone(),
//!     TrackerConfig { samples: 300, ..TrackerConfig::default() },
//! );
//! let (mut state, mut workspace) = (TrackerState::new(&model), Workspace::default());
//! for i in 0..2 {
//!     let (frame, _) = sequence.frame(i);
//!     let report = step(&model, &mut state, &frame, &mut workspace)?;
//!     assert!(report.status.is_live() && report.residual_mm < 10.0);
//! }
//! // Vertices of the tracked body, camera frame, metres, shape `[vertices]`.
//! let (vertices, _bones) = workspace.posed(&model, &state);
//! assert_eq!(vertices.len(), model.template().mesh().vertices().len());
//! # Ok::<(), tryon::tracking::StepError>(())
//! ```

mod adaptation;
mod agreement;
mod arm_clearance;
mod body_proposals;
mod calibration;
mod change_detection;
mod confidence;
mod config;
mod extrapolation;
mod facing;
mod gravity;
mod hand_assignment;
mod hidden_limb;
mod hypotheses;
mod initial_pose;
mod joint_proposals;
mod kinematics;
mod known_body;
mod leg;
mod limb;
mod model;
pub mod part_classes;
mod person_evidence;
mod personal_body;
mod pose_filter;
mod pose_fit;
mod prediction;
mod probation;
mod proposed_pose;
mod repair;
mod report;
mod seat;
mod segmentation;
mod size;
mod standing;
mod state;
mod status;
mod step;
mod subject;
mod surface;
#[cfg(test)]
mod test_scene;
mod trunk;
mod workspace;

pub use crate::registration::residual::SurfaceNormals;
pub use adaptation::adapt_surface;
pub use agreement::Agreement;
pub use arm_clearance::ArmClearance;
pub use confidence::{ConfidenceReason, JointConfidence};
pub use config::TrackerConfig;
pub use facing::{Facing, facing, yaw_of_joints, yaw_of_trunk};
pub use joint_proposals::{JointProposals, ProposedAnchor};
pub use kinematics::{apply, linearise};
pub use known_body::{KnownBody, ShapeFault};
pub use model::TrackerModel;
pub use part_classes::PartClasses;
pub use report::{Skipped, StepError, StepReport, TrackingStagesMs};
pub use size::SizeEstimate;
pub use state::TrackerState;
pub use status::{LostReason, Status};
pub use step::{follow, step};
pub use surface::SurfaceStatistics;
pub use workspace::Workspace;
