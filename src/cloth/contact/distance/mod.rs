//! Squared distances of the contact stencils: closest features, gradient, Hessian, mollifier of parallel edges.

mod edge_edge;
mod parallel_mollifier;
mod point_edge;
mod point_point;
mod point_triangle;
mod separation;
#[cfg(test)]
mod tests;

pub use edge_edge::edge_edge;
pub use parallel_mollifier::{ParallelMollifier, mollifier_threshold};
pub use point_edge::point_edge;
pub use point_point::point_point;
pub use point_triangle::point_triangle;
pub use separation::{ClosestFeatures, Separation, Slide};

/// Sine below which two directions count as parallel. The cross product's relative error there is 1e-9; a triangle of
/// edges of 10 mm has a height of 1 nm. Larger loses Hessians of thin shapes, smaller lets rounding choose the normal.
const PARALLEL_SINE: f64 = 1e-7;
