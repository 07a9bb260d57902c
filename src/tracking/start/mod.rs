//! Poses without a previous one: gravity, proposals of the part network, hypotheses of limbs, the initial pose.

pub(crate) mod body_proposals;
pub(crate) mod facing;
pub(crate) mod gravity;
pub(crate) mod hypotheses;
pub(crate) mod initial_pose;
pub(crate) mod joint_proposals;
pub(crate) mod proposed_pose;

pub(crate) use body_proposals::{BodyProposals, person_cells};
pub use facing::{Facing, facing, yaw_of_joints};
pub(crate) use gravity::rolled_camera;
pub(crate) use hypotheses::resting_limb;
pub(crate) use initial_pose::{Outline, StartPrior, initial_pose, outline};
pub use joint_proposals::{JointProposals, ProposedAnchor};
