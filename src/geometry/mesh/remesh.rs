//! Isotropic remeshing towards a target edge length (Botsch & Kobbelt 2004: split, collapse, flip, relax).

use super::editable::{EditableMesh, normal, smallest_angle};
use super::settings::RemeshSettings;
use super::{Face, TriMesh};
use crate::math::{P3, P3d, V3d};
use crate::par::{self, Par};

/// Faces around a vertex that is not on the border, at least, and ideal numbers inside and on the border.
const LEAST_FACES: usize = 3;
const IDEAL_FACES: [i32; 2] = [6, 3];

/// Treatment of border vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Border {
    /// Open edges, whose vertices do not move unless two of them become one.
    Rim,
    /// Vertices with x = 0, which slide in that plane; all others stay on its positive side.
    MirrorPlane,
}

/// Surface and options of a [`Remesher`].
pub struct RemeshSpec<'a> {
    /// Target edge length at a point, metres.
    pub target: &'a (dyn Fn(&P3d) -> f64 + Sync),
    /// Moves a relaxed vertex back to the surface.
    pub project: &'a (dyn Fn(&P3d) -> P3d + Sync),
    /// Treatment of the border.
    pub border: Border,
    /// The target varies: relaxation weighs areas by density, so that the gradation stays.
    pub graded: bool,
    /// No edge is flipped and no vertex relaxed on a crease.
    pub keep_creases: bool,
    /// Share of the way to the neighbours' centroid per relaxation, 0 to 1.
    pub relaxation: f64,
}

/// A mesh while it is remeshed.
pub struct Remesher<'a> {
    spec: RemeshSpec<'a>,
    settings: RemeshSettings,
    mesh: EditableMesh,
    /// Target edge length at each vertex, metres.
    sizes: Vec<f64>,
    border: Vec<bool>,
}

impl<'a> Remesher<'a> {
    /// Starts from a manifold mesh with positions in metres.
    pub fn new(points: Vec<P3d>, faces: Vec<Face>, spec: RemeshSpec<'a>) -> Self {
        let sizes = points.iter().map(spec.target).collect();
        let mesh = EditableMesh::new(points, faces);
        let border = match spec.border {
            Border::Rim => mesh.open_vertices(),
            Border::MirrorPlane => mesh.points.iter().map(|p| p.x == 0.0).collect(),
        };
        Self {
            spec,
            settings: RemeshSettings::default(),
            mesh,
            sizes,
            border,
        }
    }

    /// The mesh with vertices numbered anew, without unused ones.
    pub fn finish(self) -> (Vec<P3d>, Vec<Face>) {
        self.mesh.compact()
    }

    /// Smallest number of faces around a vertex.
    fn least_faces(&self, v: u32) -> usize {
        match self.spec.border {
            Border::Rim if self.border[v as usize] => 1,
            _ => LEAST_FACES,
        }
    }

    /// Edge length over the mean target of its ends.
    fn stretch(&self, a: u32, b: u32) -> f64 {
        let target = 0.5 * (self.sizes[a as usize] + self.sizes[b as usize]);
        self.mesh.length(a, b) / target
    }

    /// Edges whose stretch is `wanted`, shortest first.
    fn by_stretch(&self, wanted: impl Fn(f64) -> bool) -> Vec<[u32; 2]> {
        let mut edges: Vec<(f64, [u32; 2])> = self
            .mesh
            .edges()
            .into_iter()
            .map(|e| (self.stretch(e[0], e[1]), e))
            .filter(|e| wanted(e.0))
            .collect();
        edges.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        edges.into_iter().map(|e| e.1).collect()
    }

    /// Splits long edges in the middle, the longest first.
    pub fn split(&mut self) {
        for [a, b] in self
            .by_stretch(|s| s > self.settings.split)
            .into_iter()
            .rev()
        {
            let open = self.mesh.edge_faces(a, b).len() == 1;
            let [p, q] = [a, b].map(|v| self.mesh.points[v as usize]);
            let mut middle = nalgebra::center(&p, &q);
            let border = match self.spec.border {
                Border::Rim => open,
                Border::MirrorPlane => {
                    if open {
                        middle.x = 0.0;
                    }
                    middle.x == 0.0
                }
            };
            self.sizes.push((self.spec.target)(&middle));
            self.border.push(border);
            self.mesh.split(a, b, middle);
        }
    }

