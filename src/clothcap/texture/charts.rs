//! Charts of a surface: connected faces that look along one axis, projected along it without overlap.

use crate::settings::ChartSettings;
use std::collections::BTreeMap;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Csr, Face, edge_faces, face_normal};

/// Number of axes of projection: both directions of z, x and y. Garments at rest face +z and stand along +y.
const AXES: usize = 6;

/// Faces that are projected along one axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chart {
    pub(super) faces: Vec<u32>,
    axis: usize,
}

impl Chart {
    /// Coordinates of a point in the chart's plane as seen from outside, metres: rightwards and downwards.
    pub(super) fn project(&self, p: &P3) -> [f32; 2] {
        project(self.axis, p)
    }
}

/// Unit vector along an axis of projection.
fn outward(axis: usize) -> V3 {
    let mut out = V3::zeros();
    out[[2, 0, 1][axis / 2]] = if axis.is_multiple_of(2) { 1.0 } else { -1.0 };
    out
}

fn project(axis: usize, p: &P3) -> [f32; 2] {
    let out = outward(axis);
    let up = match axis {
        4 => -V3::z(),
        5 => V3::z(),
        _ => V3::y(),
    };
    [up.cross(&out).dot(&p.coords), -up.dot(&p.coords)]
}

/// Cuts a surface into charts; every face is in one. Their order depends on nothing but the arguments.
pub(super) fn charts(vertices: &[P3], faces: &[Face], settings: &ChartSettings) -> Vec<Chart> {
    let around = face_neighbours(faces);
    let normal = |f| face_normal(vertices, f).try_normalize(0.0);
    let normals: Vec<V3> = faces.iter().map(|f| normal(f).unwrap_or(V3::z())).collect();
    let mut axes = smoothed_axes(&normals, &around, settings);
    absorb_small(&mut axes, &normals, &around, settings);
    let mut layers = ChartLayers {
        vertices,
        faces,
        around: &around,
        cell: settings.cell,
        charts: Vec::new(),
    };
    for (axis, own) in components(&axes, &around) {
        layers.add(axis, own);
    }
    layers.charts
}

/// Neighbours of each face across its sides.
fn face_neighbours(faces: &[Face]) -> Csr {
    let mut pairs = Vec::new();
    for beside in edge_faces(faces).chunk_by(|a, b| a.0 == b.0) {
        for (i, (_, a)) in beside.iter().enumerate() {
            for (_, b) in &beside[i + 1..] {
                pairs.extend([(*a, *b), (*b, *a)]);
            }
        }
    }
    Csr::from_pairs(faces.len(), &pairs)
}

fn cosine(axis: usize, normal: &V3) -> f32 {
    outward(axis).dot(normal)
}

/// Axis of each face: near its normal, and that of its neighbours where it can be (iterated conditional modes).
fn smoothed_axes(normals: &[V3], around: &Csr, settings: &ChartSettings) -> Vec<usize> {
    let best = |score: &dyn Fn(usize) -> f32| {
        let axes = (0..AXES).map(|a| (score(a), a));
        let best = axes.reduce(|best, next| if next.0 > best.0 { next } else { best });
        best.map_or(0, |b| b.1)
    };
    let mut axes: Vec<usize> = normals.iter().map(|n| best(&|a| cosine(a, n))).collect();
    for _ in 0..settings.rounds {
        for (f, n) in normals.iter().enumerate() {
            let row = around.row(f);
            axes[f] = best(&|a| {
                let cos = cosine(a, n);
                let alike = row.iter().filter(|g| axes[**g as usize] == a).count();
                // An axis at a right angle would flatten the face.
                let is_steep = cos < settings.steepest;
                cos + if is_steep {
                    -2.0
                } else {
                    settings.neighbour * alike as f32
                }
            });
        }
    }
    axes
}

/// Connected faces of each axis, in the order of their first faces.
fn components(axes: &[usize], around: &Csr) -> Vec<(usize, Vec<u32>)> {
    let all = around.components(|f, g| axes[f] == axes[g]).into_iter();
    let ascending = |mut own: Vec<u32>| {
        own.sort_unstable();
        (axes[own[0] as usize], own)
    };
    all.map(ascending).collect()
}

