//! The articulated template: skeleton, twists, skinning, shape, bone scales, displacements, the one map from vertices to parts and limbs; the embedded body; importers.

pub mod embedded;
pub mod import;
pub mod measure;
pub mod parts;
mod pose;
mod rig;
mod shape;
mod skeleton;
mod skinning;
mod template;

pub use pose::{BoneTransforms, Pose};
pub use rig::rig;
pub use shape::{BodyShape, RestBody, ShapeSpace};
pub use skeleton::{Joint, JointMotion, Skeleton};
pub use skinning::{SkinWeights, skin};
pub use template::{BodyError, Template};
