//! Frames of a camera or a recording for a while, with the time of arrival of live ones.

use crate::args::CameraSourceArgs;
use crate::interrupt::Interrupt;
use anyhow::{Context, Result, bail, ensure};
use std::time::Instant;
use tryon::formats::RgbdSource;
use tryon::geometry::camera::{Calibration, RgbdFrame};

/// Unreadable frames in a row after which a camera counts as failed.
const MAX_FAULTS: usize = 30;

/// Frames until a time, the end of the recording, or Ctrl-C.
pub(super) struct Frames {
    source: Box<dyn RgbdSource>,
    /// Frames of a camera come at their time; those of a recording as fast as they are read.
    is_live: bool,
    seconds: Option<f64>,
    interrupt: Interrupt,
    begun: Instant,
    /// Capture time of the first frame (ns).
    first_ns: Option<u64>,
    /// Frames that could not be read.
    pub(super) unreadable: usize,
}

/// A frame, and the time since the begin at which it arrived (ns) if it is live.
pub(super) struct ArrivedFrame {
    pub(super) frame: RgbdFrame,
    pub(super) arrival_ns: Option<u64>,
}

impl Frames {
    /// Opens the source of `from`; without `seconds` its frames have no end but their own.
    ///
    /// # Errors
    /// Names the source and its fault, or a time that is none.
    pub(super) fn open(from: &CameraSourceArgs, seconds: Option<f64>) -> Result<Self> {
        let is_time = seconds.is_none_or(|s| s.is_finite() && s > 0.0);
        ensure!(is_time, "--seconds: a positive number of seconds is needed");
        Ok(Self {
            source: from.recording.open_source(&from.source)?,
            is_live: tryon_capture_service::is_live(&from.source),
            seconds,
            interrupt: Interrupt::watch()?,
            begun: Instant::now(),
            first_ns: None,
            unreadable: 0,
        })
    }

    /// Calibration of the frames.
    pub(super) fn calibration(&self) -> &Calibration {
        self.source.calibration()
    }

    /// Frames come at their time.
    pub(super) fn is_live(&self) -> bool {
        self.is_live
    }

    /// Number of frames, if known.
    pub(super) fn len(&self) -> Option<usize> {
        self.source.len()
    }

    /// The next frame, unreadable ones told and left out; `None` at the end.
    ///
    /// # Errors
    /// When a source has failed for good.
    pub(super) fn next(&mut self) -> Result<Option<ArrivedFrame>> {
        let mut faults = 0;
        while !self.interrupt.is_asked() && !self.is_over_by_clock() {
            match self.source.next_frame() {
                Ok(None) => return Ok(None),
                Ok(Some(frame)) => return Ok(self.in_time(frame)),
                Err(e) => {
                    eprintln!("tryon: a frame is left out: {e}");
                    (self.unreadable, faults) = (self.unreadable + 1, faults + 1);
                    if faults == MAX_FAULTS {
                        return Err(e).context("no frame can be read");
                    }
                }
            }
        }
        Ok(None)
    }

    /// The time of a live camera is over, whatever its own clock says.
    fn is_over_by_clock(&self) -> bool {
        let is_over = |s: f64| self.begun.elapsed().as_secs_f64() >= s;
        self.is_live && self.seconds.is_some_and(is_over)
    }

    fn in_time(&mut self, frame: RgbdFrame) -> Option<ArrivedFrame> {
        let first = *self.first_ns.get_or_insert(frame.time_ns);
        let age = frame.time_ns.saturating_sub(first) as f64 * 1e-9;
        if !self.is_live && self.seconds.is_some_and(|s| age >= s) {
            return None;
        }
        let now = self.begun.elapsed().as_nanos() as u64;
        Some(ArrivedFrame {
            frame,
            arrival_ns: self.is_live.then_some(now),
        })
    }
}

/// Fails for a source without frames.
///
/// # Errors
/// Names the source.
pub(super) fn ensure_frames<T>(source: &str, result: Option<T>) -> Result<T> {
    match result {
        Some(result) => Ok(result),
        None => bail!("{source}: no frame came"),
    }
}
