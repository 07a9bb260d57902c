//! One step from a frame and the last state to pose, displacements and a confidence report.
//!
//! # Ideas
//!
//! Settings of all stages, with units, defaults and effects: [`mod@settings`].
//!
//! Segmentation:
//!
//! - Floor by voting, background by RANSAC: [`mod@segment::plane_search`].
//! - The nearest body: [`mod@segment::person`], [`mod@segment::components`].
//! - Candidates refused before: [`mod@segment::refusals`].
//! - People side by side, and who passes: [`mod@segment::expected_body`].
//! - True outline against occlusion edges: [`mod@segment::edges`].
//! - Ends of limbs: [`mod@segment::extremities`].
//! - Hands beyond sleeves without return: [`mod@segment::hands`].
//! - Body parts, joints and yaw by a network: [`mod@segment::part_network`].
//! - Joints and poses from it: [`mod@part_classes`], [`mod@start::joint_proposals`], [`mod@start::facing`], [`mod@start::proposed_pose`].
//!
//! Pose:
//!
//! - The step and its order (Algorithm 1): [`mod@step`], [`mod@subject`].
//! - Correspondences, pruning (Table 1), relaxed bijective check (eq. 9): [`mod@registration::pairing`].
//! - Projective search: [`mod@registration::index_image`].
//! - Edge pairs: [`mod@registration::edge_pairs`].
//! - Residuals: [`mod@registration::residual::surface`], [`mod@registration::residual::edge`],
//!   [`mod@registration::residual::floor`],
//!   [`mod@registration::residual::hand`], [`mod@registration::residual::clearance`],
//!   [`mod@registration::residual::prior`].
//! - Influence of joints on points (β of eq. 3 and 5), normal equations per bone:
//!   [`mod@registration::normal_equations`].
//! - Robust kernel: [`mod@registration::metric`].
//! - Unknowns as twists (eq. 31): [`mod@registration::kinematics`].
//! - Extrapolated poses: [`mod@fit::extrapolation`].
//! - Iterations of eq. 12: [`mod@fit::solve`].
//! - Residual weights of each kind of fit: [`mod@fit::terms`].
//! - First pose: [`mod@start::initial_pose`], [`mod@start::hypotheses`].
//! - Constant-velocity start: [`mod@fit::prediction`].
//! - Poses from proposals: [`mod@start::body_proposals`].
//! - Repairs: [`mod@recover::repair`].
//! - The person in a still, from virtual cameras around it: [`mod@still`].
//! - Hidden feet: [`mod@fit::standing`].
//! - Arms that no reading shows: [`mod@recover::hidden_limb`].
//! - Sleeves without return: [`mod@fit::hand_assignment`].
//! - Seated or standing: [`mod@assess::seat`].
//! - Jitter: [`mod@fit::pose_filter`].
//! - Unchanged frames: [`mod@change_detection`], by [`mod@block_readings`]. What never moved: [`mod@own_motion`].
//! - Body in free space, readings left uncovered: [`mod@assess::agreement`].
//! - Person or thing: [`mod@assess::person_evidence`]. Front or back: [`mod@assess::facing_belief`]. Both: [`mod@doubt`].
//! - The eye for colour: [`mod@color_eye`], beside the frames: [`mod@background_eye`]; its sightings: [`mod@sighting`].
//! - Roll of a camera without a floor: [`mod@start::gravity`].
//! - Confidence: [`mod@assess::confidence`].
//! - Searching, tracking, lost: [`mod@status`].
//!
//! Size and surface:
//!
//! - Bone scales and shape coefficients (eq. 18 to 23): [`mod@shape::size`]; by the side seen: [`mod@shape::view_information`];
//!   how sure it is: [`mod@shape::girth_deviation`].
//! - In turns with the pose: [`mod@shape::calibration`].
//! - Displacements (eq. 13 to 17): [`mod@shape::surface`], when they are due: [`mod@adaptation`].
//! - Bodies that were measured before: [`mod@shape::known_body`], [`mod@shape::probation`], [`mod@known_subject`]; by the
//!   colour of their clothes: [`mod@clothes_colors`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules, `pub(crate)` for it

mod adaptation;
mod assess;
mod background_eye;
mod block_readings;
mod change_detection;
mod clothes_colors;
mod color_eye;
mod doubt;
mod fit;
mod known_subject;
mod model;
mod own_motion;
mod recover;
pub mod registration;
mod report;
pub mod segment;
mod segmentation;
pub mod settings;
mod shape;
mod sighting;
mod start;
mod state;
mod status;
mod step;
pub mod still;
mod subject;
mod subject_view;
#[cfg(test)]
mod test_scene;
mod workspace;

pub use adaptation::adapt_surface;
pub use assess::{Agreement, ConfidenceReason, JointConfidence};
pub use background_eye::BackgroundEye;
pub use color_eye::{COLOR_INTERVAL, ColorEye, ColorEyeError};
pub use model::{PartClasses, TrackerModel, part_classes};
pub use report::{Skipped, StepError, StepReport, TrackingStagesMs};
pub use settings::TrackerConfig;
pub use shape::{GirthDeviations, KnownBody, ShapeFault, SizeEstimate, SurfaceStatistics};
pub use sighting::ColorSighting;
pub use start::{Facing, JointProposals, ProposedAnchor, facing, yaw_of_joints};
pub use state::TrackerState;
pub use status::{LostReason, Status};
pub use step::{follow, step};
pub use workspace::Workspace;
