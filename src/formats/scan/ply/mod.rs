//! PLY (Stanford polygon format): reads ASCII and binary files, writes binary ones.

mod header;
mod reader;
mod values;
mod writer;

pub(super) use reader::read_ply;
pub use writer::{PlyMesh, write_ply};
