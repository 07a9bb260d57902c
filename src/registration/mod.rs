//! Correspondences, robust kernels and Gauss–Newton that pull one surface onto another.

mod articulated;
mod edge_pairs;
mod metric;
mod pairing;
mod projective;

pub use articulated::{ArticulatedSums, BoneSums, Dof, solve_damped};
pub use edge_pairs::{EdgePairs, EdgeSide, pair_edges};
pub use metric::{GemanMcClure, Metric};
pub use pairing::{
    Association, ModelPoints, Pair, PairingConfig, PairingScratch, PairingStats, pair_surfaces,
};
pub use projective::IndexImage;