/// Gives the faces of small charts to their neighbours.
fn absorb_small(axes: &mut [usize], normals: &[V3], around: &Csr, settings: &ChartSettings) {
    for (own_axis, own) in components(axes, around) {
        if own.len() >= settings.least_faces {
            continue;
        }
        for f in own {
            let f = f as usize;
            let cos = |axis: &usize| cosine(*axis, &normals[f]);
            let beside = around.row(f).iter().map(|g| axes[*g as usize]);
            let other = beside.filter(|a| *a != own_axis && cos(a) > settings.steepest);
            let best = other.max_by(|a, b| cos(a).total_cmp(&cos(b)).then(b.cmp(a)));
            axes[f] = best.unwrap_or(own_axis);
        }
    }
}

/// Charts of a surface, without overlap.
struct ChartLayers<'a> {
    vertices: &'a [P3],
    faces: &'a [Face],
    around: &'a Csr,
    /// Side of a cell of the search for overlaps, metres.
    cell: f32,
    charts: Vec<Chart>,
}

impl ChartLayers<'_> {
    /// Adds connected faces as a chart; faces that lie over others of it in its plane become charts of their own.
    fn add(&mut self, axis: usize, own: Vec<u32>) {
        let mut left = own;
        while !left.is_empty() {
            let mut cells: BTreeMap<[i32; 2], Vec<[[f32; 2]; 3]>> = BTreeMap::new();
            let (mut kept, mut over) = (Vec::new(), Vec::new());
            for f in breadth_first(&left, self.around) {
                let t = self.faces[f as usize].map(|v| project(axis, &self.vertices[v as usize]));
                let [low, high] = [f32::min, f32::max].map(|pick: fn(f32, f32) -> f32| {
                    [0, 1]
                        .map(|k| (pick(pick(t[0][k], t[1][k]), t[2][k]) / self.cell).floor() as i32)
                });
                let reached =
                    || (low[0]..=high[0]).flat_map(|x| (low[1]..=high[1]).map(move |y| [x, y]));
                let is_over = reached().any(|c| {
                    let there = cells.get(&c).into_iter().flatten();
                    there.into_iter().any(|other| overlap(&t, other))
                });
                if is_over {
                    over.push(f);
                    continue;
                }
                kept.push(f);
                for c in reached() {
                    cells.entry(c).or_default().push(t);
                }
            }
            kept.sort_unstable();
            over.sort_unstable();
            self.charts.push(Chart { faces: kept, axis });
            left = over;
        }
    }
}

/// Faces of a set, neighbours after each other as far as they are connected within it.
fn breadth_first(set: &[u32], around: &Csr) -> Vec<u32> {
    let mut order: Vec<u32> = Vec::with_capacity(set.len());
    let mut is_taken = vec![false; set.len()];
    for (k, first) in set.iter().enumerate() {
        if is_taken[k] {
            continue;
        }
        is_taken[k] = true;
        let mut next = order.len();
        order.push(*first);
        while let Some(f) = order.get(next).copied() {
            next += 1;
            for g in around.row(f as usize) {
                if let Ok(at) = set.binary_search(g)
                    && !is_taken[at]
                {
                    is_taken[at] = true;
                    order.push(*g);
                }
            }
        }
    }
    order
}

/// True if two triangles of one orientation overlap by more than rounding (separating axes).
fn overlap(a: &[[f32; 2]; 3], b: &[[f32; 2]; 3]) -> bool {
    /// Depth of an overlap that rounding can make, metres.
    const ROUNDING: f32 = 1e-5;
    let separates = |t: &[[f32; 2]; 3], o: &[[f32; 2]; 3]| {
        (0..3).any(|k| {
            let (p, q) = (t[k], t[(k + 1) % 3]);
            let across = [q[1] - p[1], p[0] - q[0]];
            let length = across[0].hypot(across[1]);
            if length < ROUNDING {
                return false;
            }
            let side =
                |r: &[f32; 2]| ((r[0] - p[0]) * across[0] + (r[1] - p[1]) * across[1]) / length;
            let inner = side(&t[(k + 2) % 3]);
            // A triangle without an area covers nothing.
            inner.abs() < ROUNDING || o.iter().all(|r| side(r) * inner.signum() < ROUNDING)
        })
    };
    !separates(a, b) && !separates(b, a)
}
