//! Report and error of a step.

use super::status::Status;
use crate::assess::{Agreement, JointConfidence};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Wall time of each stage of one step, milliseconds. No result depends on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TrackingStagesMs {
    /// Sampling the depth image, floor, background, person, outline.
    pub segment: f64,
    /// Initial pose.
    pub place: f64,
    /// Prediction and pose.
    pub pose: f64,
    /// Body size and shape.
    pub size: f64,
    /// Filter of the pose, agreement, confidence, arms that no reading shows, and the rest of the step.
    pub assess: f64,
    /// Repairs and tests of person and facing, with the part network.
    pub repair: f64,
    /// Displacements.
    pub surface: f64,
}

impl TrackingStagesMs {
    /// All stages.
    pub fn total(&self) -> f64 {
        let fit = self.place + self.pose + self.size;
        self.segment + fit + self.assess + self.repair + self.surface
    }
}

/// Counts of skipped work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Skipped {
    /// Template samples that the camera cannot see, at the last iteration.
    pub hidden_points: usize,
    /// Iterations that convergence saved.
    pub iterations: usize,
    /// Coarse iterations that a good prediction saved.
    pub coarse_iterations: usize,
    /// Vertices whose displacement was not updated at this frame.
    pub displacements: usize,
    /// Pairs dropped by relaxed bijective consistency (eq. 9), at the last iteration.
    pub inconsistent_pairs: usize,
    /// Tree queries saved by earlier answers, at the last iteration.
    #[serde(default)]
    pub searches: usize,
    /// Cells of the grid outside the subject.
    pub cells: usize,
    /// 1 for a frame that reused the last report.
    #[serde(default)]
    pub frames: usize,
}

impl Skipped {
    /// Each kind of work with its count, for counters.
    pub fn counts(&self) -> [(&'static str, usize); 7] {
        [
            ("hidden points", self.hidden_points),
            ("iterations", self.iterations),
            ("displacements", self.displacements),
            ("inconsistent pairs", self.inconsistent_pairs),
            ("searches for pairs", self.searches),
            ("empty cells", self.cells),
            ("unchanged frames", self.frames),
        ]
    }
}

/// Report of one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepReport {
    /// Status after the step.
    pub status: Status,
    /// Iterations of the pose fit.
    pub iterations: usize,
    /// True when the pose fit converged within its iterations.
    pub converged: bool,
    /// Template samples visible to the camera.
    pub visible_points: usize,
    /// Cells of the subject.
    pub person_cells: usize,
    /// Mean distance between surface and readings along the normal, millimetres.
    pub residual_mm: f64,
    /// Share of the subject's readings that the body explains, 0 to 1.
    pub explained: f64,
    /// Share of the body's visible points that found a reading, 0 to 1.
    pub matched: f64,
    /// Quality of the frame, 0 to 1: the smaller of `explained` and `matched`, reduced by the residual.
    pub quality: f64,
    /// Agreement of the body with the frame; that of a body without a pose is 0 throughout.
    pub agreement: Agreement,
    /// Confidence of each joint of the skeleton; empty without a live pose.
    pub confidence: Vec<JointConfidence>,
    /// Frames since the pose was measured; 0 for a live pose.
    pub pose_age: u32,
    /// Skipped work.
    pub skipped: Skipped,
    /// Time per stage.
    pub stages_ms: TrackingStagesMs,
}

/// Unusable frame; the state is unchanged.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StepError {
    /// The image does not fit the calibration.
    #[error("depth image is {got:?} pixels, the calibration says {expected:?}")]
    ImageSize {
        /// Columns and rows of the image.
        got: (u32, u32),
        /// Columns and rows of the calibration.
        expected: (u32, u32),
    },
    /// The state belongs to another template.
    #[error("the state has {got} joint angles, the template {expected}")]
    ForeignState {
        /// Angles in the state.
        got: usize,
        /// Angles of the template.
        expected: usize,
    },
    /// A number is infinite or not a number. A bad pose alone is no error: the subject is lost and found again.
    #[error("{field} is not finite")]
    NotFinite {
        /// Path of the field.
        field: &'static str,
    },
}

/// A stopwatch for stages.
pub(super) struct Stopwatch(Instant);

impl Stopwatch {
    pub(super) fn start() -> Self {
        Self(Instant::now())
    }
    /// Milliseconds since the last lap.
    pub(super) fn lap(&mut self) -> f64 {
        let now = Instant::now();
        let ms = now.duration_since(self.0).as_secs_f64() * 1e3;
        self.0 = now;
        ms
    }
}
