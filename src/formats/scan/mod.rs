//! Coloured 3D scans: PLY, OBJ with texture, glTF; folders of them as sequences.

mod colors;
mod files;
mod gltf;
mod mesh;
mod mtl;
mod obj;
mod ply;
mod texture;

pub use files::{read_scan, scan_files};
pub use mesh::ScanMesh;
pub use ply::{PlyMesh, write_ply};

#[cfg(test)]
mod tests;
