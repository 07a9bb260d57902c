//! Closest points by descent over neighbouring faces: on a surface that is near, a few triangles instead of a tree.

use super::pairing::{ScanNormal, facing};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Csr, face_normal};
use tryon_geometry::spatial::{Bvh, SurfacePoint};

/// Largest distance at which a descent counts, metres: an end of it that is not the closest point of all, across a gap
/// between two sheets that face the same way, is wrong by less.
const REACH: f32 = 0.01;
/// Most steps of a descent. A point's last face or that of its neighbour lies one or two away.
const STEPS: usize = 16;

/// Surface that closest points are searched on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct QuerySurface<'a> {
    /// Tree of its faces, fitted to the vertices.
    pub(crate) tree: &'a Bvh,
    /// Vertices, metres.
    pub(crate) vertices: &'a [P3],
    /// Faces around each vertex.
    pub(crate) around: &'a Csr,
}

impl QuerySurface<'_> {
    /// Point no neighbouring face is nearer than, by descent from a face that may lie near; `None` if that ends beyond
    /// [`REACH`] or where the normals differ.
    pub(super) fn descend(
        &self,
        (p, normal): (&P3, ScanNormal),
        face: u32,
        least: f32,
    ) -> Option<SurfacePoint> {
        let mut best = self.tree.point_of_face(self.vertices, p, face);
        let mut steps = 0;
        while let Some(next) = self.nearer(p, &best) {
            best = next;
            steps += 1;
            if steps == STEPS {
                return None;
            }
        }
        let face = &self.tree.faces()[best.face as usize];
        let own = face_normal(self.vertices, face).try_normalize(f32::MIN_POSITIVE)?;
        (best.distance < REACH && normal.agrees(&own, least)).then_some(best)
    }

    /// Closest point and the unit normal of its face, faster from a face that may lie near: it and its neighbours are
    /// searched first. `None` if the normals differ.
    pub(super) fn closest_facing(
        &self,
        (p, normal): (&P3, ScanNormal),
        near: Option<u32>,
        least: f32,
    ) -> Option<(SurfacePoint, V3)> {
        let found = near.and_then(|f| self.descend((p, normal), f, least));
        let whole = || self.tree.closest_near(self.vertices, p, near);
        let found = found.or_else(whole)?;
        facing((self.tree, self.vertices), found, normal, least)
    }

    /// Nearer point on a face across the edge or around the corner on which a point of the surface lies.
    fn nearer(&self, p: &P3, at: &SurfacePoint) -> Option<SurfacePoint> {
        let face = &self.tree.faces()[at.face as usize];
        let mut on = (0..3).filter(|k| at.weights[*k] > 0.0).map(|k| face[k]);
        let (first, second, third) = (on.next()?, on.next(), on.next());
        if third.is_some() {
            return None;
        }
        let mut best = *at;
        for &f in self.around.row(first as usize) {
            let corners = &self.tree.faces()[f as usize];
            if f != at.face && second.is_none_or(|v| corners.contains(&v)) {
                let found = self.tree.point_of_face(self.vertices, p, f);
                if found.distance < best.distance {
                    best = found;
                }
            }
        }
        (best.face != at.face).then_some(best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;
    use tryon_geometry::mesh::vertex_normals;
    use tryon_geometry::par::Par;

    /// Points over the surface of a body: a descent from a face two rings away ends at the closest point of all or, between
    /// sheets, no farther than its reach beyond it; most end there exactly.
    #[test]
    fn descents_end_at_the_closest_point() {
        let template = embedded::template();
        let mesh = template.mesh();
        let (x, faces) = (mesh.vertices(), mesh.faces());
        let around = template.topology().vertex_faces();
        let tree = Bvh::new(faces, x);
        let surface = QuerySurface {
            tree: &tree,
            vertices: x,
            around,
        };
        let mut normals = Vec::new();
        vertex_normals(Par::Rayon, x, faces, around, &mut normals);
        let unknown = ScanNormal {
            normal: V3::zeros(),
            oriented: true,
        };
        let (mut ended, mut exact) = (0, 0);
        for v in (0..x.len()).step_by(7) {
            let p = x[v] + normals[v] * 0.004;
            let first = around.row(v)[0];
            let beside = faces[first as usize][0];
            let start = around.row(beside as usize)[0];
            let Some(found) = surface.descend((&p, unknown), start, 0.0) else {
                continue;
            };
            let truth = tree.closest(x, &p).expect("a surface");
            assert!(found.distance < REACH && found.distance >= truth.distance);
            ended += 1;
            exact += usize::from(found.distance < truth.distance + 1e-5);
        }
        assert!(ended * 8 > x.len(), "{ended}");
        assert!(exact * 100 >= ended * 95, "{exact} of {ended}");
    }
}
