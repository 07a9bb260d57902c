//! Neighbours fast: BVH, grids, kd-tree (the only file naming kiddo), each beside its brute-force oracle.

mod brute;
mod kdtree;
mod organised;

pub use brute::nearest_brute_force;
pub use kdtree::PointTree;
pub use organised::{Label, OrganisedCloud};
