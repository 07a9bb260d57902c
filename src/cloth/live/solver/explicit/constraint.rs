//! Constraints of one patch vertex: moving half-spaces and prescribed positions.

use super::vec4::V4;

/// Half-space that moves evenly until the next contact query.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactPlane {
    /// Constrained vertex of the patch.
    pub vertex: u32,
    /// Unit normal, outward.
    pub normal: V4,
    /// Lower bound of `normal · x` at the time of the query (m).
    pub offset: f32,
    /// Velocity of the surface (m/s).
    pub velocity: V4,
    /// Coulomb coefficient.
    pub friction: f32,
}

impl ContactPlane {
    /// Speed of the plane along its normal (m/s).
    #[inline(always)]
    pub fn rate(&self) -> f32 {
        self.normal.dot(self.velocity)
    }
    /// The plane `span` seconds later.
    pub fn after(&self, span: f32) -> Self {
        Self {
            offset: self.offset + self.rate() * span,
            ..*self
        }
    }
    /// Signed distance of `x` at time `t` since the query (m).
    #[inline(always)]
    pub fn gap(&self, x: V4, t: f32) -> f32 {
        self.normal.dot(x) - self.offset - self.rate() * t
    }
}

/// Prescribed position of a vertex, moving evenly until the next contact query.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pin {
    /// Constrained vertex of the patch.
    pub vertex: u32,
    /// Position at the time of the query (m).
    pub target: V4,
    /// Velocity of the target (m/s).
    pub velocity: V4,
    /// Share of the distance to the target that each substep covers; 1 is rigid.
    pub stiffness: f32,
}
