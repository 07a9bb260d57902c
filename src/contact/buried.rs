//! Skin that lies inside another part of the body: an armpit that closes, thighs that press on each other.
//!
//! Nothing can lie on such skin, and planes from it contradict those of the part it lies in. Measured on a heavy body
//! with its arms down: a sleeve held by such planes tears itself off the shoulder within a second.

use super::across::Across;
use super::winding::Winding;
use super::{Part, SurfaceFrame, SurfaceModel};
use crate::par::{self, Par};
use serde::{Deserialize, Serialize};

/// Which skin is buried.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Buried {
    sides: Across<Side>,
    inside: Vec<bool>,
}

/// Where a vertex lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
enum Side {
    #[default]
    Outside,
    Inside,
    /// It looks as if inside, which is to be proved.
    Suspect,
    /// The nearest point is where the two parts join.
    Unknown,
}

/// Rings by which buried skin grows at most into skin of which the nearest other part is the joint line between them,
/// as long as that is inside too: 4 cm of the embedded body, where a heavy one with its arms down needs 3 rings.
const RINGS: usize = 8;
/// Skin is inside where the body goes around a point this far off it, metres: less than a fabric's thickness, more than
/// rounding.
const OFF: f32 = 1e-3;

impl Buried {
    /// Looks again at what may have changed since the last call. `opposite`: the part that each vertex may lie in, 0 for
    /// none.
    pub fn update(
        &mut self,
        par: Par,
        model: &SurfaceModel,
        opposite: &[Part],
        frame: &SurfaceFrame,
    ) {
        self.inside.resize(frame.vertices.len(), false);
        self.sides
            .look(par, model, opposite, frame, 0.0, |v, near, hit| {
                let side = |inside: bool| if inside { Side::Suspect } else { Side::Outside };
                match hit {
                    // Far from the other part's skin: outside or deep inside, unless that is where it ends.
                    Err(_) => {
                        let rim = model
                            .neighbours(near)
                            .iter()
                            .any(|w| model.part(*w) & opposite[v] == 0);
                        let n = near as usize;
                        let depth = (frame.vertices[v] - frame.vertices[n]).dot(&frame.normals[n]);
                        if rim {
                            Side::Unknown
                        } else {
                            side(depth < 0.0)
                        }
                    }
                    Ok(c) if c.rim => Side::Unknown,
                    Ok(c) => side(c.signed < 0.0),
                }
            });
        self.prove(par, model, frame);
    }
    /// Finds out which suspects are inside, and how far around them the skin is. Nearest points alone do not tell: behind
    /// a shoulder blade the arm's nearest skin, where the arm ends, faces away, and 107 vertices of a dancer's back held
    /// no cloth for a tenth of a second (17 mm under the skin).
    fn prove(&mut self, par: Par, model: &SurfaceModel, frame: &SurfaceFrame) {
        self.inside
            .iter_mut()
            .zip(&self.sides.seen)
            .for_each(|(i, s)| *i = s.found == Side::Inside);
        let suspects = self.sides.seen.iter().any(|s| s.found == Side::Suspect);
        if !suspects && !self.inside.contains(&true) {
            return;
        }
        let body = Winding::new(&frame.vertices, model.faces());
        let inside = |v: usize| body.holds(&(frame.vertices[v] + frame.normals[v] * OFF));
        par::for_chunks(par, &mut self.sides.seen, 256, |start, chunk| {
            for (k, s) in chunk
                .iter_mut()
                .enumerate()
                .filter(|(_, s)| s.found == Side::Suspect)
            {
                s.found = if inside(start + k) {
                    Side::Inside
                } else {
                    Side::Outside
                };
            }
        });
        let mut last: Vec<u32> = (0..self.sides.seen.len() as u32)
            .filter(|v| self.sides.seen[*v as usize].found == Side::Inside)
            .collect();
        last.iter().for_each(|v| self.inside[*v as usize] = true);
        let mut asked = self.inside.clone();
        for _ in 0..RINGS {
            let mut next = Vec::new();
            for &w in last.iter().flat_map(|v| model.neighbours(*v)) {
                let v = w as usize;
                if self.sides.seen[v].found == Side::Unknown
                    && !std::mem::replace(&mut asked[v], true)
                    && inside(v)
                {
                    self.inside[v] = true;
                    next.push(w);
                }
            }
            last = next;
        }
    }
    /// A triangle of the skin holds nothing: most of its corners are buried.
    pub fn holds_nothing(&self, corners: [u32; 3]) -> bool {
        corners
            .iter()
            .filter(|v| self.inside.get(**v as usize).copied().unwrap_or(false))
            .count()
            > 1
    }
    /// Buried vertices.
    pub fn count(&self) -> usize {
        self.inside.iter().filter(|b| **b).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::surface::tests::sphere;
    use crate::math::P3;
    use crate::math::V3;
    use crate::mesh::{Topology, TriMesh};

    #[test]
    fn of_two_halves_of_one_sphere_neither_is_in_the_other() {
        // Both parts end where they join: there "inside" means nothing, near it and far from it.
        let mesh = sphere(4);
        let parts: Vec<Part> = mesh
            .vertices()
            .iter()
            .map(|p| if p.x < 0.0 { 1 } else { 2 })
            .collect();
        let opposite: Vec<Part> = parts.iter().map(|p| 3 - p).collect();
        let model = SurfaceModel::new(
            mesh.faces().to_vec(),
            Topology::new(&mesh).expect("topology"),
            parts,
        );
        let mut frame = SurfaceFrame {
            vertices: mesh.vertices().to_vec(),
            normals: Vec::new(),
        };
        model.update_normals(Par::Seq, &mut frame);
        let mut buried = Buried::default();
        buried.update(Par::Seq, &model, &opposite, &frame);
        assert_eq!(buried.count(), 0);
    }

    #[test]
    fn of_two_spheres_in_each_other_exactly_what_is_inside_is_buried() {
        let one = sphere(3);
        let n = one.vertices().len();
        let mut faces = one.faces().to_vec();
        faces.extend(one.faces().iter().map(|f| f.map(|v| v + n as u32)));
        let at = |d: f32| -> Vec<P3> {
            one.vertices()
                .iter()
                .copied()
                .chain(one.vertices().iter().map(|p| p + V3::new(d, 0.0, 0.0)))
                .collect()
        };
        let mesh = TriMesh::new(at(3.0), faces.clone()).expect("two spheres");
        let parts: Vec<Part> = (0..2 * n).map(|i| if i < n { 1 } else { 2 }).collect();
        let opposite: Vec<Part> = parts.iter().map(|p| 3 - p).collect();
        let model = SurfaceModel::new(faces, Topology::new(&mesh).expect("topology"), parts);
        let mut buried = Buried::default();
        // Apart, into each other, out again: the same state all along.
        for d in [3.0, 2.2, 1.7, 1.3, 1.9, 2.2, 3.0] {
            let mut frame = SurfaceFrame {
                vertices: at(d),
                normals: Vec::new(),
            };
            model.update_normals(Par::Seq, &mut frame);
            buried.update(Par::Seq, &model, &opposite, &frame);
            let mut unsure = 0;
            for (i, p) in frame.vertices.iter().enumerate() {
                let other = P3::new(if i < n { d } else { 0.0 }, 0.0, 0.0);
                let depth = 1.0 - (p - other).norm();
                // A facet lies up to 8 mm inside its sphere.
                if depth.abs() < 0.02 {
                    unsure += 1;
                } else {
                    assert_eq!(
                        buried.inside[i],
                        depth > 0.0,
                        "distance {d}, vertex {i}, {depth} m deep"
                    );
                }
            }
            assert!(unsure < n / 5);
            assert_eq!(buried.count() == 0, d > 2.0, "distance {d}");
        }
        assert!(
            !buried.holds_nothing([0, 1, u32::MAX]),
            "far apart, and a corner that does not exist"
        );
    }
}
