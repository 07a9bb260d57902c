//! Places of a garment's surface in its pattern: how far from a free edge, and how far from a seam.

use std::collections::BTreeMap;
use tryon_geometry::mesh::{Face, UnionFind, boundary_edges, undirected};

/// Distance beyond which nothing of an edge is seen, metres: the reach of its profile, and half a far pixel.
const REACH: f32 = 0.08;

/// Place of a drawn vertex in its panel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgePlace {
    /// Distance from the nearest free edge, metres; infinite beyond 8 cm.
    pub free: f32,
    /// Length along that edge, metres.
    pub along: f32,
    /// Distance from the nearest seam, metres; infinite beyond 8 cm.
    pub seam: f32,
    /// That free edge is at the top of its panel, a neckline or a waist, and no hem or cuff.
    pub is_upper: bool,
}

impl EdgePlace {
    /// Far from every edge.
    pub const INNER: Self = Self {
        free: f32::INFINITY,
        along: 0.0,
        seam: f32::INFINITY,
        is_upper: false,
    };
}

/// A piece of an outline in texture space, metres.
#[derive(Clone, Copy)]
struct OutlinePiece {
    ends: [[f32; 2]; 2],
    /// Length along the edge up to its start.
    along: f32,
    is_upper: bool,
}

/// Pieces of one panel's outline.
#[derive(Default)]
struct PanelBorders {
    free: Vec<OutlinePiece>,
    seams: Vec<OutlinePiece>,
}

/// Places of drawn vertices, shape `[vertices]`. `uv` are metres on the flat panels, `vertex` the simulated vertex under each
/// drawn one: panels keep their own vertices along seams, and an edge is free where no other panel is sewn to it.
pub fn edge_places(faces: &[Face], uv: &[[f32; 2]], vertex: &[u32]) -> Vec<EdgePlace> {
    let mut panels = UnionFind::new(uv.len());
    for [a, b, c] in faces {
        panels.join(*a, *b);
        panels.join(*b, *c);
    }
    let (panel, count) = panels.number();
    let outlines = outlines(faces, uv, vertex, &panel, count);
    let place = |(at, panel): (&[f32; 2], &u32)| {
        let outline = &outlines[*panel as usize];
        let mut place = EdgePlace::INNER;
        if let Some((distance, along, piece)) = nearest(&outline.free, at) {
            place.free = distance;
            place.along = along;
            place.is_upper = piece.is_upper;
        }
        if let Some((distance, ..)) = nearest(&outline.seams, at) {
            place.seam = distance;
        }
        place
    };
    uv.iter().zip(&panel).map(place).collect()
}

/// Outlines of all panels.
fn outlines(
    faces: &[Face],
    uv: &[[f32; 2]],
    vertex: &[u32],
    panel: &[u32],
    count: usize,
) -> Vec<PanelBorders> {
    let sewn = |[a, b]: [u32; 2]| undirected([a, b].map(|v| vertex[v as usize]));
    let borders = boundary_edges(faces);
    let mut uses: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for edge in &borders {
        *uses.entry(sewn(*edge)).or_default() += 1;
    }
    let mut heights = vec![[f32::INFINITY, f32::NEG_INFINITY]; count];
    for (at, p) in uv.iter().zip(panel) {
        let [low, high] = &mut heights[*p as usize];
        (*low, *high) = (low.min(at[1]), high.max(at[1]));
    }
    let mut out: Vec<PanelBorders> = (0..count).map(|_| PanelBorders::default()).collect();
    let mut next: BTreeMap<u32, u32> = BTreeMap::new();
    for edge in &borders {
        let p = panel[edge[0] as usize] as usize;
        if uses[&sewn(*edge)] > 1 {
            let ends = edge.map(|v| uv[v as usize]);
            out[p].seams.push(OutlinePiece {
                ends,
                along: 0.0,
                is_upper: false,
            });
        } else {
            next.insert(edge[0], edge[1]);
        }
    }
    for chain in chains(next) {
        let p = panel[chain[0] as usize] as usize;
        let points: Vec<[f32; 2]> = chain.iter().map(|v| uv[*v as usize]).collect();
        let middle = points.iter().map(|p| p[1]).sum::<f32>() / points.len() as f32;
        let [low, high] = heights[p];
        let is_upper = middle > 0.5 * (low + high);
        let mut along = 0.0;
        for ends in points.windows(2).map(|w| [w[0], w[1]]) {
            out[p].free.push(OutlinePiece {
                ends,
                along,
                is_upper,
            });
            along += distance(&ends[0], &ends[1]);
        }
    }
    out
}

