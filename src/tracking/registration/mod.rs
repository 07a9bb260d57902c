//! Correspondences, robust kernels and Gauss–Newton that pull one surface onto another.

mod correspondence;
pub(crate) mod edge_pairs;
pub(crate) mod index_image;
pub(crate) mod kinematics;
pub(crate) mod metric;
pub(crate) mod normal_equations;
pub(crate) mod pairing;
pub mod residual;

pub use crate::settings::Association;
pub use correspondence::{ModelPoints, Observation, Pair, PairingConfig, PairingStats};
pub use edge_pairs::{EdgePairs, pair_edges};
pub use index_image::IndexImage;
#[cfg(test)]
pub(crate) use kinematics::tests::arm;
pub use kinematics::{apply, linearise};
pub use metric::{GemanMcClure, Metric};
pub use normal_equations::{BoneSums, Dof, NormalEquations, ROOT_UNKNOWNS, is_ancestor};
pub use pairing::{PairingScratch, pair_surfaces};
