//! Binary glTF of skinned meshes: joints, skin, morph targets and motion (glTF 2.0, sections 3.7.2.2, 3.7.3 and 3.11).

mod animation;
mod check;
#[cfg(test)]
mod decoded;
mod joints;
mod mesh;
mod scene;
#[cfg(test)]
mod tests;

pub use scene::{
    GlbInterpolation, GlbJoint, GlbJointMotion, GlbMorphMotion, GlbMorphTarget, SkinnedGlb,
    SkinnedMesh,
};

use super::document::GlbDocument;
use crate::FormatError;
use std::path::Path;

/// Encodes skinned meshes as a `.glb`; all share one skin and one animation.
///
/// # Errors
/// Names the joint, mesh or array at fault: lengths that differ, indices out of range, numbers that are not finite,
/// skinning weights that do not sum to one, or times that do not ascend. Also when the file would exceed 4 GiB.
pub fn encode_skinned_glb(scene: &SkinnedGlb<'_>, origin: &Path) -> Result<Vec<u8>, FormatError> {
    check::check(scene, origin)?;

    let mut document = GlbDocument::default();
    let skin = joints::add_skin(&mut document, scene.joints);
    let nodes: Vec<usize> = scene
        .meshes
        .iter()
        .map(|m| mesh::add_mesh(&mut document, m, skin))
        .collect();

    animation::add_animation(&mut document, scene, &nodes);
    document.finish(origin)
}

/// Writes skinned meshes as a `.glb`.
///
/// # Errors
/// As [`encode_skinned_glb`], or when the file cannot be written.
pub fn write_skinned_glb(path: &Path, scene: &SkinnedGlb<'_>) -> Result<(), FormatError> {
    std::fs::write(path, encode_skinned_glb(scene, path)?).map_err(|e| FormatError::io(path, e))
}
