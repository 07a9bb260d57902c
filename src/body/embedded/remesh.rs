//! Isotropic remeshing on the implicit surface with a target edge length that varies over the body
//! (Botsch & Kobbelt 2004: split, collapse, flip, relax, project). The cut at x = 0 keeps its vertices on the plane.

use super::field::Field;
use crate::math::{P3d, V3d};
use crate::mesh::Face;
use crate::par::{self, Par};

/// An edge longer than this times its target is split, shorter than the other collapsed (same paper).
const SPLIT: f64 = 4.0 / 3.0;
const COLLAPSE: f64 = 4.0 / 5.0;
/// A collapse may not turn a face by more than this (cosine).
const TURN: f64 = 0.3;
/// Share of the way to the neighbours' centroid per relaxation.
const RELAX: f64 = 0.6;

pub(super) struct Remesher<'a> {
    field: &'a Field,
    target: &'a (dyn Fn(&P3d) -> f64 + Sync),
    points: Vec<P3d>,
    sizes: Vec<f64>,
    faces: Vec<Option<Face>>,
    around: Vec<Vec<u32>>,
}

fn normal(p: [P3d; 3]) -> V3d {
    (p[1] - p[0]).cross(&(p[2] - p[0]))
}

impl<'a> Remesher<'a> {
    pub(super) fn new(
        field: &'a Field,
        target: &'a (dyn Fn(&P3d) -> f64 + Sync),
        points: Vec<P3d>,
        faces: Vec<Face>,
    ) -> Self {
        let mut around = vec![Vec::new(); points.len()];
        for (i, f) in faces.iter().enumerate() {
            f.iter().for_each(|&v| around[v as usize].push(i as u32));
        }
        let sizes = points.iter().map(target).collect();
        Self {
            field,
            target,
            points,
            sizes,
            faces: faces.into_iter().map(Some).collect(),
            around,
        }
    }

    /// Runs `rounds` of all operations and returns the compacted mesh.
    pub(super) fn run(mut self, rounds: usize) -> (Vec<P3d>, Vec<Face>) {
        for round in 0..rounds {
            if round > 0 {
                self.split();
            }
            self.collapse();
            self.flip();
            self.relax();
        }
        for _ in 0..2 {
            self.flip();
            self.relax();
        }
        let mut index = vec![u32::MAX; self.points.len()];
        let mut points = Vec::new();
        for (i, f) in self.around.iter().enumerate() {
            if !f.is_empty() {
                index[i] = points.len() as u32;
                points.push(self.points[i]);
            }
        }
        let faces = self
            .faces
            .iter()
            .flatten()
            .map(|f| f.map(|v| index[v as usize]))
            .collect();
        (points, faces)
    }

    fn length(&self, a: u32, b: u32) -> f64 {
        (self.points[a as usize] - self.points[b as usize]).norm()
    }
    /// Length over target.
    fn stretch(&self, a: u32, b: u32) -> f64 {
        self.length(a, b) / (0.5 * (self.sizes[a as usize] + self.sizes[b as usize]))
    }
    /// Edges as (smaller, larger), sorted.
    fn edges(&self) -> Vec<(u32, u32)> {
        let mut e: Vec<(u32, u32)> = self
            .faces
            .iter()
            .flatten()
            .flat_map(|f| (0..3).map(|k| (f[k].min(f[(k + 1) % 3]), f[k].max(f[(k + 1) % 3]))))
            .collect();
        e.sort_unstable();
        e.dedup();
        e
    }
    fn edge_faces(&self, a: u32, b: u32) -> Vec<u32> {
        self.around[a as usize]
            .iter()
            .copied()
            .filter(|&f| self.faces[f as usize].is_some_and(|f| f.contains(&b)))
            .collect()
    }
    fn ring(&self, v: u32) -> Vec<u32> {
        let mut r: Vec<u32> = self.around[v as usize]
            .iter()
            .filter_map(|&f| self.faces[f as usize])
            .flat_map(|f| f.into_iter().filter(|&w| w != v).collect::<Vec<_>>())
            .collect();
        r.sort_unstable();
        r.dedup();
        r
    }
    fn on_cut(&self, v: u32) -> bool {
        self.points[v as usize].x == 0.0
    }
    fn corners(&self, f: &Face) -> [P3d; 3] {
        f.map(|i| self.points[i as usize])
    }
    fn link(&mut self, face: u32) {
        if let Some(f) = self.faces[face as usize] {
            f.iter().for_each(|&v| self.around[v as usize].push(face));
        }
    }
    fn unlink(&mut self, face: u32) {
        if let Some(f) = self.faces[face as usize] {
            f.iter()
                .for_each(|&v| self.around[v as usize].retain(|&g| g != face));
        }
    }

