//! Elements of a sheet in single precision: triangles and curved hinges.

/// Coupled edge springs of a triangle. Edge k lies opposite corner k.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct EdgeTriangle {
    pub(super) v: [u32; 3],
    /// Lengths at rest (m).
    pub(super) rest: [f32; 3],
    /// Stiffness between lengthenings 00, 11, 22, 12, 20, 01 (N/m).
    pub(super) k: [f32; 6],
}

impl EdgeTriangle {
    /// Stiffness between edges `i` and `j` (N/m).
    pub(super) fn stiffness(&self, i: usize, j: usize) -> f32 {
        if i == j { self.k[i] } else { self.k[6 - i - j] }
    }
}

/// Hinge that is bent at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CurvedHinge {
    pub(super) v: [u32; 4],
    pub(super) c: [f32; 4],
    /// Stiffness (N/m).
    pub(super) w: f32,
    /// Length of Σ cₖ xₖ at rest (m).
    pub(super) rest: f32,
}
