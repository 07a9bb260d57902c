//! Markov random fields on graphs with Potts pairwise terms, minimised by alpha expansion.

mod error;
pub mod expansion;
mod fixed_point;
pub mod max_flow;
#[cfg(test)]
mod test_graphs;

pub use error::MrfError;
pub use expansion::{AlphaExpansion, ExpansionConfig, ExpansionReport, MrfModel};
pub use max_flow::MaxFlow;
