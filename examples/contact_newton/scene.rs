//! Two sheets of springs above a sphere, their contact candidates by brute force, and additive CCD.

use std::f64::consts::{PI, TAU};
use tryon::cloth::contact::{ActivePair, ContactPair};
use tryon::geometry::math::V3d;
use tryon::geometry::mesh::edges;

/// Vertices along a side of a sheet.
const SIDE: usize = 12;
/// Length of a side (m).
const LENGTH: f64 = 0.4;
/// Mass of cloth (kg/m²).
const DENSITY: f64 = 0.2;
/// Radius of the sphere (m), and its rings and sectors.
const RADIUS: f64 = 0.15;
const RINGS: usize = 16;
const SECTORS: usize = 24;

/// Spring between two vertices.
pub(crate) struct Spring {
    pub(crate) ends: [usize; 2],
    /// Rest length (m).
    pub(crate) rest: f64,
    /// Stiffness (N/m).
    pub(crate) stiffness: f64,
}

/// Cloth and then the obstacle.
#[derive(Default)]
pub(crate) struct Scene {
    pub(crate) rest: Vec<V3d>,
    /// Number of cloth vertices.
    pub(crate) cloth: usize,
    pub(crate) springs: Vec<Spring>,
    pub(crate) vertex_mass: f64,
    faces: Vec<[u32; 3]>,
    edges: Vec<[u32; 2]>,
}

impl Scene {
    pub(crate) fn sheets_over_sphere() -> Self {
        let mut scene = Self::default();
        scene.add_sheet(V3d::new(0.0, RADIUS + 3e-3, 0.0));
        scene.add_sheet(V3d::new(2e-3, RADIUS + 8e-3, 6e-4));
        scene.cloth = scene.rest.len();
        scene.vertex_mass = 2.0 * DENSITY * LENGTH * LENGTH / scene.cloth as f64;
        scene.add_sphere();
        scene.edges = edges(&scene.faces);
        scene
    }
    fn add_sheet(&mut self, centre: V3d) {
        let offset = self.rest.len();
        let along = |i: usize| (i as f64 / (SIDE - 1) as f64 - 0.5) * LENGTH;
        let cells = (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i, j)));
        for (i, j) in cells.clone() {
            self.rest.push(centre + V3d::new(along(i), 0.0, along(j)));
        }
        // Steps in the grid and stiffness: warp, weft, two diagonals, bending.
        let kinds = [
            ([1, 0], 300.0),
            ([0, 1], 300.0),
            ([1, 1], 60.0),
            ([1, -1], 60.0),
            ([2, 0], 0.5),
            ([0, 2], 0.5),
        ];
        let inside = |i: isize| (0..SIDE as isize).contains(&i);
        for (i, j) in cells.clone() {
            for ([di, dj], stiffness) in kinds {
                let (k, l) = (i as isize + di, j as isize + dj);
                if inside(k) && inside(l) {
                    let ends = [
                        offset + i * SIDE + j,
                        offset + k as usize * SIDE + l as usize,
                    ];
                    let rest = (self.rest[ends[0]] - self.rest[ends[1]]).norm();
                    self.springs.push(Spring {
                        ends,
                        rest,
                        stiffness,
                    });
                }
            }
        }
        let at = |i: usize, j: usize| (offset + i * SIDE + j) as u32;
        for (i, j) in cells.filter(|(i, j)| i + 1 < SIDE && j + 1 < SIDE) {
            self.add_quad([at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)]);
        }
    }
    fn add_sphere(&mut self) {
        let offset = self.rest.len();
        for i in 0..=RINGS {
            let (sin, cos) = (PI * (0.02 + 0.96 * i as f64 / RINGS as f64)).sin_cos();
            for j in 0..SECTORS {
                let (z, x) = (TAU * j as f64 / SECTORS as f64).sin_cos();
                self.rest.push(V3d::new(sin * x, cos, sin * z) * RADIUS);
            }
        }
        let at = |i: usize, j: usize| (offset + i * SECTORS + j % SECTORS) as u32;
        for (i, j) in (0..RINGS).flat_map(|i| (0..SECTORS).map(move |j| (i, j))) {
            self.add_quad([at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)]);
        }
    }
    fn add_quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.faces.extend([[a, b, c], [d, c, b]]);
    }
    /// Pairs closer than `radius` (m), without those of neighbours and of two obstacle features.
    pub(crate) fn candidates(&self, x: &[V3d], radius: f64) -> Vec<ActivePair> {
        let obstacle = |v: u32| v as usize >= self.cloth;
        let mut pairs = Vec::new();
        let mut add = |pair: ContactPair| {
            if pair.separation(&pair.corners(x)).squared < radius * radius {
                pairs.push(ActivePair::new(pair, &self.rest));
            }
        };
        let boxes = |vertices: &[u32]| bounds(x, vertices);
        let faces: Vec<Bounds> = self.faces.iter().map(|f| boxes(f)).collect();
        for v in 0..self.rest.len() as u32 {
            let point = boxes(&[v]);
            for (&f, at) in self.faces.iter().zip(&faces) {
                let apart = f.contains(&v) || obstacle(v) && obstacle(f[0]);
                if !apart && point.is_within(at, radius) {
                    add(ContactPair::VertexFace { v, f });
                }
            }
        }
        let edges: Vec<Bounds> = self.edges.iter().map(|e| boxes(e)).collect();
        for (i, &a) in self.edges.iter().enumerate() {
            for (k, &b) in self.edges.iter().enumerate().skip(i + 1) {
                let shared = a.iter().any(|v| b.contains(v));
                let apart = shared || obstacle(a[0]) && obstacle(b[0]);
                if !apart && edges[i].is_within(&edges[k], radius) {
                    add(ContactPair::EdgeEdge { a, b });
                }
            }
        }
        pairs
    }
}

