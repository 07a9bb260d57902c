//! MCAP recordings with Foxglove's protobuf schemas: readable by Foxglove and rerun.
//!
//! Topics: `/camera/depth` (RawImage `16UC1`, millimetres), `/camera/color` (CompressedImage `jpeg`),
//! `/camera/calibration` (CameraCalibration, once for each camera), `/tf` (FrameTransform, when colour has its own
//! camera). Log time is capture time. Each frame is a chunk of its own: a truncated file keeps all whole frames.

mod message;
mod reader;
mod record;
mod writer;

pub use reader::McapReader;
pub use writer::McapWriter;

#[cfg(test)]
mod tests;
