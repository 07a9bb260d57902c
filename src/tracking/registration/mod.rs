//! Correspondences, robust kernels and Gauss–Newton that pull one surface onto another.

mod correspondence;
mod edge_pairs;
mod index_image;
mod metric;
mod normal_equations;
mod pairing;
pub mod residual;

pub use correspondence::{
    Association, ModelPoints, Observation, Pair, PairingConfig, PairingStats,
};
pub use edge_pairs::{EdgePairs, EdgeSide, pair_edges};
pub use index_image::IndexImage;
pub use metric::{GemanMcClure, Metric};
pub use normal_equations::{BoneSums, Dof, NormalEquations, ROOT_UNKNOWNS, is_ancestor};
pub use pairing::{PairingScratch, pair_surfaces};
