//! Neighbours fast: refit BVH (closest, overlap, ray parity), hash grid, kd-tree (the only file naming kiddo), organised image, each beside its brute-force oracle.

pub(crate) mod brute;
pub(crate) mod bvh;
mod chessboard;
mod hash_grid;
pub(crate) mod intersections;
mod kdtree;
pub(crate) mod organised;
mod settings;
mod triangle;
pub(crate) mod warm_query;

pub use brute::nearest_brute_force;
pub use bvh::{Bvh, Position, SurfacePoint};
pub use chessboard::chessboard_distances;
pub use hash_grid::HashGrid;
pub use intersections::{Intersection, SelfIntersections, intersections};
pub use kdtree::PointTree;
pub use organised::{Label, OrganisedCloud};
pub use settings::CellSettings;
pub use triangle::closest_on_triangle;
pub use warm_query::WarmQuery;
