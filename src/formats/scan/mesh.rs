//! Triangle mesh of a coloured scan, as its file stores it.

use crate::{FaceOrigins, TexturePoint};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;

/// Coloured scan in the units and axes of its file.
///
/// Face indices are in range. Positions may be non-finite and faces degenerate: later stages filter both.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScanMesh {
    /// Positions, shape `[points]`.
    pub points: Vec<P3>,
    /// Triangles; polygons are fanned.
    pub faces: Vec<Face>,
    /// Normals as a PLY file stores them, shape `[points]`; empty if absent and for other formats.
    pub normals: Vec<V3>,
    /// Colours, sRGB, shape `[points]`; empty if absent.
    ///
    /// A point without a finite colour has the mean colour of the scan.
    pub colors: Vec<[u8; 3]>,
    /// Colours of the texture between the vertices; empty without a texture, and where vertices have colours of their own.
    pub texture: Vec<TexturePoint>,
    /// Part and line of each face; empty for formats without.
    pub origins: FaceOrigins,
    /// Elements that the reader changed or left out, for people.
    pub notes: Vec<String>,
}
