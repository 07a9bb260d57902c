//! Real-time chain over a recording, one frame at a call.

use crate::args::RunArgs;
use crate::input;
use anyhow::{Context, Result};
use tryon::formats::RgbdSource;
use tryon::geometry::camera::RgbdFrame;
use tryon::mirror::{Mirror, MirrorFrame};

/// Time between the repetitions of a still picture (ns): 30 a second.
const STILL_INTERVAL_NS: u64 = 33_333_333;

/// Frames of a recording, or repetitions of a still picture, each through the real-time chain.
pub(crate) struct Preview {
    source: Box<dyn RgbdSource>,
    /// The chain.
    pub(crate) mirror: Mirror,
    /// The one frame of a still picture.
    still: Option<RgbdFrame>,
    next: usize,
    /// Frames to come in all, if known.
    pub(crate) total: Option<usize>,
    most: usize,
}

/// A frame and its result.
pub(crate) struct PreviewFrame {
    /// Number in the recording; of the repetition for a still picture.
    pub(crate) index: usize,
    /// The captured frame.
    pub(crate) frame: RgbdFrame,
    /// Result of the chain.
    pub(crate) seen: MirrorFrame,
}

impl Preview {
    /// Opens the recording of `args` with its garments.
    ///
    /// # Errors
    /// Bad input, named.
    pub(crate) fn open(args: &RunArgs) -> Result<Self> {
        let choices = input::choices(&args.garments, &args.given())?;
        let mut source = args.recording.open(&args.input)?;
        let template = input::template(&args.body)?;
        let mut mirror = Mirror::new(template, source.calibration(), choices);
        if let Some(landmarker) = args.color.landmarker()? {
            mirror = mirror.with_landmarker(landmarker);
        }
        let most = args.frames.unwrap_or(usize::MAX);
        let is_still = source.len().map(|n| n.min(most)) == Some(1);
        let still = if is_still { source.next_frame()? } else { None };
        let most = if is_still { args.still_frames } else { most };
        let total = if is_still {
            Some(most)
        } else {
            source.len().map(|n| n.min(most))
        };
        Ok(Self {
            source,
            mirror,
            still,
            next: 0,
            total,
            most,
        })
    }

    /// True for a still picture.
    pub(crate) fn is_still(&self) -> bool {
        self.still.is_some()
    }

    /// Takes the next good frame through the chain; `None` at the end. Bad frames are reported and left out.
    ///
    /// # Errors
    /// A garment that cannot be put on, a frame that does not fit the camera.
    pub(crate) fn next(&mut self) -> Result<Option<PreviewFrame>> {
        while self.next < self.most {
            let index = self.next;
            self.next += 1;
            let frame = match &self.still {
                Some(frame) => repetition(frame, index as u64),
                None => match self.source.next_frame() {
                    Ok(Some(frame)) => frame,
                    Ok(None) => return Ok(None),
                    Err(e) => {
                        eprintln!("tryon: frame {index} is left out: {e}");
                        continue;
                    }
                },
            };
            let seen = self.mirror.step(&frame);
            let seen = seen.with_context(|| format!("frame {index}"))?;
            return Ok(Some(PreviewFrame { index, frame, seen }));
        }
        Ok(None)
    }
}

/// The `k`-th repetition of a still picture.
pub(crate) fn repetition(frame: &RgbdFrame, k: u64) -> RgbdFrame {
    RgbdFrame {
        time_ns: frame.time_ns + k * STILL_INTERVAL_NS,
        sequence: frame.sequence + k,
        ..frame.clone()
    }
}
