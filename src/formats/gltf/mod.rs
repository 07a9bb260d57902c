//! Meshes as glTF 2.0: writes `.glb` with materials, skins and motion; reads `.glb` and `.gltf`.

mod accessor_index;
mod accessors;
mod base_colors;
mod buffers;
mod deform;
mod document;
mod draco;
mod file;
mod meshopt;
mod model;
mod part;
mod placement;
mod scene_reader;
mod shape;
pub(crate) mod skinned;
mod srgb;
mod surface;
mod triangles;
mod uri;
mod writer;

pub(super) use model::read_gltf_scan;
pub use model::{GltfModel, parse_gltf, read_glb};
pub use part::GltfPart;
pub use skinned::{
    GlbInterpolation, GlbJoint, GlbJointMotion, GlbMorphMotion, GlbMorphTarget, SkinnedGlb,
    SkinnedMesh, encode_skinned_glb, write_skinned_glb,
};
pub use surface::GlbMesh;
pub use writer::{encode_glb, write_glb, write_glb_motion};

#[cfg(test)]
mod tests;