    /// Collapses short edges, the shortest first.
    pub fn collapse(&mut self) {
        for [a, b] in self.by_stretch(|s| s < self.settings.collapse) {
            let shared = self.mesh.edge_faces(a, b);
            if shared.is_empty() || self.stretch(a, b) >= self.settings.collapse {
                continue;
            }
            // The border keeps its vertices; an inner edge between two of them must stay.
            match (self.border[a as usize], self.border[b as usize]) {
                (true, true) if shared.len() == 2 => {}
                (false, true) => self.try_collapse(b, a, &shared),
                _ => self.try_collapse(a, b, &shared),
            }
        }
    }

    fn try_collapse(&mut self, keep: u32, drop: u32, shared: &[u32]) {
        let old = self.mesh.points[keep as usize];
        let p = if self.border[keep as usize] == self.border[drop as usize] {
            nalgebra::center(&old, &self.mesh.points[drop as usize])
        } else {
            old
        };
        let size = (self.spec.target)(&p);
        if !self.keeps_topology(keep, drop, shared)
            || !self.keeps_lengths(keep, drop, shared, &p, size)
            || self.turns_faces(keep, drop, shared, &p)
        {
            return;
        }
        self.mesh.collapse(keep, drop, shared, p);
        self.sizes[keep as usize] = size;
        self.border[keep as usize] |= self.border[drop as usize];
    }

    /// The link condition: both ends have only the edge's own opposite vertices in common.
    fn keeps_topology(&self, keep: u32, drop: u32, shared: &[u32]) -> bool {
        let (rk, rd) = (self.mesh.ring(keep), self.mesh.ring(drop));
        rk.iter().filter(|v| rd.binary_search(v).is_ok()).count() == shared.len()
    }

    /// No edge becomes too long when both ends go to `p`, and every vertex keeps enough faces; `size` is the target there.
    fn keeps_lengths(&self, keep: u32, drop: u32, shared: &[u32], p: &P3d, size: f64) -> bool {
        let (rk, rd) = (self.mesh.ring(keep), self.mesh.ring(drop));
        let mut around = rk.iter().chain(&rd).filter(|v| **v != keep && **v != drop);
        around.all(|&v| {
            let length = (self.mesh.points[v as usize] - p).norm();
            let opposite = shared.iter().any(|f| self.mesh.has_corner(*f, v));
            length <= self.settings.split * 0.5 * (size + self.sizes[v as usize])
                && !(opposite && self.mesh.around[v as usize].len() <= self.least_faces(v))
        })
    }

    /// Some face turns too far or loses its area when both ends go to `p`.
    fn turns_faces(&self, keep: u32, drop: u32, shared: &[u32], p: &P3d) -> bool {
        let around = &self.mesh.around;
        let mut faces = around[keep as usize].iter().chain(&around[drop as usize]);
        faces.any(|f| {
            let Some(face) = self.mesh.faces[*f as usize].filter(|_| !shared.contains(f)) else {
                return false;
            };
            let before = self.mesh.corners(&face);
            let mut after = before;
            (0..3)
                .filter(|k| face[*k] == keep || face[*k] == drop)
                .for_each(|k| after[k] = *p);
            let (n0, n1) = (normal(before), normal(after));
            n1.norm() == 0.0
                || n0.norm() > 0.0
                    && n0.dot(&n1) < self.settings.collapse_turn * n0.norm() * n1.norm()
        })
    }

    /// Flips edges where that brings valences nearer to the ideal, or mends a poor angle.
    pub fn flip(&mut self) {
        for [a, b] in self.mesh.edges() {
            if let Some(flipped) = self.mesh.flipped(a, b).filter(|f| self.improves(a, b, f)) {
                for (face, new) in flipped.faces.into_iter().zip(flipped.after) {
                    self.mesh.put(face, Some(new));
                }
            }
        }
    }

    fn improves(&self, a: u32, b: u32, flip: &super::editable::Flip) -> bool {
        let [c, d] = flip.opposite;
        let valence = |v: u32| self.mesh.around[v as usize].len() as i32;
        let ideal = |v: u32| IDEAL_FACES[usize::from(self.border[v as usize])];
        let cost = |v: u32, change: i32| (valence(v) + change - ideal(v)).pow(2);
        let before = cost(a, 0) + cost(b, 0) + cost(c, 0) + cost(d, 0);
        let after = cost(a, -1) + cost(b, -1) + cost(c, 1) + cost(d, 1);
        let worst = |f: &[Face; 2]| {
            let [p, q] = f.map(|f| smallest_angle(self.mesh.corners(&f)));
            p.min(q)
        };
        let (q0, q1) = (worst(&flip.before), worst(&flip.after));
        let s = &self.settings;
        let better =
            after < before && q1 > s.flip_keeps * q0 || q0 < s.flip_poor && q1 > s.flip_gain * q0;
        let is_least = |v: u32| valence(v) <= self.least_faces(v) as i32;
        if !better || is_least(a) || is_least(b) {
            return false;
        }
        let [n0, n1] = flip.before.map(|f| normal(self.mesh.corners(&f)));
        if self.spec.keep_creases && n0.dot(&n1) < self.settings.flip_crease * n0.norm() * n1.norm()
        {
            return false;
        }
        let sum = n0 + n1;
        flip.after.iter().all(|f| {
            let n = normal(self.mesh.corners(f));
            n.dot(&sum) > self.settings.flip_turn * n.norm() * sum.norm()
        })
    }

