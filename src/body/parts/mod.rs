//! The map from joints and vertices of a body to its segments, sides, parts and limbs.

mod joints;
mod trunk;
mod vertices;

pub use joints::{BodyPart, BodyParts, BodySegment, BodySide, LimbJoints};
pub use trunk::TrunkFrame;
pub use vertices::{hinge_vertices, opposing_masks, pressing_masks, vertex_masks};
