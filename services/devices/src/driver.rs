//! Interface of the drivers: images as a camera sends them.

use super::{DeviceError, Stream};
use std::time::Duration;
use tryon_geometry::camera::LensCalibration;

/// Longest wait of one poll. A driver that is told to stop ends within it.
pub(crate) const POLL: Duration = Duration::from_millis(100);

/// Layout of an image's bytes, little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// 16-bit depth in the camera's unit.
    Depth16,
    /// 16-bit disparity of the Kinect v1, 11 bits used.
    KinectDisparity,
    /// Red, green, blue.
    Rgb8,
    /// Two pixels as Y, U, Y, V.
    Yuyv,
    /// Two pixels as U, Y, V, Y.
    Uyvy,
    /// Luma alone.
    Grey8,
    /// A JPEG an image.
    Jpeg,
}

impl Encoding {
    /// Bytes of a pixel; `None` for compressed images.
    pub(crate) fn pixel_bytes(self) -> Option<usize> {
        match self {
            Self::Rgb8 => Some(3),
            Self::Depth16 | Self::KinectDisparity | Self::Yuyv | Self::Uyvy => Some(2),
            Self::Grey8 => Some(1),
            Self::Jpeg => None,
        }
    }
}

/// Format of a stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StreamFormat {
    pub(crate) encoding: Encoding,
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Images a second.
    pub(crate) rate: f64,
}

/// Formats of a camera's streams.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Formats {
    pub(crate) depth: StreamFormat,
    /// `None` without colour.
    pub(crate) color: Option<StreamFormat>,
}

/// One image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct SensorImage {
    pub(crate) stream: Stream,
    /// Capture time on the camera's clock, nanoseconds; one clock for both streams.
    pub(crate) time_ns: u64,
    pub(crate) bytes: Vec<u8>,
}

/// A camera whose streams run. Dropping it ends them.
pub(crate) trait Driver: Send {
    /// Waits at most [`POLL`] for images and passes them on.
    ///
    /// # Errors
    /// When the camera has gone.
    fn poll(&mut self, sink: &mut dyn FnMut(SensorImage)) -> Result<(), DeviceError>;
}

/// An opened camera.
pub(crate) struct Opened {
    /// `FAMILY:SERIAL`.
    pub(crate) name: String,
    pub(crate) driver: Box<dyn Driver>,
    pub(crate) formats: Formats,
    pub(crate) lenses: LensCalibration,
    /// Units of depth in a metre.
    pub(crate) depth_scale: f64,
}
