//! RGBD folders: `camera.json`, `depth/*.png`, `rgb/*.png|jpg`, and time lists as in the TUM RGB-D benchmark.

mod camera_json;
mod index;
mod reader;
mod writer;

pub use reader::{RgbdFolder, depth_to_mm, read_camera};
pub use writer::RgbdFolderWriter;

#[cfg(test)]
mod tests;