/// Axis-aligned box.
struct Bounds([V3d; 2]);

fn bounds(x: &[V3d], vertices: &[u32]) -> Bounds {
    let first = x[vertices[0] as usize];
    let grow = |b: [V3d; 2], v: &u32| [b[0].inf(&x[*v as usize]), b[1].sup(&x[*v as usize])];
    Bounds(vertices.iter().fold([first, first], grow))
}

impl Bounds {
    fn is_within(&self, other: &Self, radius: f64) -> bool {
        let gap = (self.0[0] - other.0[1]).sup(&(other.0[0] - self.0[1]));
        gap.max() < radius
    }
}

/// Share of `motion` (m) until the pair is at a tenth of its gap beyond `thickness`, at most `limit` (additive CCD, Li et
/// al. 2021).
pub(crate) fn free_share(
    pair: &ContactPair,
    x: &[V3d],
    motion: &[V3d],
    thickness: f64,
    limit: f64,
) -> f64 {
    let (mut corners, mut moves) = (pair.corners(x), pair.corners(motion));
    let mean = moves.iter().sum::<V3d>() / 4.0;
    moves.iter_mut().for_each(|m| *m -= mean);
    let n = moves.map(|m| m.norm());
    let speed = match pair {
        ContactPair::VertexFace { .. } => n[0] + n[1].max(n[2]).max(n[3]),
        _ => n[0].max(n[1]) + n[2].max(n[3]),
    };
    let gap = |corners: &[V3d; 4]| pair.separation(corners).squared.sqrt() - thickness;
    let (mut share, first) = (0.0, gap(&corners));
    loop {
        let now = gap(&corners);
        if share > 0.0 && now <= 0.1 * first {
            return share;
        }
        let advance = 0.9 * now / speed.max(f64::MIN_POSITIVE);
        share += advance;
        if share >= limit {
            return limit;
        }
        for k in 0..4 {
            corners[k] += moves[k] * advance;
        }
    }
}
