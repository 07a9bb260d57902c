//! Settings of the step: bad frames, doubt, unchanged frames.

use super::settings;

settings! {
    /// Settings of the step.
    pub struct StepSettings {
        /// Share of explained readings below which a frame is bad. Larger loses people in wide clothes.
        pub least_explained: f64 = 0.45,
        /// Share of visible points with a reading below which a frame is bad. Larger loses people behind a table.
        pub least_matched: f64 = 0.35,
        /// Share of the area above which body and frame disagree; see docs/decisions/043. Good tracks stay below 0.16.
        pub most_wrong: f32 = 0.2,
        /// Frames in doubt before the search begins anew. Larger shows a wrong pose for longer.
        pub doubt: u32 = 2,
        /// Age of a last pose up to which it tells front from back at the next start, frames.
        pub recent: u32 = 15,
        /// Bad frames in a row that lose the subject. Larger shows a lost pose for longer.
        pub patience: u32 = 8,
        /// Frames without the subject after which the next one is measured anew. Larger dresses the next person in this
        /// one's size.
        pub forget: u32 = 150,
        /// Residual that halves the quality of a frame, metres.
        pub poor_residual: f64 = 0.02,
        /// Motion per frame below which a fit is at rest, metres. A fit creeps for a dozen frames (an arm along the view by
        /// 0.3 mm each), and would do so in jerks.
        pub resting: f64 = 6e-3,
        /// Frames at rest in a row before frames are compared. Fewer reuse a pose that still creeps.
        pub resting_frames: u32 = 15,
        /// Stride of the change detection over the grid of an empty scene. Larger notices a small person later.
        pub empty_stride: u32 = 2,
        /// Time without own motion after which a subject is a thing, seconds. Who stands as still as possible sways by 2 mm in
        /// it. Larger dresses mannequins for longer.
        pub motionless: f64 = 3.0,
        /// Standard error of a block's mean change above which nobody is said to be motionless, millimetres: a sway of 2 mm is
        /// 1.25 times it with the dead band. Larger leaves people who stand still far away.
        pub most_noise: f32 = 1.4,
        /// Most things that are remembered until they move.
        pub most_things: usize = 8,
        /// Unchanged frames.
        pub change: ChangeSettings = ChangeSettings::default(),
    }

    /// Settings of the change detection.
    pub struct ChangeSettings {
        /// Largest change of a sample that counts, millimetres; a reading that came or went counts as this.
        pub most_change: i32 = 30,
        /// Dead band of a block's mean depth, millimetres: a quarter of the sensor's noise at 2 m. Larger misses slow
        /// motion, smaller reuses nothing.
        pub dead_band: f32 = 0.75,
        /// Normalised change (mean over its standard error and dead band) that counts: root mean square over all blocks, and
        /// of one block. A surface that moves by 1.5 `dead_band` exceeds the first, a hand the second.
        pub changed: [f32; 2] = [1.25, 5.0],
        /// Most frames in a row that reuse a report, so that motion within the noise is at most a fifth of a second late. At
        /// 0 / 5 a step of a subject at rest takes 1.29 / 0.42 ms.
        pub most_reused: u32 = 5,
    }
}
