//! The map from joints and vertices of a body to its segments, sides, parts and limbs.

pub(crate) mod joints;
mod trunk;
pub(crate) mod vertices;

pub use joints::{BodyPart, BodyParts, BodySegment, BodySide, LimbJoints};
pub use trunk::{EllipticColumn, EllipticSection, TrunkFrame};
pub use vertices::{hinge_vertices, mean_radius, opposing_masks, pressing_masks, vertex_masks};
