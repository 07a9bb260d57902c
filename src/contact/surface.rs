//! Closest point on a moving closed surface, found by walking downhill from where it was last time.
//!
//! A body's topology never changes, so the nearest vertex of the last step is where the search starts. That costs a
//! few neighbours instead of a tree, and a vertex that was outside an arm knows it even when the arm has moved past it.

use crate::math::{P3, V3};
use crate::mesh::{Csr, Face, Topology, vertex_normal, vertex_normals};
use crate::par::{self, Par};
use crate::spatial::PointTree;
use std::collections::{BTreeMap, BTreeSet};

/// Parts of a surface as bits.
pub type Part = u8;

/// What does not move: faces, neighbours, and which parts each vertex belongs to.
#[derive(Clone, Debug)]
pub struct SurfaceModel {
    faces: Vec<Face>,
    topology: Topology,
    parts: Vec<Part>,
    rim: Vec<bool>,
    /// Parts that all corners of the faces around each vertex share.
    shared: Vec<Part>,
}

/// Where the surface is.
#[derive(Clone, Debug, Default)]
pub struct SurfaceFrame {
    /// Vertices, metres, shape `[vertices]`.
    pub vertices: Vec<P3>,
    /// Unit normals, shape `[vertices]`. Left empty, each is computed when it is wanted.
    pub normals: Vec<V3>,
}

/// The nearest point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Nearest vertex: where to start next time.
    pub vertex: u32,
    /// Triangle of the point.
    pub face: u32,
    /// Barycentric weights in that triangle.
    pub weights: [f32; 3],
    /// The point, metres.
    pub point: P3,
    /// Unit normal there, outward.
    pub normal: V3,
    /// Distance along the normal's side: negative inside, metres.
    pub signed: f32,
    /// The search ended at the rim of the parts it was confined to: the distance says nothing.
    pub rim: bool,
}

impl Closest {
    /// Room between this point and one of another part that faces it, metres: negative where the two parts lie in each
    /// other. `None` if they do not face each other.
    pub fn room(&self, other: &Self) -> Option<f32> {
        (self.normal.dot(&other.normal) < 0.0).then(|| self.normal.dot(&(other.point - self.point)))
    }
}

