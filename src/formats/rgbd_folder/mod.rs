//! RGBD folders: `camera.json`, `depth/*.png`, colour in `rgb/` or `color/`, and time lists as in the TUM RGB-D benchmark.

mod datasets;
mod index;
mod names;
mod pair;
mod pairing;
mod reader;
mod resume;
mod writer;

pub(crate) use reader::read_lenses;
pub use reader::{RgbdFolder, depth_to_mm, read_camera};
pub use writer::RgbdFolderWriter;

#[cfg(test)]
mod layout_tests;
#[cfg(test)]
mod tests;
