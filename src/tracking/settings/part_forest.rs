//! Settings of the part forest: votes of its leaves, training.

use super::settings;

settings! {
    /// Settings of the votes of a forest for yaw and joints.
    pub struct PartVoteSettings {
        /// Least share of a class at a cell that votes; Shotton et al. chose 0.14.
        pub least_share: f32 = 0.14,
        /// Radius of the kernel, metres. The biweight kernel of this radius has the width of a Gaussian of 6.5 cm.
        pub radius: f32 = 0.17,
        /// Distance under which two modes are one, metres.
        pub same_mode: f32 = 0.10,
        /// Step that ends a mean shift, metres.
        pub settled: f32 = 0.002,
        /// Least weight of a mode as a share of the first mode of its class.
        pub least_mode: f32 = 0.1,
        /// Least belief in front and in back: where the yaw is wrong, the classes of the other side remain.
        pub least_prior: f32 = 0.02,
        /// Number of independent votes that the cells of one person are worth: neighbours repeat each other. Larger beliefs are
        /// too sure, smaller ones undecided; a choice without a measurement.
        pub independent_votes: f32 = 10.0,
    }

    /// Sizes of a forest and of the search for its splits.
    pub struct ForestSpec {
        /// Number of trees; time of a frame and size grow with it.
        pub trees: usize = 3,
        /// Splits from the root to the deepest leaf.
        pub depth: usize = 18,
        /// Most split nodes of a tree; the splits of least gain fall away first. 44 bytes a split.
        pub splits: usize = 27_000,
        /// Random features per node.
        pub features: usize = 112,
        /// Random thresholds per feature.
        pub thresholds: usize = 10,
        /// Fewest cells of a node that is split.
        pub least_cells: usize = 16,
        /// Seed of all random numbers.
        pub seed: u64 = 1,
        /// Shortest and longest offset, centimetres, drawn evenly in its logarithm.
        pub offsets: [f32; 2] = [3.0, 125.0],
        /// Share of unary features.
        pub unary: f64 = 0.4,
        /// Weight of the information about yaw beside that about the class; a choice without a measurement.
        pub yaw_weight: f64 = 0.3,
        /// Least gain of a split, bits × cells.
        pub least_gain: f64 = 1e-6,
        /// Cells that each bin of yaw has in advance: no leaf excludes a yaw.
        pub yaw_prior: f32 = 0.5,
        /// Cells that front and back have in advance in each class of a leaf.
        pub front_prior: f32 = 0.5,
    }
}