impl SurfaceModel {
    /// Takes connectivity and the parts of each vertex.
    pub fn new(faces: Vec<Face>, topology: Topology, mut parts: Vec<Part>) -> Self {
        parts.resize(topology.vertex_neighbours().rows(), Part::MAX);
        let of = |f: &u32| {
            faces[*f as usize]
                .iter()
                .fold(Part::MAX, |all, c| all & parts[*c as usize])
        };
        let around = |v: usize| {
            topology
                .vertex_faces()
                .row(v)
                .iter()
                .map(of)
                .fold(Part::MAX, |a, b| a & b)
        };
        let shared = (0..parts.len()).map(around).collect();
        Self {
            rim: topology.boundary_vertices(),
            shared,
            faces,
            topology,
            parts,
        }
    }
    /// Number of vertices.
    pub fn vertices(&self) -> usize {
        self.parts.len()
    }
    /// Triangles.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }
    /// Parts of a vertex.
    pub fn part(&self, vertex: u32) -> Part {
        self.parts[vertex as usize]
    }
    /// Fills the normals of a frame from its vertices.
    pub fn update_normals(&self, par: Par, frame: &mut SurfaceFrame) {
        vertex_normals(
            par,
            &frame.vertices,
            &self.faces,
            self.topology.vertex_faces(),
            &mut frame.normals,
        );
    }
    /// Unit normal at a vertex.
    pub(super) fn normal(&self, frame: &SurfaceFrame, vertex: u32) -> V3 {
        let around = || self.topology.vertex_faces().row(vertex as usize);
        let known = frame.normals.get(vertex as usize).copied();
        known.unwrap_or_else(|| vertex_normal(&frame.vertices, &self.faces, around()))
    }
    /// Nearest vertex among those of `mask`, by looking at all: the oracle of the walk, and the first start.
    pub fn nearest_vertex(&self, frame: &SurfaceFrame, p: &P3, mask: Part) -> u32 {
        let mut best = (f32::INFINITY, 0u32);
        for (i, v) in frame.vertices.iter().enumerate() {
            let d = (v - p).norm_squared();
            if d < best.0 && self.parts[i] & mask != 0 {
                best = (d, i as u32);
            }
        }
        best.1
    }
    /// [`Self::nearest_vertex`] of many points at once, each with its own mask.
    pub fn nearest_vertices<'a>(
        &self,
        par: Par,
        frame: &SurfaceFrame,
        points: &'a [P3],
        masks: impl Iterator<Item = &'a Part>,
    ) -> Vec<u32> {
        self.nearest_of_every(1, par, frame, points, masks)
    }
    /// Vertices to start walks from: of each mask the nearest of every seventh.
    pub fn starts<'a>(
        &self,
        par: Par,
        frame: &SurfaceFrame,
        points: &'a [P3],
        masks: impl Iterator<Item = &'a Part>,
    ) -> Vec<u32> {
        const STRIDE: usize = 7;
        self.nearest_of_every(STRIDE, par, frame, points, masks)
    }
    fn nearest_of_every<'a>(
        &self,
        stride: usize,
        par: Par,
        frame: &SurfaceFrame,
        points: &'a [P3],
        masks: impl Iterator<Item = &'a Part>,
    ) -> Vec<u32> {
        let masks: Vec<Part> = masks.copied().collect();
        let trees: BTreeMap<Part, (Vec<u32>, PointTree)> = masks
            .iter()
            .copied()
            .collect::<BTreeSet<_>>()
            .into_iter()
            .map(|mask| {
                let of = (0..self.parts.len() as u32).filter(|v| self.part(*v) & mask != 0);
                let of: Vec<u32> = of.step_by(stride).collect();
                let places: Vec<P3> = of.iter().map(|v| frame.vertices[*v as usize]).collect();
                (mask, (of, PointTree::new(&places)))
            })
            .collect();
        let mut found = Vec::new();
        par::map_into(par, points.len().min(masks.len()), 256, &mut found, |i| {
            let near = trees
                .get(&masks[i])
                .and_then(|(of, tree)| Some(of[tree.nearest(&points[i], f32::MAX)?.0]));
            near.unwrap_or(0)
        });
        found
    }
    /// Walks from `start` to a vertex nearer to `p` than all its neighbours. At most 40 steps.
    pub fn walk(&self, frame: &SurfaceFrame, p: &P3, start: u32, mask: Part) -> u32 {
        let mut at = start;
        let mut best = (frame.vertices[at as usize] - p).norm_squared();
        for _ in 0..MOST_STEPS {
            let mut next = at;
            for &n in self.topology.vertex_neighbours().row(at as usize) {
                let d = (frame.vertices[n as usize] - p).norm_squared();
                if d < best && self.parts[n as usize] & mask != 0 {
                    best = d;
                    next = n;
                }
            }
            if next == at {
                break;
            }
            at = next;
        }
        at
    }
    /// The nearest point on the faces around a vertex.
    pub fn closest_around(&self, frame: &SurfaceFrame, p: &P3, vertex: u32, mask: Part) -> Closest {
        let around = self.topology.vertex_faces().row(vertex as usize);
        let outside = |f: &u32| {
            self.faces[*f as usize]
                .iter()
                .any(|&c| self.parts[c as usize] & mask == 0)
        };
        let rim = self.shared[vertex as usize] & mask == 0 && around.iter().any(outside);
        let mut best: Option<(f32, u32, [f32; 2])> = None;
        for some in around.chunks(LANES) {
            let mut fan = Fan::default();
            for (l, f) in some.iter().enumerate() {
                let [a, b, c] = self.faces[*f as usize].map(|i| frame.vertices[i as usize]);
                for d in 0..3 {
                    (fan.ab[d][l], fan.ac[d][l], fan.ap[d][l]) =
                        (b[d] - a[d], c[d] - a[d], p[d] - a[d]);
                }
            }
            let (weights, square) = fan.nearest();
            for (l, f) in some.iter().enumerate() {
                if best.is_none_or(|o| square[l] < o.0) {
                    best = Some((square[l], *f, [weights[0][l], weights[1][l]]));
                }
            }
        }
        let Some((d, face, [v, w])) = best else {
            let point = frame.vertices[vertex as usize];
            return Closest {
                vertex,
                face: 0,
                weights: [1.0, 0.0, 0.0],
                point,
                normal: V3::y(),
                signed: f32::MAX,
                rim: true,
            };
        };
        let weights = [1.0 - v - w, v, w];
        let [a, b, c] = self.faces[face as usize].map(|i| frame.vertices[i as usize].coords);
        let point = P3::from(a * weights[0] + b * v + c * w);
        let n = self.faces[face as usize];
        let smooth = (0..3).fold(V3::zeros(), |s, k| {
            s + self.normal(frame, n[k]) * weights[k]
        });
        let mut normal = smooth.try_normalize(0.0).unwrap_or_else(V3::y);
        let outside = (p - point).dot(&normal) >= 0.0;
        let distance = d.sqrt();
        // Away from the surface the direction to it is the better normal: it is exact at edges and corners.
        if distance > FAR_ENOUGH {
            let along = (p - point) / distance * if outside { 1.0 } else { -1.0 };
            if along.dot(&normal) > 0.5 {
                normal = along;
            }
        }
        Closest {
            vertex,
            face,
            weights,
            point,
            normal,
            signed: if outside { distance } else { -distance },
            rim,
        }
    }
    /// The nearest point lies on the edge of an open surface: which side it is on means nothing.
    pub fn on_rim(&self, c: &Closest) -> bool {
        let f = self.faces[c.face as usize];
        (0..3).all(|k| c.weights[k] < RIM || self.rim[f[k] as usize])
    }
    /// What keeps `p` under an open surface that others are worn over, from its nearest point `hit`: that point, or, where
    /// it lies on a hem at most `reach` away, a point as far off the hem's surface as `p` is beyond it.
    pub fn under(
        &self,
        frame: &SurfaceFrame,
        p: &P3,
        hit: &Closest,
        reach: f32,
    ) -> Option<Closest> {
        if hit.rim {
            return None;
        }
        if !self.on_rim(hit) {
            return Some(*hit);
        }
        let corners = self.faces[hit.face as usize];
        let normal = (0..3).fold(V3::zeros(), |s, k| {
            s + self.normal(frame, corners[k]) * hit.weights[k]
        });
        let normal = normal.try_normalize(0.0)?;
        let height = normal.dot(&(p - hit.point));
        let beyond = (p - hit.point - normal * height).norm();
        (beyond < reach).then(|| {
            let point = hit.point + normal * beyond;
            Closest {
                point,
                normal,
                signed: normal.dot(&(p - point)),
                ..*hit
            }
        })
    }
    /// Vertices one edge away.
    pub fn neighbours(&self, vertex: u32) -> &[u32] {
        self.topology.vertex_neighbours().row(vertex as usize)
    }
    /// Vertices within two edges of each vertex, itself included.
    pub fn second_neighbours(&self) -> Csr {
        let mut pairs = Vec::new();
        for v in 0..self.vertices() as u32 {
            let mut near = vec![v];
            for &w in self.neighbours(v) {
                near.push(w);
                near.extend_from_slice(self.neighbours(w));
            }
            near.sort_unstable();
            near.dedup();
            pairs.extend(near.into_iter().map(|w| (v, w)));
        }
        Csr::from_pairs(self.vertices(), &pairs)
    }
    /// Walk, and the nearest point if it can be within `reach` metres; else how far beyond reach it is at least.
    pub fn closest_within(
        &self,
        frame: &SurfaceFrame,
        p: &P3,
        start: u32,
        mask: Part,
        reach: f32,
    ) -> (u32, Result<Closest, f32>) {
        let v = self.walk(frame, p, start, mask);
        let room = (frame.vertices[v as usize] - p).norm() - EDGE - reach;
        if room > 0.0 {
            return (v, Err(room));
        }
        (v, Ok(self.closest_around(frame, p, v, mask)))
    }
    /// The nearest point on the parts of `mask`; where that is their rim, the nearest one on whatever lies beyond it.
    /// `vertex` stays within the parts.
    pub fn closest_beyond(&self, frame: &SurfaceFrame, p: &P3, start: u32, mask: Part) -> Closest {
        let own = self.closest(frame, p, start, mask);
        if own.rim {
            Closest {
                vertex: own.vertex,
                ..self.closest(frame, p, own.vertex, Part::MAX)
            }
        } else {
            own
        }
    }
    /// Walk and nearest point in one.
    pub fn closest(&self, frame: &SurfaceFrame, p: &P3, start: u32, mask: Part) -> Closest {
        let v = self.walk(frame, p, start, mask);
        self.closest_around(frame, p, v, mask)
    }
}

