//! Settings of the capture bench.

use tryon_geometry::settings;

settings! {
    /// Scans, films and scores of the capture bench.
    pub struct CaptureBenchSettings {
        /// Points of a scan.
        pub points: usize = 60_000,
        /// Standard deviation of a scan's depth noise (m).
        pub noise: f64 = 1e-3,
        /// Scans of a scene.
        pub scans: usize = 3,
        /// Their rate (1/s).
        pub rate: f64 = 5.0,
        /// Edge length of cloth (m).
        pub edge: f64 = 0.021,
        /// Frames of a film.
        pub frames: usize = 96,
        /// Their rate (1/s).
        pub film_rate: f64 = 10.0,
        /// Frames before the turn begins: the tracker measures the size.
        pub standing: usize = 12,
        /// Turn about the vertical from the first to the last frame of a film (turns).
        pub turns: f64 = 1.05,
        /// Points of a true scan that labels of a film are judged at.
        pub film_points: usize = 20_000,
        /// Frames of a film with true scan points lie within this angle of facing the camera (rad).
        pub frontal: f64 = 0.2,
        /// Farthest fused point of a film that labels a true one (m).
        pub reach: f32 = 0.03,
        /// Least share of a scan's points that a garment needs to be judged; less is a rim under another one.
        pub least_share: f64 = 0.005,
        /// Distance within which points are neighbours (m).
        pub neighbours: f32 = 0.008,
        /// Farthest boundary that is searched (m).
        pub farthest: f32 = 0.5,
        /// Radius around a hem in which scan points tell whether it is seen (m).
        pub around: f32 = 0.015,
        /// Least share of the garment's own points there. Hems under other garments show where cloth pokes through.
        pub least_own: f64 = 0.25,
    }
}

impl CaptureBenchSettings {
    /// Turn of a film from frame to frame once it has begun (rad).
    pub(super) fn step(&self) -> f64 {
        self.turns * std::f64::consts::TAU / (self.frames - self.standing) as f64
    }
}
