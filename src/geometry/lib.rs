//! Small algebra that nalgebra lacks, deterministic parallel loops, meshes and their topology, cameras and images, sparse
//! systems, neighbours, rasterising.
//!
//! # Ideas
//!
//! Mathematics and meshes:
//!
//! - Twists, exponential maps (eq. 1): [`mod@math::lie`].
//! - Typed frames: [`mod@math::frames`].
//! - Nearest rotation: [`mod@math::polar`].
//! - Medians, percentiles, quantiles: [`mod@math::order_statistics`].
//! - Settings structs, defaults beside their documentation: [`settings!`].
//! - Finite-difference check of energies and residuals: [`mod@math::derivative_check`].
//! - Deterministic parallel loops: [`mod@par`].
//! - Spin barrier: [`mod@par::lockstep`].
//! - Edges, neighbours, boundaries: [`mod@mesh::topology`], of any faces [`mod@mesh::edges`].
//! - Disjoint sets: [`mod@mesh::union_find`].
//! - Remeshing: [`mod@mesh::remesh`]; repair to oriented manifold sheets: [`mod@mesh::repair`].
//! - Sparse Cholesky, conjugate gradients: [`mod@linear::cholesky`], [`mod@linear::conjugate_gradient`].
//! - Refit BVH, inside tests: [`mod@spatial::bvh`]; closest points from the last ones: [`mod@spatial::warm_query`].
//! - Self-intersections: [`mod@spatial::intersections`].
//! - Depth image as a grid of points: [`mod@spatial::organised`].
//! - Oracles: [`mod@spatial::brute`].
//! - Graph cuts, alpha expansion: [`mod@mrf::max_flow`], [`mod@mrf::expansion`].
//!
//! Camera and files:
//!
//! - Projection: [`mod@camera::intrinsics`].
//! - Lens distortion: [`mod@camera::lens`], inverse [`mod@camera::undistort`]; rectification: [`mod@camera::rectify`].
//! - Turned and mirrored cameras: calibration [`mod@camera::mounting`], pictures [`mod@camera::reorient`].
//! - Depth in the colour view: [`mod@camera::register`].
//! - Noise of Kinect v1 and time-of-flight: [`mod@camera::noise`].
//!
//! Offline cloth:
//!
//! - Matrices of 3 × 3 blocks: [`mod@linear::block_matrix`].
//!
//! Picture:
//!
//! - Rasteriser: [`mod@raster::fast`].
//! - Occluded triangles: [`mod@raster::hiz`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

pub mod camera;
pub mod fixtures;
pub mod linear;
pub mod math;
pub mod mesh;
pub mod mrf;
pub mod par;
pub mod raster;
mod settings;
pub mod spatial;
