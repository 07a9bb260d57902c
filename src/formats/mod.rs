//! Files in and out: MCAP, RGBD folders, npz bodies, OBJ, glTF, patterns. Bytes to domain types, never a panic.

pub mod asf_amc;
pub mod bvh;
mod error;
pub mod fabric_json;
mod foxglove;
pub mod garmentcode;
pub mod gltf;
pub mod image;
mod mcap_file;
pub mod mhclo;
mod motion;
pub mod npy;
pub mod npz;
pub mod obj;
mod position_codec;
mod recording;
mod rgbd_folder;
pub mod sewn_obj;

pub use error::FormatError;
pub use mcap_file::{McapReader, McapWriter};
pub use motion::{MotionClip, read_motion};
pub use position_codec::{PositionCoder, STEP as POSITION_STEP};
pub use recording::{RgbdSource, open_recording};
pub use rgbd_folder::{RgbdFolder, RgbdFolderWriter, depth_to_mm, read_camera};
