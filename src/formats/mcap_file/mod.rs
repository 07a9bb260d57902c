//! MCAP recordings: read with the schemas of Foxglove and ROS, written with Foxglove's, for Foxglove and rerun.
//!
//! Topics written: `/camera/depth` (RawImage `16UC1`, millimetres), `/camera/color` (CompressedImage `jpeg`),
//! `/camera/calibration` (CameraCalibration, once for each camera), `/tf` (FrameTransform, when colour has its own
//! camera). Log time is capture time. Each frame is a chunk of its own: a truncated file keeps all whole frames.

mod chunk;
mod reader;
mod record;
mod writer;

pub(crate) use reader::McapMessages;
pub use writer::McapWriter;

#[cfg(test)]
mod tests;
