//! Triangles of one size on an open surface (Botsch & Kobbelt 2004: split, collapse, flip, relax). Meshes made for
//! drawing have triangles of 2 to 60 mm: what is small costs small steps, what is large cannot fold.

use crate::math::{P3, P3d, V3d};
use crate::mesh::{Face, TriMesh};

/// An edge longer than this times the target is split, shorter than the other collapsed (same paper).
const SPLIT: f64 = 4.0 / 3.0;
const COLLAPSE: f64 = 4.0 / 5.0;
/// A collapse may not turn a face by more than this (cosine): folds and collars stay.
const TURN: f64 = 0.3;
/// Share of the way to the neighbours' centroid per relaxation.
const RELAX: f64 = 0.5;
/// Rounds of all four.
const ROUNDS: usize = 5;

struct Remesher {
    target: f64,
    points: Vec<P3d>,
    rim: Vec<bool>,
    faces: Vec<Option<Face>>,
    around: Vec<Vec<u32>>,
}

/// The same surface with edges of about `target` metres. Rims keep their course; where nothing can be improved without
/// folding the surface over, triangles stay as they are.
pub fn remesh(mesh: &TriMesh, target: f64) -> TriMesh {
    let points: Vec<P3d> = mesh.vertices().iter().map(|p| p.cast()).collect();
    let mut around = vec![Vec::new(); points.len()];
    for (i, f) in mesh.faces().iter().enumerate() {
        f.iter().for_each(|&v| around[v as usize].push(i as u32));
    }
    let rim = vec![false; points.len()];
    let mut r = Remesher {
        target,
        points,
        rim,
        faces: mesh.faces().iter().copied().map(Some).collect(),
        around,
    };
    for (a, b) in r.edges() {
        if r.edge_faces(a, b).len() == 1 {
            r.rim[a as usize] = true;
            r.rim[b as usize] = true;
        }
    }
    for _ in 0..ROUNDS {
        r.split();
        r.collapse();
        r.flip();
        r.relax();
    }
    let mut index = vec![u32::MAX; r.points.len()];
    let mut vertices = Vec::new();
    for (i, f) in r.around.iter().enumerate().filter(|(_, f)| !f.is_empty()) {
        debug_assert!(!f.is_empty());
        index[i] = vertices.len() as u32;
        vertices.push(P3::from(r.points[i].coords.cast::<f32>()));
    }
    let faces = r
        .faces
        .iter()
        .flatten()
        .map(|f| f.map(|v| index[v as usize]))
        .collect();
    TriMesh::new(vertices, faces).unwrap_or_else(|_| mesh.clone())
}

fn normal(p: [P3d; 3]) -> V3d {
    (p[1] - p[0]).cross(&(p[2] - p[0]))
}

/// Sine of the smallest angle.
fn smallest_angle(c: [P3d; 3]) -> f64 {
    let l = [
        (c[1] - c[0]).norm(),
        (c[2] - c[1]).norm(),
        (c[0] - c[2]).norm(),
    ];
    let product = (l[0] * l[1]).max(l[1] * l[2]).max(l[2] * l[0]);
    if product > 0.0 {
        normal(c).norm() / product
    } else {
        0.0
    }
}

impl Remesher {
    fn stretch(&self, a: u32, b: u32) -> f64 {
        (self.points[a as usize] - self.points[b as usize]).norm() / self.target
    }
    fn edges(&self) -> Vec<(u32, u32)> {
        let pairs = |f: &Face| {
            let f = *f;
            (0..3).map(move |k| (f[k].min(f[(k + 1) % 3]), f[k].max(f[(k + 1) % 3])))
        };
        let mut e: Vec<(u32, u32)> = self.faces.iter().flatten().flat_map(pairs).collect();
        e.sort_unstable();
        e.dedup();
        e
    }
    fn edge_faces(&self, a: u32, b: u32) -> Vec<u32> {
        let has = |f: &u32| self.faces[*f as usize].is_some_and(|f| f.contains(&b));
        self.around[a as usize]
            .iter()
            .copied()
            .filter(has)
            .collect()
    }
    fn ring(&self, v: u32) -> Vec<u32> {
        let faces = self.around[v as usize]
            .iter()
            .filter_map(|&f| self.faces[f as usize]);
        let mut r: Vec<u32> = faces.flatten().filter(|w| *w != v).collect();
        r.sort_unstable();
        r.dedup();
        r
    }
    fn corners(&self, f: &Face) -> [P3d; 3] {
        f.map(|i| self.points[i as usize])
    }
    fn put(&mut self, face: u32, f: Option<Face>) {
        if let Some(old) = self.faces[face as usize] {
            old.iter()
                .for_each(|&v| self.around[v as usize].retain(|&g| g != face));
        }
        self.faces[face as usize] = f;
        if let Some(new) = f {
            new.iter().for_each(|&v| self.around[v as usize].push(face));
        }
    }
    /// Edges whose stretch is wanted, sorted by it.
    fn by_length(&self, wanted: impl Fn(f64) -> bool) -> Vec<(u32, u32)> {
        let mut e: Vec<(f64, (u32, u32))> = self
            .edges()
            .into_iter()
            .map(|e| (self.stretch(e.0, e.1), e))
            .filter(|e| wanted(e.0))
            .collect();
        e.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        e.into_iter().map(|e| e.1).collect()
    }

