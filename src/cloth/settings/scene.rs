//! Settings of scenes by the live step.

use super::settings;

settings! {
    /// Settings of scenes by the live step.
    pub struct SceneSettings {
        /// Distance that cloth keeps from solids (m): hides neither rounding nor a fabric's thickness.
        pub offset: f64 = 5e-4,
        /// Bound of the substeps in 1/60 s: beyond it a fabric is stiffer than any cloth.
        pub most_steps: usize = 10_000,
        /// Longest step (s): frames further apart are divided, so that solids move evenly through each.
        pub longest_step: f64 = 1.0 / 60.0,
        /// Edge of the triangle that holds the pins (m). Shorter: pins far from it lose digits.
        pub pin_frame: f64 = 0.1,
        /// Wanted length of a solid's edges (m): the chord of a sphere of 0.3 m then lies 0.2 mm below its surface, and live
        /// contact, which queries around the nearest vertex, finds the closest point.
        pub edge: f64 = 0.02,
        /// Fewest and most segments around a solid's axis: solids beyond them have longer edges.
        pub segments: [f64; 2] = [32.0, 512.0],
        /// Most bands along a capsule's tube, likewise.
        pub max_bands: f64 = 256.0,
        /// Largest radius whose edges are short enough for live contact (m).
        pub largest_radius: f64 = 2.0,
        /// Largest half length of a capsule, likewise (m).
        pub largest_half: f64 = 3.0,
    }
}
