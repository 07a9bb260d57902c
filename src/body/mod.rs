//! The articulated template: skeleton, twists, skinning, shape, bone scales, displacements, the one map from vertices to parts and limbs; the embedded body; importers.

pub mod embedded;
mod error;
pub mod import;
pub mod measure;
pub mod parts;
mod pose;
mod pose_offsets;
mod pose_shapes;
mod rig;
mod shape;
mod shape_space;
mod skeleton;
mod skin_weights;
mod skinning;
mod template;

pub use error::BodyError;
pub use pose::{BoneTransforms, Pose};
pub use pose_offsets::PoseOffsets;
pub use pose_shapes::PoseShapes;
pub use rig::rig;
pub use shape::{BodyShape, RestBody};
pub use shape_space::ShapeSpace;
pub use skeleton::{Joint, JointMotion, Skeleton};
pub use skin_weights::SkinWeights;
pub use skinning::{skin, skin_moved};
pub use template::Template;
