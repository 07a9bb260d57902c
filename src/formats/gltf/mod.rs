//! Meshes as glTF 2.0: writes `.glb` with materials, skins and motion; reads `.glb` and `.gltf`.

mod accessors;
mod base_colors;
mod document;
mod reader;
pub(crate) mod skinned;
mod srgb;
mod surface;
mod uri;
mod writer;

pub(super) use reader::read_gltf_scan;
pub use reader::{GltfModel, GltfPart, parse_gltf, read_glb};
pub use skinned::{
    GlbInterpolation, GlbJoint, GlbJointMotion, GlbMorphMotion, GlbMorphTarget, SkinnedGlb,
    SkinnedMesh, encode_skinned_glb, write_skinned_glb,
};
pub use surface::GlbMesh;
pub use writer::{encode_glb, write_glb, write_glb_motion};

#[cfg(test)]
mod tests;
