//! The map from joints and vertices of a body to its segments, sides, parts and limbs.

mod joints;
mod trunk;
mod vertices;

pub use joints::{BodyPart, BodyParts, BodySegment, BodySide, LimbJoints};
pub use trunk::{EllipticColumn, EllipticSection, TrunkFrame};
pub use vertices::{hinge_vertices, mean_radius, opposing_masks, pressing_masks, vertex_masks};
