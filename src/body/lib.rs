//! The articulated template: skeleton, twists, skinning, shape, bone scales, displacements, the one map from vertices to parts and limbs; the embedded body; importers.
//!
//! # Ideas
//!
//! Body:
//!
//! - Kinematic tree, ancestors (δ of eq. 2), joint limits: [`mod@skeleton`].
//! - Forward kinematics: [`mod@pose`].
//! - Skinning (eq. 4): [`mod@skinning`].
//! - Lengths of bones without change of girth (eq. 18 to 20), displacements on the template: [`mod@shape`].
//! - Parts, limbs, joint names: [`mod@parts::joints`], [`mod@parts::vertices`].
//! - Joints of a person in any rig, by lengths: [`mod@human_joints`]; bodies of files: [`mod@import`].
//! - The embedded figure: [`mod@embedded`], read by [`mod@template_file`].
//! - Tape measures: [`mod@measure::tape`].
//! - Arms turned out of the trunk, for the easy pose of the first drape: [`mod@arm_clearance`].
//! - Yaw about gravity from shoulders and hips: [`mod@trunk_yaw`].
//! - Points bound to the skin: [`mod@skin_binding`].
//! - A skeleton for a bare scan: [`mod@rig`], `src/dressing/rig_standing.rs`.
//!
//! Garments from scans:
//!
//! - Pose blend shapes (eq. 1, 2): [`mod@pose_features`], [`mod@pose_shapes`], [`mod@pose_offsets`].
//! - Unposing (eq. 8): [`mod@skin_binding::posed_skin`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod arm_clearance;
#[cfg(test)]
#[expect(dead_code, reason = "colours are checked in the other crate")]
#[path = "../formats/gltf/skinned/decoded.rs"]
mod decoded_glb;
pub mod embedded;
mod error;
pub mod human_joints;
pub mod import;
pub mod measure;
pub mod parts;
mod pose;
mod pose_features;
mod pose_offsets;
mod pose_shapes;
mod rig;
pub mod settings;
mod shape;
mod shape_space;
mod skeleton;
pub mod skin_binding;
mod skin_weights;
mod skinning;
mod template;
mod template_file;
mod trunk_yaw;

pub use arm_clearance::ArmClearance;
pub use error::BodyError;
pub use pose::{BoneTransforms, Pose};
pub use pose_offsets::PoseOffsets;
pub use pose_shapes::PoseShapes;
pub use rig::rig;
pub use shape::{BodyShape, RestBody};
pub use shape_space::ShapeSpace;
pub use skeleton::{Joint, JointMotion, Skeleton};
pub use skin_binding::{PosedSkin, SkinBinding, SkinSearch};
pub use skin_weights::SkinWeights;
pub use skinning::{MovedRest, skin, skin_moved};
pub use template::Template;
pub use trunk_yaw::{TrunkSides, level_axes};
