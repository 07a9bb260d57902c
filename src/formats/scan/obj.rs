//! Scans from OBJ: colours of the vertices, or else of the texture.

use super::colors::{is_finite, quantized, white};
use super::mesh::ScanMesh;
use super::texture::corner_colors;
use crate::FormatError;
use crate::image::read_limited;
use crate::obj_parser::{ObjFaults, parse_records};
use crate::text_encoding::decode_text;
use std::path::Path;

/// Largest OBJ scan, bytes; a scan of 5 million vertices takes about 1 GB.
const MAX_BYTES: u64 = 2 << 30;

/// Reads an `.obj` scan; vertex colours (`v x y z r g b`) win over materials.
///
/// # Errors
/// Names the line at fault, or the material library or texture that is missing.
pub(super) fn read_obj_scan(path: &Path) -> Result<ScanMesh, FormatError> {
    let bytes = read_limited(path, MAX_BYTES)?;
    let records = parse_records(&decode_text(&bytes), path, ObjFaults::Kept)?;
    if records.vertices.is_empty() {
        return Err(FormatError::field(path, "points", records.found()));
    }
    let (colors, texture) = if records.colors.iter().any(is_finite) {
        let own = quantized(&records.colors, white(&records.colors));
        (own, Vec::new())
    } else {
        let (corners, points) = corner_colors(&records, path)?;
        (quantized(&corners, 255.0), points)
    };
    Ok(ScanMesh {
        points: records.vertices,
        faces: records.faces,
        normals: Vec::new(),
        colors,
        texture,
        origins: records.origins,
        notes: records.notes,
    })
}