    fn split(&mut self) {
        let mut long: Vec<(f64, (u32, u32))> = self
            .edges()
            .into_iter()
            .map(|e| (self.stretch(e.0, e.1), e))
            .filter(|(s, _)| *s > SPLIT)
            .collect();
        long.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        for (_, (a, b)) in long {
            let faces = self.edge_faces(a, b);
            if faces.is_empty() {
                continue;
            }
            let m = self.points.len() as u32;
            let mut p = nalgebra::center(&self.points[a as usize], &self.points[b as usize]);
            if faces.len() == 1 {
                p.x = 0.0;
            }
            self.points.push(p);
            self.sizes.push((self.target)(&p));
            self.around.push(Vec::new());
            for f in faces {
                let Some(old) = self.faces[f as usize] else {
                    continue;
                };
                self.unlink(f);
                self.faces[f as usize] = Some(old.map(|v| if v == b { m } else { v }));
                self.link(f);
                self.faces
                    .push(Some(old.map(|v| if v == a { m } else { v })));
                self.link((self.faces.len() - 1) as u32);
            }
        }
    }

    fn collapse(&mut self) {
        let mut short: Vec<(f64, (u32, u32))> = self
            .edges()
            .into_iter()
            .map(|e| (self.stretch(e.0, e.1), e))
            .filter(|(s, _)| *s < COLLAPSE)
            .collect();
        short.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (_, (a, b)) in short {
            if self.around[a as usize].is_empty() || self.around[b as usize].is_empty() {
                continue;
            }
            let shared = self.edge_faces(a, b);
            if shared.is_empty() || self.stretch(a, b) >= COLLAPSE {
                continue;
            }
            // Keep the vertex on the cut; an inner edge with both ends on the cut must stay.
            let (keep, drop) = match (self.on_cut(a), self.on_cut(b)) {
                (true, true) if shared.len() == 2 => continue,
                (false, true) => (b, a),
                _ => (a, b),
            };
            self.try_collapse(keep, drop, &shared);
        }
    }

    fn try_collapse(&mut self, keep: u32, drop: u32, shared: &[u32]) {
        let (rk, rd) = (self.ring(keep), self.ring(drop));
        if rk.iter().filter(|v| rd.binary_search(v).is_ok()).count() != shared.len() {
            return;
        }
        let both = self.on_cut(keep) == self.on_cut(drop);
        let old = self.points[keep as usize];
        let p = if both {
            nalgebra::center(&old, &self.points[drop as usize])
        } else {
            old
        };
        let size = (self.target)(&p);
        for v in rk.iter().chain(&rd).filter(|v| **v != keep && **v != drop) {
            if (self.points[*v as usize] - p).norm()
                > SPLIT * 0.5 * (size + self.sizes[*v as usize])
            {
                return;
            }
            // Every vertex keeps at least three neighbours.
            if shared
                .iter()
                .any(|f| self.faces[*f as usize].is_some_and(|f| f.contains(v)))
                && self.around[*v as usize].len() <= 3
            {
                return;
            }
        }
        for end in [keep, drop] {
            for &f in &self.around[end as usize] {
                if shared.contains(&f) {
                    continue;
                }
                let Some(face) = self.faces[f as usize] else {
                    continue;
                };
                let before = self.corners(&face);
                let after = face.map(|v| {
                    if v == keep || v == drop {
                        p
                    } else {
                        self.points[v as usize]
                    }
                });
                let (n0, n1) = (normal(before), normal(after));
                if n0.norm() > 0.0 && n0.dot(&n1) < TURN * n0.norm() * n1.norm() {
                    return;
                }
                if n1.norm() == 0.0 {
                    return;
                }
            }
        }
        for &f in shared {
            self.unlink(f);
            self.faces[f as usize] = None;
        }
        for f in self.around[drop as usize].clone() {
            self.unlink(f);
            self.faces[f as usize] =
                self.faces[f as usize].map(|g| g.map(|v| if v == drop { keep } else { v }));
            self.link(f);
        }
        self.points[keep as usize] = p;
        self.sizes[keep as usize] = size;
    }