    fn split(&mut self) {
        for (a, b) in self.by_length(|s| s > SPLIT).into_iter().rev() {
            let faces = self.edge_faces(a, b);
            let m = self.points.len() as u32;
            self.points.push(nalgebra::center(
                &self.points[a as usize],
                &self.points[b as usize],
            ));
            self.rim.push(faces.len() == 1);
            self.around.push(Vec::new());
            for f in faces {
                let Some(old) = self.faces[f as usize] else {
                    continue;
                };
                self.put(f, Some(old.map(|v| if v == b { m } else { v })));
                self.faces.push(None);
                self.put(
                    self.faces.len() as u32 - 1,
                    Some(old.map(|v| if v == a { m } else { v })),
                );
            }
        }
    }

    fn collapse(&mut self) {
        for (a, b) in self.by_length(|s| s < COLLAPSE) {
            let shared = self.edge_faces(a, b);
            if shared.is_empty() || self.stretch(a, b) >= COLLAPSE {
                continue;
            }
            // A rim keeps its vertices; between two rims an inner edge must stay.
            match (self.rim[a as usize], self.rim[b as usize]) {
                (true, true) if shared.len() == 2 => {}
                (false, true) => self.try_collapse(b, a, &shared),
                _ => self.try_collapse(a, b, &shared),
            }
        }
    }

    fn try_collapse(&mut self, keep: u32, drop: u32, shared: &[u32]) {
        let (rk, rd) = (self.ring(keep), self.ring(drop));
        if rk.iter().filter(|v| rd.binary_search(v).is_ok()).count() != shared.len() {
            return;
        }
        let both = self.rim[keep as usize] == self.rim[drop as usize];
        let old = self.points[keep as usize];
        let p = if both {
            nalgebra::center(&old, &self.points[drop as usize])
        } else {
            old
        };
        for v in rk.iter().chain(&rd).filter(|v| **v != keep && **v != drop) {
            if (self.points[*v as usize] - p).norm() > SPLIT * self.target {
                return;
            }
            // Every vertex keeps enough neighbours.
            let opposite = shared
                .iter()
                .any(|f| self.faces[*f as usize].is_some_and(|f| f.contains(v)));
            let least = if self.rim[*v as usize] { 1 } else { 3 };
            if opposite && self.around[*v as usize].len() <= least {
                return;
            }
        }
        for &f in self.around[keep as usize]
            .iter()
            .chain(&self.around[drop as usize])
        {
            if shared.contains(&f) {
                continue;
            }
            let Some(face) = self.faces[f as usize] else {
                continue;
            };
            let after = face.map(|v| {
                if v == keep || v == drop {
                    p
                } else {
                    self.points[v as usize]
                }
            });
            let (n0, n1) = (normal(self.corners(&face)), normal(after));
            if n1.norm() == 0.0 || n0.norm() > 0.0 && n0.dot(&n1) < TURN * n0.norm() * n1.norm() {
                return;
            }
        }
        for &f in shared {
            self.put(f, None);
        }
        for f in self.around[drop as usize].clone() {
            let new = self.faces[f as usize].map(|g| g.map(|v| if v == drop { keep } else { v }));
            self.put(f, new);
        }
        self.points[keep as usize] = p;
        self.rim[keep as usize] |= self.rim[drop as usize];
    }

