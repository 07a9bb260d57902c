//! Record3D recordings (`.r3d`) of an iPhone or iPad: a zip with `metadata` (JSON), `rgbd/N.depth` (LZFSE) and
//! `rgbd/N.jpg`.

mod metadata;
mod reader;

pub use reader::R3dReader;

#[cfg(test)]
mod tests;
