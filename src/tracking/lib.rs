//! One step from a frame and the last state to pose, displacements and a confidence report.
//!
//! # Ideas
//!
//! Segmentation:
//!
//! - Floor by voting, background by RANSAC: [`mod@segment::plane_search`].
//! - The nearest body: [`mod@segment::person`], [`mod@segment::components`].
//! - Candidates refused before: [`mod@segment::refusals`].
//! - People side by side: [`mod@segment::expected_body`].
//! - True outline against occlusion edges: [`mod@segment::edges`].
//! - Ends of limbs: [`mod@segment::extremities`].
//! - Hands beyond sleeves without return: [`mod@segment::hands`].
//! - Body parts and yaw by a forest on depth differences: [`mod@segment::part_forest`].
//! - Joints and poses from it: [`mod@part_classes`], [`mod@joint_proposals`], [`mod@facing`], [`mod@proposed_pose`].
//!
//! Pose:
//!
//! - The step and its order (Algorithm 1): [`mod@step`], [`mod@subject`].
//! - Correspondences, pruning (Table 1), relaxed bijective check (eq. 9): [`mod@registration::pairing`].
//! - Projective search: [`mod@registration::index_image`].
//! - Edge pairs: [`mod@registration::edge_pairs`].
//! - Residuals: [`mod@registration::residual::surface`], [`mod@registration::residual::edge`],
//!   [`mod@registration::residual::free_space`], [`mod@registration::residual::floor`],
//!   [`mod@registration::residual::hand`], [`mod@registration::residual::clearance`],
//!   [`mod@registration::residual::prior`].
//! - Influence of joints on points (β of eq. 3 and 5), normal equations per bone:
//!   [`mod@registration::normal_equations`].
//! - Robust kernel: [`mod@registration::metric`].
//! - Unknowns as twists (eq. 31): [`mod@kinematics`].
//! - Extrapolated poses: [`mod@extrapolation`].
//! - Iterations of eq. 12: [`mod@pose_fit::solve`].
//! - Annealing: [`mod@pose_fit::schedule`].
//! - First pose: [`mod@initial_pose`], [`mod@hypotheses`].
//! - Constant-velocity start: [`mod@prediction`].
//! - Poses from proposals: [`mod@body_proposals`].
//! - Repairs: [`mod@repair`].
//! - Hidden feet: [`mod@standing`].
//! - Arms that no reading shows: [`mod@hidden_limb`].
//! - Jitter: [`mod@pose_filter`].
//! - Unchanged frames: [`mod@change_detection`].
//! - Body in free space, readings left uncovered: [`mod@agreement`].
//! - Person or thing: [`mod@person_evidence`].
//! - Roll of a camera without a floor: [`mod@gravity`].
//! - Confidence: [`mod@confidence`].
//! - Searching, tracking, lost: [`mod@status`].
//!
//! Size and surface:
//!
//! - Bone scales and shape coefficients (eq. 18 to 23): [`mod@size`].
//! - In turns with the pose: [`mod@calibration`].
//! - Displacements (eq. 13 to 17): [`mod@surface`].
//!
//! Cloth:
//!
//! - Easy pose of the first drape: [`mod@arm_clearance`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

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
pub mod registration;
mod repair;
mod report;
mod seat;
pub mod segment;
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
