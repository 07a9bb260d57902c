//! Families of cameras, each with its library, and their streams.

use std::fmt;

/// Library that drives a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Family {
    /// Kinect v1 by libfreenect.
    Freenect,
    /// PrimeSense, Xtion and Astra by OpenNI 2.
    Openni,
    /// RealSense by Video4Linux.
    V4l2,
}

impl Family {
    /// All of them, in the order of reports.
    pub const ALL: [Self; 3] = [Self::Freenect, Self::Openni, Self::V4l2];

    /// Name in a source: `freenect`, `openni` or `v4l2`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Freenect => "freenect",
            Self::Openni => "openni",
            Self::V4l2 => "v4l2",
        }
    }

    /// File that the family needs, and the Debian package that has it.
    pub(crate) const fn library(self) -> (&'static str, &'static str) {
        match self {
            Self::Freenect => ("libfreenect.so.0.5", "libfreenect0.5"),
            Self::Openni => ("libOpenNI2.so.0", "libopenni2-0"),
            // The kernel's own; a box without the module has no such class.
            Self::V4l2 => ("/sys/class/video4linux", "linux-image-amd64"),
        }
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Kind of images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// Depth.
    Depth,
    /// Colour.
    Color,
}

impl Stream {
    /// `depth` or `color`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Color => "color",
        }
    }
}
