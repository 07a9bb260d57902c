//! Image on a mesh garment: the surface that it is painted on, and the drawn mesh that shows it.

use super::read::MeshGarment;
use std::collections::BTreeMap;
use std::sync::Arc;
use tryon_garment::{FabricImage, RenderMesh};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;

impl MeshGarment {
    /// Surface of all pieces on the body that it was made on, metres.
    pub fn surface(&self) -> (Vec<P3>, Vec<Face>) {
        let (mut x, mut faces) = (Vec::new(), Vec::new());
        for piece in &self.pieces {
            let first = x.len() as u32;
            x.extend(&piece.positions);
            faces.extend(piece.garment.faces.iter().map(|f| f.map(|v| v + first)));
        }
        (x, faces)
    }

    /// The same with an image; `drawn` is [`MeshGarment::surface`] with texture coordinates, metres from the image's upper
    /// left corner, and has its faces in the same order.
    #[must_use]
    pub fn with_image(mut self, image: FabricImage, drawn: &RenderMesh) -> Self {
        let (mut vertex, mut face) = (0, 0);
        for piece in &mut self.pieces {
            let garment = &mut piece.garment;
            let faces = &drawn.faces[face..face + garment.faces.len()];
            garment.render = piece_of(drawn, faces, vertex);
            vertex += garment.vertices as u32;
            face += garment.faces.len();
        }
        self.image = Some(Arc::new(image));
        self
    }
}

/// Drawn mesh of some faces, over vertices from `first` on.
fn piece_of(drawn: &RenderMesh, faces: &[Face], first: u32) -> RenderMesh {
    let mut own: BTreeMap<u32, u32> = BTreeMap::new();
    let mut out = RenderMesh::default();
    for f in faces {
        let corners = f.map(|v| {
            *own.entry(v).or_insert_with(|| {
                out.vertex.push(drawn.vertex[v as usize] - first);
                out.uv.push(drawn.uv[v as usize]);
                out.vertex.len() as u32 - 1
            })
        });
        out.faces.push(corners);
    }
    out
}
