//! Files in and out: MCAP, RGBD folders, npz bodies, OBJ, glTF, patterns. Bytes to domain types, never a panic.

mod error;
pub mod image;
pub mod npz;

pub use error::FormatError;
