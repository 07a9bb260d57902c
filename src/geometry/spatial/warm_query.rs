//! Closest points on a moving surface, warm-started from the face of the last query: a descent over neighbouring faces
//! costs a few triangles, the tree of all faces is searched where that fails.

use super::{Bvh, SurfacePoint};
use crate::math::{P3, V3};
use crate::mesh::Csr;

/// Largest distance at which a descent counts, metres: an end of it that is not the closest point of all, across a gap
/// between two sheets that face the same way, is wrong by less.
const REACH: f32 = 0.01;
/// Most steps of a descent. A point's last face or that of its neighbour lies one or two away.
const STEPS: usize = 16;

/// Surface that closest points are searched on.
#[derive(Clone, Copy, Debug)]
pub struct WarmQuery<'a> {
    /// Tree of its faces, fitted to the vertices.
    pub tree: &'a Bvh,
    /// Vertices, metres.
    pub vertices: &'a [P3],
    /// Faces around each vertex.
    pub around: &'a Csr,
}

impl WarmQuery<'_> {
    /// Closest point whose unit face normal `agrees`, from the face `near` if there is one; `None` if it does not.
    pub fn closest(
        &self,
        p: &P3,
        near: Option<u32>,
        agrees: impl Fn(&V3) -> bool,
    ) -> Option<(SurfacePoint, V3)> {
        let found = near.and_then(|f| self.descend(p, f, &agrees));
        let found = found.or_else(|| self.tree.closest_near(self.vertices, p, near))?;
        let normal = self.tree.unit_normal(self.vertices, found.face)?;
        agrees(&normal).then_some((found, normal))
    }

    /// Point no neighbouring face is nearer than, by descent from a face that may lie near; `None` if that ends beyond
    /// 1 cm or where the unit face normal does not agree.
    pub fn descend(&self, p: &P3, face: u32, agrees: impl Fn(&V3) -> bool) -> Option<SurfacePoint> {
        let mut best = self.tree.point_of_face(self.vertices, p, face);
        let mut steps = 0;
        while let Some(next) = self.nearer(p, &best) {
            best = next;
            steps += 1;
            if steps == STEPS {
                return None;
            }
        }
        let normal = self.tree.unit_normal(self.vertices, best.face)?;
        (best.distance < REACH && agrees(&normal)).then_some(best)
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
    use crate::fixtures::two_boxes;

    /// Points off two boxes: a descent from any face ends no nearer than the closest point of all, within its reach, and
    /// exactly there from a face that has a corner of the closest one.
    #[test]
    fn descents_end_at_the_closest_point() {
        let (x, faces) = two_boxes(2.0);
        let (tree, around) = (Bvh::new(&faces, &x), Csr::of_faces(x.len(), &faces));
        let query = WarmQuery {
            tree: &tree,
            vertices: &x,
            around: &around,
        };
        let mut exact = 0;
        for (f, corners) in (0..).zip(&faces) {
            let normal = tree.unit_normal(&x, f).expect("no flat face");
            let middle = corners.iter().map(|v| x[*v as usize].coords).sum::<V3>() / 3.0;
            let p = P3::from(middle + normal * 0.004);
            for start in 0..faces.len() as u32 {
                let Some(found) = query.descend(&p, start, |_| true) else {
                    continue;
                };
                assert!(found.distance < REACH && found.distance > 0.003);
                exact += usize::from(found.distance < 0.004 + 1e-5);
            }
            let beside = around.row(corners[0] as usize)[0];
            let (found, own) = query.closest(&p, Some(beside), |_| true).expect("near");
            assert!((found.distance - 0.004).abs() < 1e-5 && own == normal);
            assert!(
                query
                    .closest(&p, Some(beside), |n| n.dot(&normal) < 0.0)
                    .is_none()
            );
        }
        assert!(exact >= faces.len(), "{exact}");
    }
}
