//! Settings of the estimation.

use tryon_geometry::settings;

settings! {
    /// Estimation of extrinsics and time offset from a person who walks.
    pub struct ExtrinsicsSettings {
        /// Frames of which the empty scene is made; each is kept in memory.
        pub background_frames: usize = 48,
        /// Frames that are compared, at most: one byte a colour pixel each.
        pub frames: usize = 288,
        /// Consecutive frames compared at a time, of a recording that has more than `frames`.
        pub burst: usize = 24,
        /// Frames with a person that are needed: a second at 30 Hz.
        pub least_frames: usize = 30,
        /// Columns that colour is reduced to by whole factors, about.
        pub color_columns: u32 = 640,
        /// Rotation between the cameras at the start that is unknown, at most (rad).
        pub unknown_rotation: f64 = 0.12,
        /// Translation between them that is unknown, at most (m).
        pub unknown_translation: f64 = 0.1,
        /// Time offset, at most (s).
        pub unknown_time: f64 = 0.12,
        /// Step of the times that are tried at the start (s).
        pub time_step: f64 = 0.04,
        /// Depth by which a reading of the person is before the empty scene, share of the latter's and at least (m).
        pub before_scene: [f32; 2] = [0.03, 0.08],
        /// Least surface of a person (m²).
        pub least_area: f32 = 0.12,
        /// Standard deviation of the smoothing of the person's mask (depth pixels). Larger rounds off limbs.
        pub smoothing: f32 = 1.5,
        /// Depth between the outline and the scene behind it, at least (m): contact shadows are nearer.
        pub behind: f32 = 0.4,
        /// Outline points of a frame, at most.
        pub points: usize = 240,
        /// Brightness of the empty scene below which it is too dark (levels of 255).
        pub least_brightness: u8 = 16,
        /// Change across the border of the person that counts (levels of 255).
        pub least_contrast: f32 = 14.0,
        /// Share of outline points that must be met in colour.
        pub least_met: f64 = 0.25,
        /// Largest standard deviation of the residuals of a calibration (pixels of reduced colour).
        pub most_residual: f64 = 3.0,
        /// Independent pieces of an outline: residuals of neighbouring points agree.
        pub outline_pieces: f64 = 6.0,
        /// Displacement of the person after which an outline is a new one (m).
        pub new_place: f64 = 0.1,
        /// Largest standard deviation of translation (m), rotation (rad) and time (s); above, an axis is not observable.
        pub most_deviation: [f64; 3] = [0.005, 0.0044, 0.004],
    }
}
