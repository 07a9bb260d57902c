//! Search of the skin below points, by nearest vertex.

use crate::Template;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::spatial::PointTree;

/// Skin of a body in any pose.
pub struct SkinSearch<'a> {
    /// Vertices, metres.
    pub vertices: &'a [P3],
    /// Outward unit normals, shape `[vertices]`.
    pub normals: Vec<V3>,
    tree: PointTree,
    offset: f32,
}

impl<'a> SkinSearch<'a> {
    /// Skin of a template with vertices elsewhere, metres, searched `offset` metres along its normals: it moves the other
    /// side of a limb farther away.
    pub fn new(template: &Template, vertices: &'a [P3], offset: f32) -> Self {
        let normals = template.normals(vertices);
        let moved = vertices.iter().zip(&normals).map(|(p, n)| p + n * offset);
        Self {
            tree: PointTree::new(&moved.collect::<Vec<_>>()),
            vertices,
            normals,
            offset,
        }
    }

    /// Vertex nearest to a point with an outward unit `normal`, both moved by the offset, and its squared distance, m²;
    /// `None` beyond `reach` metres.
    pub fn nearest(&self, p: &P3, normal: &V3, reach: f32) -> Option<(usize, f32)> {
        self.tree.nearest(&(p + normal * self.offset), reach)
    }

    /// Height of a point over the plane of a vertex, metres.
    pub fn height(&self, p: &P3, vertex: usize) -> f32 {
        self.normals[vertex].dot(&(p - self.vertices[vertex]))
    }
}
