//! Interface of every recording: a calibration and frames in order.

use super::{CameraFile, FormatError};
use tryon_geometry::camera::{Calibration, LensCalibration, RgbdFrame};

/// Largest time between colour and its depth, nanoseconds: half a period at 15 Hz, the slowest tracking rate. Older
/// colour shows another pose.
pub(crate) const MAX_COLOR_GAP_NS: u64 = 33_400_000;

/// Frame period of recordings without times, nanoseconds: 30 Hz, that of most depth cameras.
pub(crate) const NOMINAL_PERIOD_NS: u64 = 1_000_000_000 / 30;

/// Frames of one camera, in capture order.
pub trait RgbdSource: Send {
    /// Calibration of all frames.
    fn calibration(&self) -> &Calibration;
    /// Calibration with the distortion that the frames still have: none, unless a reader says so.
    fn lenses(&self) -> LensCalibration {
        self.calibration().clone().into()
    }
    /// Calibration as recorded: distortion of the lenses, unit of depth, clock of colour.
    fn camera_file(&self) -> CameraFile {
        self.lenses().into()
    }
    /// Topics and fields that the recording holds and no frame will have, and why.
    fn untaken(&self) -> &[String] {
        &[]
    }
    /// Capture time of the last frame's colour, nanoseconds, where the recording states it apart from depth's.
    fn color_time_ns(&self) -> Option<u64> {
        None
    }
    /// Number of frames, if known without reading them all.
    fn len(&self) -> Option<usize>;
    /// True if it is known to contain no frame.
    fn is_empty(&self) -> bool {
        self.len() == Some(0)
    }
    /// The next frame; `None` at the end. After an error the next call returns the frame after the bad one.
    ///
    /// # Errors
    /// Names the file and the field of this frame.
    fn next_frame(&mut self) -> Result<Option<RgbdFrame>, FormatError>;
    /// Passes over a frame; false at the end. As [`Self::next_frame`], but its images need not be decoded.
    ///
    /// # Errors
    /// As [`Self::next_frame`]; damage of images that are not decoded stays unnoticed.
    fn skip_frame(&mut self) -> Result<bool, FormatError> {
        Ok(self.next_frame()?.is_some())
    }
    /// Returns to the first frame.
    ///
    /// # Errors
    /// When the file cannot be read again.
    fn rewind(&mut self) -> Result<(), FormatError>;
}
