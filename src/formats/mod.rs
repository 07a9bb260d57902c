//! Files in and out: MCAP, RGBD folders, npz bodies, OBJ, glTF, patterns. Bytes to domain types, never a panic.

mod error;
pub mod image;
pub mod npz;
pub mod obj;
mod recording;
mod rgbd_folder;

pub use error::FormatError;
pub use recording::{RgbdSource, open_recording};
pub use rgbd_folder::{RgbdFolder, RgbdFolderWriter, depth_to_mm, read_camera};
