//! Meshes as glTF 2.0: writes `.glb` with materials and optional motion; reads `.glb` and `.gltf`.

mod reader;
mod writer;

pub use reader::{GltfModel, GltfPart, parse_gltf, read_glb};
pub use writer::{GlbMesh, encode_glb, write_glb, write_glb_motion};

#[cfg(test)]
mod tests;