/// Vertices of each unbroken run of edges, from start to end; a ring ends where it starts.
fn chains(mut next: BTreeMap<u32, u32>) -> Vec<Vec<u32>> {
    let ends: std::collections::BTreeSet<u32> = next.values().copied().collect();
    let starts: Vec<u32> = next.keys().copied().filter(|v| !ends.contains(v)).collect();
    let mut out = Vec::new();
    let mut run = |next: &mut BTreeMap<u32, u32>, first: u32| {
        let mut chain = vec![first];
        let mut at = first;
        while let Some(b) = next.remove(&at) {
            chain.push(b);
            at = b;
        }
        out.push(chain);
    };
    for first in starts {
        run(&mut next, first);
    }
    while let Some((&first, _)) = next.first_key_value() {
        run(&mut next, first);
    }
    out
}

fn distance(a: &[f32; 2], b: &[f32; 2]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Distance from the nearest piece within reach, length along the edge to the foot, and the piece.
fn nearest<'a>(pieces: &'a [OutlinePiece], at: &[f32; 2]) -> Option<(f32, f32, &'a OutlinePiece)> {
    let foot = |piece: &'a OutlinePiece| {
        let [a, b] = piece.ends;
        let along = [b[0] - a[0], b[1] - a[1]];
        let to = [at[0] - a[0], at[1] - a[1]];
        let squared = (along[0] * along[0] + along[1] * along[1]).max(f32::MIN_POSITIVE);
        let t = ((to[0] * along[0] + to[1] * along[1]) / squared).clamp(0.0, 1.0);
        let foot = [a[0] + t * along[0], a[1] + t * along[1]];
        (distance(at, &foot), piece.along + t * squared.sqrt(), piece)
    };
    let least = pieces.iter().map(foot).min_by(|a, b| a.0.total_cmp(&b.0));
    least.filter(|l| l.0 <= REACH)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_garment::{GarmentMesh, Size, Triangulation, library};

    fn of(name: &str) -> (GarmentMesh, Vec<EdgePlace>) {
        let pattern = library::pattern(name, Size::M).expect("a pattern");
        let mesh = GarmentMesh::sew(&pattern, &Triangulation::default()).expect("sewn");
        let places = edge_places(&mesh.render.faces, &mesh.render.uv, &mesh.render.vertex);
        (mesh, places)
    }

    #[test]
    fn a_strip_knows_its_hem_and_its_seam() {
        // Two squares of 2 cm, side by side, sewn along x = 2 cm: their vertices there are two on one.
        let uv = [
            [0.0, 0.0],
            [0.02, 0.0],
            [0.02, 0.02],
            [0.0, 0.02],
            [0.04, 0.0],
            [0.06, 0.0],
            [0.06, 0.02],
            [0.04, 0.02],
        ];
        let faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let places = edge_places(&faces, &uv, &[0, 1, 2, 3, 1, 4, 5, 2]);
        assert_eq!(places[1].seam, 0.0);
        assert_eq!((places[0].seam, places[5].seam), (0.02, 0.02));
        assert!(
            places.iter().all(|p| p.free == 0.0),
            "every corner is on a free edge"
        );
        assert!(edge_places(&[], &[], &[]).is_empty());
    }

    #[test]
    fn a_t_shirt_has_hems_below_and_a_neckline_above() {
        let (mesh, places) = of("tshirt");
        let edge = |p: &&EdgePlace| p.free == 0.0;
        let [upper, lower] = [true, false].map(|is_upper| {
            let own = places.iter().filter(edge);
            own.filter(|p| p.is_upper == is_upper).count()
        });
        assert!(upper > 10 && lower > 40, "{upper} {lower}");
        // Distances in the plane of a panel are those of its triangles: nowhere steeper than one.
        for f in &mesh.render.faces {
            for [a, b] in [[f[0], f[1]], [f[1], f[2]]].map(|e| e.map(|v| v as usize)) {
                let length = distance(&mesh.render.uv[a], &mesh.render.uv[b]);
                for of in [|p: &EdgePlace| p.free, |p: &EdgePlace| p.seam] {
                    let (x, y) = (of(&places[a]), of(&places[b]));
                    assert!(!(x.is_finite() && y.is_finite()) || (x - y).abs() < length + 1e-5);
                }
            }
        }
        let seams = places.iter().filter(|p| p.seam == 0.0).count();
        assert!(seams > 100, "{seams}");
    }
}
