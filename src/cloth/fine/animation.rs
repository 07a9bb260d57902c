//! A whole animation: frames in order, progress with the time left, cancel, checkpoints that resume to the same bits.

use super::error::OfflineError;
use super::step::{OfflineFrameReport, OfflineSolver};
use super::targets::FrameTargets;
use std::ops::{ControlFlow, RangeInclusive};
use std::time::Instant;

/// A frame that is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnimationProgress {
    /// Frame, the start being 0.
    pub frame: usize,
    /// Frames in all, the start not counted.
    pub frames: usize,
    /// Work of the frame.
    pub report: OfflineFrameReport,
    /// Computing time so far, and an estimate of what is left (s). No result depends on them.
    pub seconds: [f64; 2],
}

impl OfflineSolver<'_> {
    /// Simulates `frames`, counted from 1, each of `duration` (s). `script` gives the targets of a frame;
    /// `progress` receives each frame with the solver and may break off. Returns the last frame done.
    ///
    /// # Errors
    /// A step that is not solved; the state is then that before it.
    pub fn animate<'t>(
        &mut self,
        duration: f64,
        frames: RangeInclusive<usize>,
        mut script: impl FnMut(usize) -> FrameTargets<'t>,
        mut progress: impl FnMut(&AnimationProgress, &Self) -> ControlFlow<()>,
    ) -> Result<usize, OfflineError> {
        let started = Instant::now();
        let (first, frames) = (frames.start().saturating_sub(1), *frames.end());
        for frame in first + 1..=frames {
            let report = self.advance(duration, &script(frame))?;
            let spent = started.elapsed().as_secs_f64();
            let left = spent / (frame - first) as f64 * (frames - frame) as f64;
            let done = AnimationProgress {
                frame,
                frames,
                report,
                seconds: [spent, left],
            };
            if progress(&done, self).is_break() {
                return Ok(frame);
            }
        }
        Ok(frames.max(first))
    }
}