    /// Flips edges where that brings valences nearer to six (four on a rim) without bad angles.
    fn flip(&mut self) {
        for (a, b) in self.edges() {
            let faces = self.edge_faces(a, b);
            let &[f, g] = faces.as_slice() else { continue };
            let (Some(ff), Some(gg)) = (self.faces[f as usize], self.faces[g as usize]) else {
                continue;
            };
            let other = |t: &Face| t.iter().copied().find(|&v| v != a && v != b);
            let (Some(c), Some(d)) = (other(&ff), other(&gg)) else {
                continue;
            };
            if c == d || !self.edge_faces(c, d).is_empty() {
                continue;
            }
            let faces_of = |v: u32| self.around[v as usize].len() as i32;
            let ideal = |v: u32| if self.rim[v as usize] { 3 } else { 6 };
            let cost = |v: u32, change: i32| (faces_of(v) + change - ideal(v)).pow(2);
            let before = cost(a, 0) + cost(b, 0) + cost(c, 0) + cost(d, 0);
            let after = cost(a, -1) + cost(b, -1) + cost(c, 1) + cost(d, 1);
            let (new_f, new_g) = (
                ff.map(|v| if v == b { d } else { v }),
                gg.map(|v| if v == a { c } else { v }),
            );
            let worst = |x: &Face, y: &Face| {
                smallest_angle(self.corners(x)).min(smallest_angle(self.corners(y)))
            };
            let (q0, q1) = (worst(&ff, &gg), worst(&new_f, &new_g));
            let better = after < before && q1 > 0.6 * q0 || q0 < 0.3 && q1 > 1.3 * q0;
            let poor = |v: u32| faces_of(v) <= if self.rim[v as usize] { 1 } else { 3 };
            if !better || poor(a) || poor(b) {
                continue;
            }
            let (n0, n1) = (normal(self.corners(&ff)), normal(self.corners(&gg)));
            // A crease is a fold that was wanted.
            if n0.dot(&n1) < 0.7 * n0.norm() * n1.norm() {
                continue;
            }
            let sum = n0 + n1;
            let fits = |t: &Face| {
                let n = normal(self.corners(t));
                n.dot(&sum) > 0.5 * n.norm() * sum.norm()
            };
            if fits(&new_f) && fits(&new_g) {
                self.put(f, Some(new_f));
                self.put(g, Some(new_g));
            }
        }
    }

    /// Moves inner vertices towards their neighbours' centroid within the surface.
    fn relax(&mut self) {
        let next: Vec<P3d> = (0..self.points.len())
            .map(|i| {
                let p = self.points[i];
                if self.rim[i] || self.around[i].is_empty() {
                    return p;
                }
                let (mut sum, mut area, mut n) = (V3d::zeros(), 0.0, V3d::zeros());
                for f in self.around[i]
                    .iter()
                    .filter_map(|f| self.faces[*f as usize])
                {
                    let c = self.corners(&f);
                    let m = normal(c);
                    n += m;
                    sum += (c[0].coords + c[1].coords + c[2].coords) * (m.norm() / 3.0);
                    area += m.norm();
                }
                // On a crease there is no plane to slide in.
                if area == 0.0 || n.norm() < 0.8 * area {
                    return p;
                }
                let step = (sum / area - p.coords) * RELAX;
                let n = n.normalize();
                p + (step - n * n.dot(&step))
            })
            .collect();
        self.points = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Topology;

    /// An open tube with triangles from 4 to 60 mm.
    fn tube() -> TriMesh {
        let (n, rows) = (40u32, 12u32);
        let angle = |i: u32| {
            let t = std::f32::consts::TAU * i as f32 / n as f32;
            t + 0.6 * t.sin()
        };
        let at = |i: u32, j: u32| j * n + i % n;
        let v = (0..=rows)
            .flat_map(|j| {
                (0..n).map(move |i| {
                    P3::new(
                        0.15 * angle(i).sin(),
                        0.03 * j as f32,
                        0.15 * angle(i).cos(),
                    )
                })
            })
            .collect();
        let f = (0..rows).flat_map(|j| {
            (0..n).flat_map(move |i| {
                [
                    [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                    [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
                ]
            })
        });
        TriMesh::new(v, f.collect()).expect("a tube")
    }

    #[test]
    fn a_tube_keeps_its_shape_and_gets_even_triangles() {
        let (before, target) = (tube(), 0.02);
        let after = remesh(&before, target);
        let t = Topology::new(&after).expect("proper");
        let chi =
            after.vertices().len() as i64 - t.edges().len() as i64 + after.faces().len() as i64;
        assert_eq!((chi, t.components().1), (0, 1), "still a tube");
        assert!(
            (after.area() / before.area() - 1.0).abs() < 0.02,
            "{} {}",
            after.area(),
            before.area()
        );
        for p in after.vertices() {
            assert!(
                (p.x.hypot(p.z) - 0.15).abs() < 4e-3 && (-1e-6..0.36 + 1e-4).contains(&p.y),
                "{p}"
            );
        }
        let mut lengths: Vec<f32> = t
            .edges()
            .iter()
            .map(|e| {
                (after.vertices()[e.v[0] as usize] - after.vertices()[e.v[1] as usize]).norm()
                    / target as f32
            })
            .collect();
        lengths.sort_by(f32::total_cmp);
        let at = |q: usize| lengths[lengths.len() * q / 100];
        assert!(at(2) > 0.5 && at(98) < 1.5, "{} {}", at(2), at(98));
    }
}
