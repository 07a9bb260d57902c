//! Vertex colours from the materials of an OBJ file: means over face corners.

use super::mtl::{MtlMaterial, read_libraries};
use crate::FormatError;
use crate::TexturePoint;
use crate::image::{read_color, sample_texture};
use crate::obj_records::ObjRecords;
use crate::texture_points::{TexturePoints, TexturedFace};
use std::collections::BTreeSet;
use std::path::Path;

/// Sums of the colours of the corners at each vertex.
struct CornerSums {
    sums: Vec<[f32; 3]>,
    counts: Vec<f32>,
}

impl CornerSums {
    fn new(vertices: usize) -> Self {
        Self {
            sums: vec![[0.0; 3]; vertices],
            counts: vec![0.0; vertices],
        }
    }

    /// Adds the colour of a corner at `vertex`.
    fn add(&mut self, vertex: u32, color: [f32; 3]) {
        let v = vertex as usize;
        if let (Some(sum), Some(count)) = (self.sums.get_mut(v), self.counts.get_mut(v)) {
            *count += 1.0;
            for (s, c) in sum.iter_mut().zip(color) {
                *s += c;
            }
        }
    }

    /// Mean colours; NaN for a vertex without a coloured corner.
    fn means(self) -> Vec<[f32; 3]> {
        let means = self.sums.iter().zip(&self.counts);
        means.map(|(sum, count)| sum.map(|s| s / count)).collect()
    }
}

/// Mean colour of the corners of each vertex, sRGB, 0 to 255, shape `[vertices]`, NaN for a vertex without one; and colours
/// of the textures between the vertices.
///
/// The colour of a corner is `map_Kd` at its texture coordinate, or `Kd` of a material without texture.
/// A material that no library has leaves its corners without colour.
///
/// # Errors
/// Names the library or texture that is missing or damaged.
pub(super) fn corner_colors(
    records: &ObjRecords,
    origin: &Path,
) -> Result<(Vec<[f32; 3]>, Vec<TexturePoint>), FormatError> {
    let mut corners = CornerSums::new(records.vertices.len());
    let mut points = Vec::new();
    if records.materials.is_empty() {
        return Ok((corners.means(), points));
    }
    let library = read_libraries(origin, &records.libraries)?;
    let materials: Vec<Option<&MtlMaterial>> =
        records.materials.iter().map(|m| library.get(m)).collect();
    add_plain(records, &materials, &mut corners);
    let maps = materials.iter().flatten().filter_map(|m| m.map.as_deref());
    // One texture at a time in memory.
    for map in maps.collect::<BTreeSet<_>>() {
        add_textured(records, &materials, map, &mut corners, &mut points)
            .map_err(|e| FormatError::field(origin, "map_Kd", e.to_string()))?;
    }
    Ok((corners.means(), points))
}

/// Material of a face.
fn material_of<'a>(
    records: &ObjRecords,
    materials: &[Option<&'a MtlMaterial>],
    face: usize,
) -> Option<&'a MtlMaterial> {
    let index = records.face_materials.get(face).copied().flatten()?;
    materials.get(index).copied().flatten()
}

/// Adds the corners whose material has a colour and no texture.
fn add_plain(records: &ObjRecords, materials: &[Option<&MtlMaterial>], corners: &mut CornerSums) {
    for (f, face) in records.faces.iter().enumerate() {
        let material = material_of(records, materials, f).filter(|m| m.map.is_none());
        if let Some(color) = material.and_then(|m| m.color) {
            face.iter()
                .for_each(|v| corners.add(*v, color.map(|c| 255.0 * c)));
        }
    }
}

/// Adds the corners whose material has the texture `map`, and points between them.
fn add_textured(
    records: &ObjRecords,
    materials: &[Option<&MtlMaterial>],
    map: &Path,
    corners: &mut CornerSums,
    points: &mut Vec<TexturePoint>,
) -> Result<(), FormatError> {
    let image = read_color(map)?;
    let places = TexturePoints::over(&records.vertices, &records.faces, 1);
    for (f, (face, uv)) in records.faces.iter().zip(&records.face_uv).enumerate() {
        let has_map =
            material_of(records, materials, f).is_some_and(|m| m.map.as_deref() == Some(map));
        let Some(uv) = uv.filter(|_| has_map) else {
            continue;
        };
        // OBJ counts v upwards from the lower border.
        let at = uv.map(|t| records.uv.get(t as usize).map(|t| [t[0], 1.0 - t[1]]));
        if let [Some(a), Some(b), Some(c)] = at {
            let textured = TexturedFace {
                face: f as u32,
                corners: face.map(|v| records.vertices[v as usize]),
                uv: [a, b, c],
            };
            places.add(&textured, &image, |c| c, points);
        }
        for (vertex, at) in face.iter().zip(at) {
            if let Some(color) = at.and_then(|at| sample_texture(&image, at)) {
                corners.add(*vertex, color);
            }
        }
    }
    Ok(())
}
