//! A synthetic sequence as a source of frames.

use super::Sequence;
use tryon_formats::{FormatError, RgbdSource};
use tryon_geometry::camera::{Calibration, RgbdFrame};

/// Frames of a [`Sequence`] in order.
#[derive(Clone, Debug)]
pub struct SynthSource {
    sequence: Sequence,
    frames: Option<u64>,
    next: u64,
    /// Calibration that the source states instead of the true one.
    stated: Option<Calibration>,
}

impl SynthSource {
    /// The first `frames` frames; `None` is endless.
    pub fn new(sequence: Sequence, frames: Option<u64>) -> Self {
        Self {
            sequence,
            frames,
            next: 0,
            stated: None,
        }
    }
    /// The same frames with a calibration that need not be theirs: of a camera that does not know it.
    #[must_use]
    pub fn stating(self, calibration: Calibration) -> Self {
        Self {
            stated: Some(calibration),
            ..self
        }
    }
    /// The sequence, with its ground truth.
    pub fn sequence(&self) -> &Sequence {
        &self.sequence
    }
}

impl RgbdSource for SynthSource {
    fn calibration(&self) -> &Calibration {
        let truth = self.sequence.calibration();
        self.stated.as_ref().unwrap_or(truth)
    }
    fn len(&self) -> Option<usize> {
        self.frames.and_then(|n| usize::try_from(n).ok())
    }
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError> {
        if self.frames.is_some_and(|n| self.next >= n) {
            return Ok(None);
        }
        let (frame, _) = self.sequence.frame(self.next);
        self.next += 1;
        Ok(Some(frame))
    }
    fn rewind(&mut self) -> Result<(), FormatError> {
        self.next = 0;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Actor, Routine, Setting};

    #[test]
    fn source_ends_after_its_frames_and_rewinds_to_the_same_bits() {
        let setting = Setting {
            routine: Routine::Empty,
            color: false,
            ..Setting::default()
        };
        let mut s = SynthSource::new(Sequence::new(Actor::default(), setting), Some(2));
        assert_eq!(s.len(), Some(2));
        let first = s.next_frame().expect("frame").expect("frame");
        assert_eq!(s.next_frame().expect("frame").map(|f| f.sequence), Some(1));
        assert!(s.next_frame().expect("end").is_none());
        s.rewind().expect("rewinds");
        assert_eq!(s.next_frame().expect("frame"), Some(first));
    }
}