    /// Flips edges where that brings valences nearer to six (four on the cut) without bad angles.
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
            if !self.edge_faces(c, d).is_empty() || c == d {
                continue;
            }
            let valence = |v: u32| self.around[v as usize].len() as i32;
            let ideal = |v: u32| if self.on_cut(v) { 3 } else { 6 };
            let cost = |v: u32, change: i32| (valence(v) + change - ideal(v)).pow(2);
            let before = cost(a, 0) + cost(b, 0) + cost(c, 0) + cost(d, 0);
            let after = cost(a, -1) + cost(b, -1) + cost(c, 1) + cost(d, 1);
            let new_f = ff.map(|v| if v == b { d } else { v });
            let new_g = gg.map(|v| if v == a { c } else { v });
            let worst = |x: &Face, y: &Face| {
                smallest_angle(self.corners(x)).min(smallest_angle(self.corners(y)))
            };
            let (q0, q1) = (worst(&ff, &gg), worst(&new_f, &new_g));
            // Cosines: larger is a smaller angle.
            let better = after < before && q1 > 0.6 * q0 || q0 < 0.3 && q1 > 1.3 * q0;
            if !better || valence(a) <= 3 || valence(b) <= 3 {
                continue;
            }
            let sum = normal(self.corners(&ff)) + normal(self.corners(&gg));
            let fits = |t: &Face| {
                let n = normal(self.corners(t));
                n.dot(&sum) > 0.5 * n.norm() * sum.norm()
            };
            if !fits(&new_f) || !fits(&new_g) {
                continue;
            }
            self.unlink(f);
            self.unlink(g);
            self.faces[f as usize] = Some(new_f);
            self.faces[g as usize] = Some(new_g);
            self.link(f);
            self.link(g);
        }
    }

    /// Moves every vertex towards its neighbours' centroid within the surface.
    fn relax(&mut self) {
        let mut next = Vec::new();
        par::map_into(Par::Rayon, self.points.len(), 256, &mut next, |i| {
            let (v, p) = (i as u32, self.points[i]);
            if self.around[i].is_empty() {
                return p;
            }
            let cut = self.on_cut(v);
            let (mut sum, mut weight, mut n) = (V3d::zeros(), 0.0, V3d::zeros());
            for &f in &self.around[i] {
                let Some(face) = self.faces[f as usize] else {
                    continue;
                };
                let c = self.corners(&face);
                let fn_ = normal(c);
                n += fn_;
                if !cut {
                    // Area weighted by density keeps the gradation of sizes.
                    let s: f64 = face.iter().map(|&k| self.sizes[k as usize]).sum::<f64>() / 3.0;
                    let w = fn_.norm() / (s * s * s);
                    sum += (c[0].coords + c[1].coords + c[2].coords) * (w / 3.0);
                    weight += w;
                }
            }
            if cut {
                for w in self
                    .ring(v)
                    .into_iter()
                    .filter(|&w| self.on_cut(w) && self.edge_faces(v, w).len() == 1)
                {
                    let s = 1.0 / self.sizes[w as usize];
                    sum += self.points[w as usize].coords * s;
                    weight += s;
                }
            }
            let mut step = if weight > 0.0 {
                (sum / weight - p.coords) * RELAX
            } else {
                V3d::zeros()
            };
            if let Some(n) = n.try_normalize(0.0) {
                step -= n * n.dot(&step);
            }
            let mut q = p + step;
            if cut {
                q.x = 0.0;
            } else {
                q.x = q.x.max(0.1 * self.sizes[i]);
            }
            self.field.project(&q, 3)
        });
        self.points = next;
        let target = self.target;
        par::map_into(Par::Rayon, self.points.len(), 1024, &mut self.sizes, |i| {
            target(&self.points[i])
        });
    }
}

/// A measure of a triangle's smallest angle without trigonometry: its sine (area over the product of the two long sides).
pub(super) fn smallest_angle(c: [P3d; 3]) -> f64 {
    let l = [
        (c[1] - c[0]).norm(),
        (c[2] - c[1]).norm(),
        (c[0] - c[2]).norm(),
    ];
    let area = normal(c).norm();
    let product = (l[0] * l[1]).max(l[1] * l[2]).max(l[2] * l[0]);
    if product > 0.0 { area / product } else { 0.0 }
}
