//! Shape of a glTF primitive at rest.

use super::deform::{morph, skinned};
use super::file::GltfFile;
use super::triangles::triangles;
use ::gltf::{Primitive, Semantic};
use nalgebra::Matrix4;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Face, MeshError};

/// Vertices and triangles of a primitive in the frame of its node, or of the scene if it is skinned.
pub(super) struct PrimitiveShape {
    pub(super) vertices: Vec<P3>,
    /// Triangles, indices in range.
    pub(super) faces: Vec<Face>,
    /// Texture coordinates, shape `[vertices]`; empty for none.
    pub(super) uv: Vec<[f32; 2]>,
    /// Degenerate triangles that were left out.
    pub(super) degenerate: usize,
}

/// Field at fault, and the fault.
type FieldFault = (&'static str, String);

impl PrimitiveShape {
    /// Reads a primitive; `weights` are those of its morph targets, `joints` the matrices of its skin. `None` for points and
    /// lines.
    ///
    /// # Errors
    /// Names the attribute at fault.
    pub(super) fn read(
        file: &GltfFile,
        p: &Primitive<'_>,
        weights: &[f32],
        joints: Option<&[Matrix4<f32>]>,
    ) -> Result<Option<Self>, FieldFault> {
        let accessors = &file.accessors;
        let positions = p
            .get(&Semantic::Positions)
            .ok_or_else(|| ("POSITION", "missing".into()))?;
        let positions = accessors.floats::<3>(&positions);
        let positions = positions.map_err(|why| ("POSITION", why))?;
        let mut vertices: Vec<P3> = positions.into_iter().map(P3::from).collect();
        let corners = match p.indices() {
            Some(a) => accessors.indices(&a).map_err(|why| ("indices", why))?,
            None => (0..vertices.len() as u32).collect(),
        };
        let found = triangles(&corners, p.mode()).map_err(|why| ("indices", why))?;
        let Some((mut faces, degenerate)) = found else {
            return Ok(None);
        };
        check_range(&faces, vertices.len()).map_err(|why| ("mesh", why))?;
        let uv = match p.get(&Semantic::TexCoords(0)) {
            Some(a) => accessors
                .floats::<2>(&a)
                .map_err(|why| ("TEXCOORD_0", why))?,
            None => Vec::new(),
        };
        if !uv.is_empty() && uv.len() != vertices.len() {
            let why = format!("{} for {} vertices", uv.len(), vertices.len());
            return Err(("TEXCOORD_0", why));
        }

        morph(file, p, weights, &mut vertices).map_err(|why| ("targets", why))?;
        if let Some(matrices) = joints {
            skinned(file, p, matrices, &mut vertices).map_err(|why| ("skin", why))?;
            // A mirrored skeleton turns the surface inside out.
            if matrices.first().map_or(1.0, Matrix4::determinant) < 0.0 {
                faces.iter_mut().for_each(|f| f.swap(1, 2));
            }
        }
        Ok(Some(Self {
            vertices,
            faces,
            uv,
            degenerate,
        }))
    }

    /// Drops the vertices without a face: primitives of one mesh often share a list of vertices.
    pub(super) fn drop_unused(&mut self) {
        let mut number = vec![u32::MAX; self.vertices.len()];
        for v in self.faces.iter().flatten() {
            number[*v as usize] = 0;
        }
        let used = (0..self.vertices.len()).filter(|v| number[*v] == 0);
        let used: Vec<usize> = used.collect();
        for (n, v) in (0..).zip(&used) {
            number[*v] = n;
        }
        for v in self.faces.iter_mut().flatten() {
            *v = number[*v as usize];
        }
        self.vertices = used.iter().map(|v| self.vertices[*v]).collect();
        self.uv = used
            .iter()
            .filter_map(|v| self.uv.get(*v).copied())
            .collect();
    }
}

/// Checks the vertex indices of faces.
fn check_range(faces: &[Face], vertices: usize) -> Result<(), String> {
    let corners = faces.iter().enumerate();
    let mut corners = corners.flat_map(|(f, c)| c.iter().map(move |i| (f, *i)));
    match corners.find(|(_, i)| *i as usize >= vertices) {
        None => Ok(()),
        Some((face, index)) => Err(MeshError::IndexOutOfRange {
            face,
            index,
            vertices,
        }
        .to_string()),
    }
}