/// A walk covers at most this many edges (about 30 cm on a body of 13k vertices); more means the start was lost.
const MOST_STEPS: usize = 40;
/// The nearest point of the faces around the nearest vertex is not nearer than that by more than this, metres.
const EDGE: f32 = 0.03;
/// A corner that weighs less than this has no part in a point.
const RIM: f32 = 1e-4;
/// Beyond this distance the offset direction is a better normal than the interpolated one, metres.
const FAR_ENOUGH: f32 = 2e-3;

/// Triangles that are looked at together.
const LANES: usize = 8;

/// Some triangles a b c and a point p: coordinates of b − a, c − a and p − a.
#[derive(Default)]
struct Fan {
    ab: [[f32; LANES]; 3],
    ac: [[f32; LANES]; 3],
    ap: [[f32; LANES]; 3],
}

impl Fan {
    /// Weights of b and c at the points nearest to p, and squared distances (Ericson, Real-Time Collision Detection,
    /// 5.1.5). All regions are computed and one is chosen, so that all triangles take the same way.
    fn nearest(&self) -> ([[f32; LANES]; 2], [f32; LANES]) {
        let (mut weights, mut square) = ([[0.0; LANES]; 2], [0.0; LANES]);
        for l in 0..LANES {
            let (ab, ac, ap) = (
                self.ab.each_ref().map(|a| a[l]),
                self.ac.each_ref().map(|a| a[l]),
                self.ap.each_ref().map(|a| a[l]),
            );
            let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let (d1, d2, across) = (dot(ab, ap), dot(ac, ap), dot(ab, ac));
            let (d3, d4, d5, d6) = (d1 - dot(ab, ab), d2 - across, d1 - across, d2 - dot(ac, ac));
            let (vc, vb, va) = (d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4);
            let share = |a: f32, of: f32| if of == 0.0 { 0.0 } else { a / of };
            let sum = va + vb + vc;
            let mut at = [share(vb, sum), share(vc, sum)];
            let choose = |yes: bool, a: [f32; 2], b: [f32; 2]| if yes { a } else { b };
            // The later, the stronger.
            let t = share(d4 - d3, (d4 - d3) + (d5 - d6));
            at = choose((va <= 0.0) & (d4 >= d3) & (d5 >= d6), [1.0 - t, t], at);
            at = choose(
                (vb <= 0.0) & (d2 >= 0.0) & (d6 <= 0.0),
                [0.0, share(d2, d2 - d6)],
                at,
            );
            at = choose((d6 >= 0.0) & (d5 <= d6), [0.0, 1.0], at);
            at = choose(
                (vc <= 0.0) & (d1 >= 0.0) & (d3 <= 0.0),
                [share(d1, d1 - d3), 0.0],
                at,
            );
            at = choose((d3 >= 0.0) & (d4 <= d3), [1.0, 0.0], at);
            at = choose((d1 <= 0.0) & (d2 <= 0.0), [0.0, 0.0], at);
            let r: [f32; 3] = std::array::from_fn(|d| ap[d] - ab[d] * at[0] - ac[d] * at[1]);
            (weights[0][l], weights[1][l], square[l]) = (at[0], at[1], dot(r, r));
        }
        (weights, square)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::mesh::TriMesh;
    use crate::spatial::closest_on_triangle;

    /// A sphere from a subdivided octahedron.
    pub(in crate::contact) fn sphere(levels: usize) -> TriMesh {
        let mut v: Vec<P3> = [
            [1., 0., 0.],
            [-1., 0., 0.],
            [0., 1., 0.],
            [0., -1., 0.],
            [0., 0., 1.],
            [0., 0., -1.],
        ]
        .map(P3::from)
        .to_vec();
        let mut f: Vec<Face> = vec![
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ];
        for _ in 0..levels {
            let mut middle = std::collections::BTreeMap::new();
            let mut next = Vec::new();
            for t in &f {
                let m: [u32; 3] = std::array::from_fn(|k| {
                    let (a, b) = (t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3]));
                    *middle.entry((a, b)).or_insert_with(|| {
                        v.push(P3::from(
                            (v[a as usize].coords + v[b as usize].coords).normalize(),
                        ));
                        v.len() as u32 - 1
                    })
                });
                next.extend([
                    [t[0], m[0], m[2]],
                    [m[0], t[1], m[1]],
                    [m[2], m[1], t[2]],
                    [m[0], m[1], m[2]],
                ]);
            }
            f = next;
        }
        TriMesh::new(v, f).expect("sphere")
    }

    /// Two spheres of one radius with their centres on the x axis, each of its parts: no edge leads from one to the other. Also
    /// says how many vertices one of them has.
    pub(in crate::contact) fn two_spheres(
        levels: usize,
        radius: f32,
        centres: [f32; 2],
        parts: [Part; 2],
    ) -> (SurfaceModel, SurfaceFrame, usize) {
        let one = sphere(levels);
        let n = one.vertices().len();
        let at = |x: f32| {
            one.vertices()
                .iter()
                .map(move |p| P3::from(p.coords * radius + V3::x() * x))
        };
        let vertices: Vec<P3> = centres.into_iter().flat_map(at).collect();
        let faces = one
            .faces()
            .iter()
            .copied()
            .chain(one.faces().iter().map(|f| f.map(|v| v + n as u32)))
            .collect();
        let mesh = TriMesh::new(vertices.clone(), faces).expect("two spheres");
        let parts = parts
            .into_iter()
            .flat_map(|p| std::iter::repeat_n(p, n))
            .collect();
        let model = SurfaceModel::new(
            mesh.faces().to_vec(),
            Topology::new(&mesh).expect("topology"),
            parts,
        );
        let mut frame = SurfaceFrame {
            vertices,
            normals: Vec::new(),
        };
        model.update_normals(Par::Seq, &mut frame);
        (model, frame, n)
    }

    #[test]
    fn distances_to_a_sphere_have_their_closed_form_and_the_walk_finds_the_nearest_vertex() {
        let mesh = sphere(4);
        let model = SurfaceModel::new(
            mesh.faces().to_vec(),
            Topology::new(&mesh).expect("topology"),
            vec![1; mesh.vertices().len()],
        );
        let mut frame = SurfaceFrame {
            vertices: mesh.vertices().to_vec(),
            normals: Vec::new(),
        };
        model.update_normals(Par::Seq, &mut frame);
        for i in 0..200 {
            let t = i as f32 * 0.7;
            let dir = V3::new(t.sin(), (t * 1.3).cos(), (t * 0.37).sin()).normalize();
            let r = 0.8 + 0.4 * ((i * 37) % 100) as f32 / 100.0;
            let p = P3::from(dir * r);
            let walked = model.closest(&frame, &p, 0, 1);
            let scan = model.nearest_vertex(&frame, &p, 1);
            assert_eq!(walked.vertex, scan, "point {i}");
            assert!(
                (walked.signed - (r - 1.0)).abs() < 4e-3,
                "{} {}",
                walked.signed,
                r - 1.0
            );
            assert!(walked.normal.dot(&dir) > 0.99 && !walked.rim);
        }
    }

    #[test]
    fn under_a_sheet_and_below_its_hem() {
        // A sheet at z = 0 over x in 0..1, its hem at x = 1; what lies under it has z < 0.
        let v: Vec<P3> = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]
            .map(P3::from)
            .to_vec();
        let f: Vec<Face> = vec![[0, 1, 2], [0, 2, 3]];
        let mesh = TriMesh::new(v.clone(), f.clone()).expect("a sheet");
        let model = SurfaceModel::new(f, Topology::new(&mesh).expect("topology"), vec![1; 4]);
        let mut frame = SurfaceFrame {
            vertices: v,
            normals: Vec::new(),
        };
        model.update_normals(Par::Seq, &mut frame);
        let signed = |x: f32, z: f32| {
            let p = P3::new(x, 0.4, z);
            let near = model.nearest_vertex(&frame, &p, 1);
            let hit = model.closest_around(&frame, &p, near, 1);
            model.under(&frame, &p, &hit, 0.1).map(|c| c.signed)
        };
        let close = |a: Option<f32>, b: f32| a.is_some_and(|a| (a - b).abs() < 1e-5);
        assert!(close(signed(0.7, -0.05), -0.05), "{:?}", signed(0.7, -0.05));
        assert!(close(signed(0.7, 0.02), 0.02), "{:?}", signed(0.7, 0.02));
        // 4 cm below the hem it may stand out 4 cm.
        assert!(close(signed(1.04, 0.04), 0.0), "{:?}", signed(1.04, 0.04));
        assert!(close(signed(1.04, 0.07), 0.03), "{:?}", signed(1.04, 0.07));
        assert_eq!(signed(1.2, 0.0), None, "too far below");
        let rim = Closest {
            rim: true,
            ..model.closest_around(&frame, &P3::origin(), 0, 1)
        };
        assert_eq!(model.under(&frame, &P3::origin(), &rim, 0.1), None);
    }

    #[test]
    fn triangles_together_have_the_nearest_points_that_each_has_alone() {
        let mut seed = 7u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / (1u32 << 24) as f32 - 0.5
        };
        for round in 0..400 {
            let mut fan = Fan::default();
            for axis in 0..3 {
                fan.ab[axis] = std::array::from_fn(|_| random());
                // Every fourth time without area, every fourth time a point.
                let thin = [random(), 0.5, 0.0, random()][round % 4];
                fan.ac[axis] = fan.ab[axis].map(|a| {
                    if round % 4 == 1 || round % 4 == 2 {
                        thin * a
                    } else {
                        random()
                    }
                });
                fan.ap[axis] = std::array::from_fn(|_| 2.0 * random());
            }
            let (weights, square) = fan.nearest();
            for l in 0..LANES {
                let of = |a: &[[f32; LANES]; 3]| P3::new(a[0][l], a[1][l], a[2][l]);
                let (b, c, p) = (of(&fan.ab), of(&fan.ac), of(&fan.ap));
                let w = closest_on_triangle(&p, [P3::origin(), b, c]);
                let alone = (p - (b.coords * w[1] + c.coords * w[2]))
                    .coords
                    .norm_squared();
                let sum = weights[0][l] + weights[1][l];
                assert!(
                    (square[l] - alone).abs() < 1e-4,
                    "{round} {l}: {} {alone}",
                    square[l]
                );
                assert!(
                    weights[0][l] >= -1e-3 && weights[1][l] >= -1e-3 && sum <= 1.001,
                    "{round} {l}"
                );
            }
        }
    }
}
