//! MCAP recordings with Foxglove's protobuf schemas: what Foxglove and rerun open.
//!
//! Topics: `/camera/depth` (RawImage `16UC1`, millimetres), `/camera/color` (CompressedImage `jpeg`),
//! `/camera/calibration` (CameraCalibration, once for each camera), `/tf` (FrameTransform, when colour has its own
//! camera). Log time is capture time. Each frame is a chunk of its own: a cut file loses nothing before the cut.

mod reader;
mod writer;

pub use reader::McapReader;
pub use writer::McapWriter;

/// Frame of reference of the depth camera, and of colour registered to it.
const DEPTH_FRAME: &str = "depth_camera";
/// Frame of reference of a separate colour camera.
const COLOR_FRAME: &str = "color_camera";

#[cfg(test)]
mod tests;
