//! Bounds and placements of the people bench.

use tryon_geometry::settings;

settings! {
    /// Bounds of the bars, and where people stand.
    pub struct PeopleSettings {
        /// Largest coefficient of a random shape (standard deviations).
        pub largest: f64 = 2.0,
        /// Largest mean error of a usable pose (mm); the limits of the real recordings' judges.
        pub usable_mean: f64 = 120.0,
        /// Largest error of a joint of a usable pose (mm).
        pub usable_worst: f64 = 300.0,
        /// Mean error above which a frame of `unlike` is far off (mm).
        pub far: f64 = 40.0,
        /// Distance of the start of `unlike` (m).
        pub unlike_away: f64 = 2.7,
        /// Largest mean error of a person found in `poses` (mm).
        pub found_mean: f64 = 60.0,
        /// Largest error of a joint in view of a person found in `poses` (mm).
        pub found_worst: f64 = 200.0,
        /// Stands for the error of a lost person in `poses` (mm): above every measured one.
        pub lost: f64 = 9999.0,
        /// Turn to either side in `poses` (rad).
        pub turn: f64 = 0.35,
        /// Distances in `poses` (m).
        pub away: [f64; 2] = [2.1, 2.8],
        /// Stands for the heading of a lost person in `sides` (degrees).
        pub lost_heading: f64 = 999.0,
        /// Largest error of a joint found in `limb` (mm).
        pub found_limb: f64 = 100.0,
        /// Distance of a live torso in `shops` from every person's from which it is something else (m).
        pub near: f64 = 0.4,
        /// Start of a passer-by in `shops`: to the left of the subject and behind it (m).
        pub passer: [f64; 2] = [-1.8, -1.1],
        /// Largest distance of a joint in `stills` from the truth (m): the measure of the published results.
        pub within: f64 = 0.10,
    }
}
