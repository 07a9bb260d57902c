//! Settings of scenes by the live step.

use super::{DrapeSettings, NewtonSettings, settings};

settings! {
    /// Settings of textile tests.
    pub struct FabricTestSettings {
        /// Gravity (m/s²).
        pub gravity: f64 = 9.81,
        /// Shortest edge (m): below, a test takes hours.
        pub shortest_edge: f64 = 5e-4,
        /// Longest edge (m): above, a specimen has no free square.
        pub longest_edge: f64 = 0.05,
        /// Height of the bumps that a disc starts with (m): a flat one has no side to fold to.
        pub bump: f64 = 1e-3,
        /// Shear angle of the picture frame (rad): 2.5°, the end of the slope of KES-FB1.
        pub shear_angle: f64 = 2.5 / 180.0 * std::f64::consts::PI,
        /// Shares of gravity that an offline specimen comes to rest under, one after another, as the plates of the test sink
        /// slowly. One alone lets it fall, into more folds.
        pub loading: [f64; 5] = [0.1, 0.2, 0.4, 0.7, 1.0],
        /// Newton's method offline: what is read is the model and not the end of the iteration.
        pub newton: NewtonSettings = NewtonSettings {
            tolerance: 1e-5,
            linear_share: 0.01,
            ..NewtonSettings::default()
        },
        /// End of an offline drape.
        pub drape: DrapeSettings = DrapeSettings {
            tolerance: 1e-4,
            most_steps: 300,
            ..DrapeSettings::default()
        },
        /// Damping of a real-time specimen (1/s): it has no part in the place of rest, a larger one arrives later.
        pub damping: f64 = 6.0,
        /// Time for a real-time specimen to come to rest (s).
        pub duration: f64 = 6.0,
        /// Frames of a real-time specimen in a second; motion is measured between them.
        pub rate: f64 = 30.0,
        /// Speed below which a real-time specimen is at rest (m/s).
        pub still: f64 = 1e-3,
    }

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
