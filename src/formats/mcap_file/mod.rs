//! MCAP recordings: read with the schemas of Foxglove and ROS, written with Foxglove's, for Foxglove and rerun.
//!
//! Topics written: `/camera/depth` (RawImage `16UC1`, millimetres), `/camera/color` (CompressedImage `jpeg`),
//! `/camera/depth/calibration` and, when colour has its own camera, `/camera/color/calibration` (CameraCalibration) and
//! `/tf` (FrameTransform), once each. Log time is capture time. Each frame is a chunk of its own: a truncated file keeps
//! all whole frames, and [`McapWriter::resume`] continues it.

mod chunk;
mod reader;
mod record;
mod resume;
mod writer;

pub(crate) use reader::McapMessages;
pub use writer::McapWriter;

#[cfg(test)]
mod tests;