    /// Moves vertices towards their neighbours' centroid within the surface.
    pub fn relax(&mut self) {
        let mut next = Vec::new();
        par::map_into(Par::Rayon, self.sizes.len(), 256, &mut next, |i| {
            self.relaxed(i)
        });
        self.mesh.points = next;
        let (points, target) = (&self.mesh.points, self.spec.target);
        par::map_into(Par::Rayon, points.len(), 1024, &mut self.sizes, |i| {
            target(&points[i])
        });
    }

    fn relaxed(&self, i: usize) -> P3d {
        let (p, border) = (self.mesh.points[i], self.border[i]);
        let fixed = border && self.spec.border == Border::Rim;
        if fixed || self.mesh.around[i].is_empty() {
            return p;
        }
        let (mut area, mut n) = (0.0, V3d::zeros());
        let (mut sum, mut weight) = if border {
            self.along_border(i as u32)
        } else {
            (V3d::zeros(), 0.0)
        };
        for f in self.mesh.faces_around(i) {
            let c = self.mesh.corners(&f);
            let m = normal(c);
            n += m;
            area += m.norm();
            if !border {
                let w = m.norm() / self.density(&f);
                sum += (c[0].coords + c[1].coords + c[2].coords) * (w / 3.0);
                weight += w;
            }
        }
        if self.spec.keep_creases && (area == 0.0 || n.norm() < self.settings.relax_crease * area) {
            return p;
        }
        let mut step = V3d::zeros();
        if weight > 0.0 {
            step = (sum / weight - p.coords) * self.spec.relaxation;
        }
        if let Some(n) = n.try_normalize(0.0) {
            step -= n * n.dot(&step);
        }
        let mut q = p + step;
        if self.spec.border == Border::MirrorPlane {
            q.x = if border {
                0.0
            } else {
                q.x.max(self.settings.off_plane * self.sizes[i])
            };
        }
        (self.spec.project)(&q)
    }

    /// Area weighted by density keeps the gradation of sizes.
    fn density(&self, f: &Face) -> f64 {
        if !self.spec.graded {
            return 1.0;
        }
        let s = f.iter().map(|&k| self.sizes[k as usize]).sum::<f64>() / 3.0;
        s * s * s
    }

    /// Weighted sum of the neighbours along the border, and its weight.
    fn along_border(&self, v: u32) -> (V3d, f64) {
        let ring = self.mesh.ring(v).into_iter();
        ring.filter(|&w| self.border[w as usize] && self.mesh.edge_faces(v, w).len() == 1)
            .fold((V3d::zeros(), 0.0), |(sum, weight), w| {
                let s = 1.0 / self.sizes[w as usize];
                (sum + self.mesh.points[w as usize].coords * s, weight + s)
            })
    }
}

/// Rounds of split, collapse, flip and relax in [`remesh`]; more change little (same paper: 5 to 10).
const ROUNDS: usize = 5;

/// The same open or closed surface with edges of about `target` metres.
///
/// Rims keep their course. Triangles stay as they are where no change is possible without folding the surface over.
pub fn remesh(mesh: &TriMesh, target: f64) -> TriMesh {
    let spec = RemeshSpec {
        target: &|_| target,
        project: &|p| *p,
        border: Border::Rim,
        graded: false,
        keep_creases: true,
        relaxation: 0.5,
    };
    let points = mesh.vertices().iter().map(|p| p.cast()).collect();
    let mut remesher = Remesher::new(points, mesh.faces().to_vec(), spec);
    for _ in 0..ROUNDS {
        remesher.split();
        remesher.collapse();
        remesher.flip();
        remesher.relax();
    }
    let (points, faces) = remesher.finish();
    let vertices = points.iter().map(|p| P3::from(p.coords.cast::<f32>()));
    TriMesh::new(vertices.collect(), faces).unwrap_or_else(|_| mesh.clone())
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
