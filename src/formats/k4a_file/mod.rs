//! Azure Kinect recordings (`.mkv`): Matroska with the tracks COLOR, DEPTH and IR and an attached `calibration.json`.
//!
//! Layout after Microsoft's "Azure Kinect Sensor SDK record file format". The container is walked element by element
//! with an own reader: `matroska-demuxer` 0.8 reads no attachments, and loops for ever on a seek head that names itself.

mod blocks;
mod calibration;
mod ebml;
mod header;
mod pairs;
mod pixels;
mod reader;

pub use reader::K4aReader;

#[cfg(test)]
mod metric_radius_tests;
#[cfg(test)]
mod tests;
