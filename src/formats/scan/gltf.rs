//! Scans from glTF: all primitives of the default scene in one mesh, base colours as vertex colours.

use super::colors::quantized;
use super::mesh::ScanMesh;
use crate::FormatError;
use crate::gltf::read_gltf_scan;
use std::path::Path;

/// Reads a `.gltf` or `.glb` scan.
///
/// # Errors
/// Names the mesh and the accessor or face at fault, or the texture that is missing.
pub(super) fn read_scene(path: &Path) -> Result<ScanMesh, FormatError> {
    let scan = read_gltf_scan(path)?;
    Ok(ScanMesh {
        points: scan.points,
        faces: scan.faces,
        normals: Vec::new(),
        colors: quantized(&scan.colors, 255.0),
        texture: scan.texture,
        origins: scan.origins,
        notes: scan.notes,
    })
}
