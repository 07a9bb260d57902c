//! Coarsening of panels that are triangulated too finely to be simulated in time.
//!
//! Edges are collapsed in the flat panels, so that rest shapes stay exact, and along both sides of a seam at once.

use crate::{GarmentMesh, RenderMesh};
use std::collections::{BTreeMap, BTreeSet};
use tryon_geometry::math::P3;
use tryon_geometry::math::order_statistics::median;
use tryon_geometry::mesh::{Face, sides, undirected};
use tryon_geometry::settings;

settings! {
    /// Settings of the coarsening.
    pub struct CoarsenSettings {
        /// Length over the target below which edges collapse (Botsch & Kobbelt 2004).
        pub collapse: f64 = 4.0 / 5.0,
        /// Longest edge that a collapse may make, over the target.
        pub longest: f64 = 1.6,
        /// Smallest angle that a collapse may make, or none smaller than there was, degrees.
        pub angle: f64 = 18.0,
        /// Largest distance of seams and hems from their course, over the target. Larger changes the cut.
        pub off_course: f64 = 0.1,
        /// Passes over all edges: each may halve the number of vertices.
        pub passes: usize = 16,
    }
}

type P2 = [f64; 2];

struct Coarsener {
    /// Faces over simulation vertices and over those of the panels; `None` once collapsed.
    faces: Vec<Option<(Face, Face)>>,
    rest: Vec<[P2; 3]>,
    around: Vec<Vec<u32>>,
    target: f64,
    settings: CoarsenSettings,
}

fn sub(a: P2, b: P2) -> P2 {
    [a[0] - b[0], a[1] - b[1]]
}

fn length(a: P2) -> f64 {
    a[0].hypot(a[1])
}

fn cross(a: P2, b: P2) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Sine of the smallest angle with the sign of the area.
fn quality(t: &[P2; 3]) -> f64 {
    let e = [sub(t[1], t[0]), sub(t[2], t[1]), sub(t[0], t[2])];
    let l = e.map(length);
    let product = (l[0] * l[1]).max(l[1] * l[2]).max(l[2] * l[0]);
    if product > 0.0 {
        cross(e[0], e[1]) / product
    } else {
        0.0
    }
}

/// Targets of a collapse: the panel vertex that each one becomes, and its place.
type Moves = BTreeMap<u32, (u32, P2)>;

impl Coarsener {
    /// Edges to collapse, the shortest first.
    fn short(&self) -> Vec<(u32, u32)> {
        let mut all = BTreeMap::new();
        for (f, t) in self
            .faces
            .iter()
            .zip(&self.rest)
            .filter_map(|(f, t)| Some((f.as_ref()?.0, t)))
        {
            for k in 0..3 {
                let (a, b) = (f[k], f[(k + 1) % 3]);
                let l = length(sub(t[(k + 1) % 3], t[k]));
                let e = all.entry((a.min(b), a.max(b))).or_insert(0.0f64);
                *e = e.max(l);
            }
        }
        let mut out: Vec<_> = all
            .into_iter()
            .filter(|(_, l)| *l < self.settings.collapse * self.target)
            .collect();
        out.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        out.into_iter().map(|(e, _)| e).collect()
    }
    fn neighbours(&self, v: u32) -> BTreeSet<u32> {
        let faces = self.around[v as usize]
            .iter()
            .filter_map(|f| self.faces[*f as usize]);
        faces.flat_map(|f| f.0).filter(|w| *w != v).collect()
    }
    /// Moves of the panels' vertices when `v` collapses into `w`; `None` when that is not allowed.
    fn allowed_moves(&self, v: u32, w: u32) -> Option<Moves> {
        let here = || {
            self.around[v as usize]
                .iter()
                .filter_map(|f| Some((*f as usize, self.faces[*f as usize]?)))
        };
        let corner = |f: &Face, v: u32| f.iter().position(|c| *c == v);
        let mut moves = Moves::new();
        let mut opposite = BTreeSet::new();
        // Neighbours of each of the panels' copies of v, and in how many faces.
        let mut rings: BTreeMap<u32, BTreeMap<u32, (u32, P2)>> = BTreeMap::new();
        let mut at = BTreeMap::new();
        for (f, (sim, loose)) in here() {
            let i = corner(&sim, v)?;
            at.insert(loose[i], self.rest[f][i]);
            for k in [(i + 1) % 3, (i + 2) % 3] {
                rings
                    .entry(loose[i])
                    .or_default()
                    .entry(loose[k])
                    .or_insert((0, self.rest[f][k]))
                    .0 += 1;
            }
            if let Some(j) = corner(&sim, w) {
                opposite.insert(sim[3 - i - j]);
                let to = (loose[j], self.rest[f][j]);
                if moves.insert(loose[i], to).is_some_and(|old| old.0 != to.0) {
                    return None;
                }
            }
        }
        if moves.len() != rings.len()
            || self.neighbours(v).intersection(&self.neighbours(w)).count() != opposite.len()
        {
            return None;
        }
        for (copy, ring) in &rings {
            let (to, place) = moves[copy];
            let rim: Vec<(u32, P2)> = ring
                .iter()
                .filter(|(_, n)| n.0 == 1)
                .map(|(l, n)| (*l, n.1))
                .collect();
            match rim[..] {
                [] => {}
                [a, b] if a.0 == to || b.0 == to => {
                    let end = if a.0 == to { b.1 } else { a.1 };
                    let chord = sub(place, end);
                    let off = cross(chord, sub(at[copy], end)).abs()
                        / length(chord).max(f64::MIN_POSITIVE);
                    if off > self.settings.off_course * self.target {
                        return None;
                    }
                }
                _ => return None,
            }
        }
        let good = self.settings.angle.to_radians().sin();
        for (f, (sim, loose)) in here().filter(|(_, (sim, _))| corner(sim, w).is_none()) {
            let i = corner(&sim, v)?;
            let old = self.rest[f];
            let mut new = old;
            new[i] = moves.get(&loose[i])?.1;
            let longest = self.settings.longest * self.target;
            let long = (0..3).any(|k| length(sub(new[k], new[(k + 1) % 3])) > longest);
            let (before, after) = (quality(&old), quality(&new));
            if long || before * after <= 0.0 || after.abs() < good.min(before.abs()) {
                return None;
            }
        }
        Some(moves)
    }
    fn collapse(&mut self, v: u32, w: u32, moves: &Moves) {
        for f in std::mem::take(&mut self.around[v as usize]) {
            let Some((sim, loose)) = &mut self.faces[f as usize] else {
                continue;
            };
            if sim.contains(&w) {
                self.faces[f as usize] = None;
                continue;
            }
            for k in 0..3 {
                if sim[k] == v {
                    let (to, place) = moves[&loose[k]];
                    (sim[k], loose[k], self.rest[f as usize][k]) = (w, to, place);
                }
            }
            self.around[w as usize].push(f);
        }
    }
}

/// Median length of the edges at rest, metres.
pub fn median_edge(g: &GarmentMesh) -> f64 {
    let lengths = |t: &[[f64; 2]; 3]| [0, 1, 2].map(|k| length(sub(t[(k + 1) % 3], t[k])));
    let mut all: Vec<f64> = g.rest.iter().flat_map(lengths).collect();
    median(&mut all).unwrap_or(0.0)
}

/// The same panels and seams on some of the vertices, with edges of about `target` metres at rest; and their positions.
pub fn coarsen(
    g: &GarmentMesh,
    positions: &[P3],
    target: f64,
    settings: &CoarsenSettings,
) -> (GarmentMesh, Vec<P3>) {
    let mut around = vec![Vec::new(); g.vertices];
    for (i, f) in g.faces.iter().enumerate() {
        f.iter().for_each(|v| around[*v as usize].push(i as u32));
    }
    let faces = g
        .faces
        .iter()
        .zip(&g.render.faces)
        .map(|(a, b)| Some((*a, *b)))
        .collect();
    let mut c = Coarsener {
        faces,
        rest: g.rest.clone(),
        around,
        target,
        settings: *settings,
    };
    for _ in 0..settings.passes {
        let mut gone = BTreeSet::new();
        for (a, b) in c.short() {
            // Each vertex takes part in one collapse a pass, so that all panels thin out evenly.
            if gone.contains(&a) || gone.contains(&b) {
                continue;
            }
            let collapse = [(a, b), (b, a)]
                .into_iter()
                .find_map(|(v, w)| Some((v, w, c.allowed_moves(v, w)?)));
            if let Some((v, w, moves)) = collapse {
                c.collapse(v, w, &moves);
                gone.extend([v, w]);
            }
        }
        if gone.is_empty() {
            break;
        }
    }
    rebuilt(g, positions, &c)
}

/// Numbers in order of use.
fn numbered(used: impl Iterator<Item = u32>) -> BTreeMap<u32, u32> {
    let all: BTreeSet<u32> = used.collect();
    all.into_iter().zip(0..).collect()
}

fn rebuilt(g: &GarmentMesh, positions: &[P3], c: &Coarsener) -> (GarmentMesh, Vec<P3>) {
    let kept: Vec<(usize, Face, Face)> = c
        .faces
        .iter()
        .enumerate()
        .filter_map(|(i, f)| f.map(|(sim, loose)| (i, sim, loose)))
        .collect();
    let (sim, loose) = (
        numbered(kept.iter().flat_map(|k| k.1)),
        numbered(kept.iter().flat_map(|k| k.2)),
    );
    let mut out = GarmentMesh {
        vertices: sim.len(),
        ..g.clone()
    };
    out.faces = kept.iter().map(|k| k.1.map(|v| sim[&v])).collect();
    out.rest = kept.iter().map(|k| c.rest[k.0]).collect();
    out.face_panel = kept.iter().map(|k| g.face_panel[k.0]).collect();
    out.corners = sim.keys().map(|v| g.corners[*v as usize].clone()).collect();
    out.uv = sim.keys().map(|v| g.uv[*v as usize]).collect();
    out.regions = sim.keys().map(|v| g.regions[*v as usize]).collect();
    out.anchors.iter_mut().for_each(|a| {
        a.vertices = a
            .vertices
            .iter()
            .filter_map(|v| sim.get(v).copied())
            .collect()
    });
    out.render = RenderMesh {
        vertex: loose
            .keys()
            .map(|l| sim[&g.render.vertex[*l as usize]])
            .collect(),
        uv: loose.keys().map(|l| g.render.uv[*l as usize]).collect(),
        faces: kept.iter().map(|k| k.2.map(|l| loose[&l])).collect(),
        trims: g.render.trims.clone(),
    };
    // Seams: edges between two faces that have no panel's edge in common.
    let edges = |f: &Face| sides(f).map(undirected);
    let (mut in_panels, mut in_all) = (BTreeMap::new(), BTreeMap::new());
    for (f, l) in out.faces.iter().zip(&out.render.faces) {
        for (edge, loose) in edges(f).into_iter().zip(edges(l)) {
            *in_all.entry(edge).or_insert(0) += 1;
            in_panels.entry(loose).or_insert((0, edge)).0 += 1;
        }
    }
    let seams: BTreeSet<[u32; 2]> = in_panels
        .values()
        .filter(|(n, e)| *n == 1 && in_all[e] == 2)
        .map(|(_, e)| *e)
        .collect();
    out.seams = seams.into_iter().collect();
    out.min_angle = out
        .rest
        .iter()
        .map(|t| quality(t).abs().asin().to_degrees())
        .fold(180.0, f64::min);
    (out, sim.keys().map(|v| positions[*v as usize]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Size, Triangulation, library, rest_area};

    #[test]
    fn panels_keep_their_area_seams_and_holes_with_a_tenth_of_the_vertices() {
        let p = library::pattern("tshirt", Size::M).expect("pattern");
        let fine = GarmentMesh::sew(
            &p,
            &Triangulation {
                edge_length: 0.008,
                min_angle: 20.0,
                ..Triangulation::default()
            },
        )
        .expect("sewn");
        let at: Vec<P3> = (0..fine.vertices)
            .map(|i| P3::new(i as f32, 0.0, 0.0))
            .collect();
        let (coarse, kept) = coarsen(&fine, &at, 0.024, &CoarsenSettings::default());
        assert!(
            coarse.vertices * 6 < fine.vertices,
            "{} of {}",
            coarse.vertices,
            fine.vertices
        );
        assert_eq!(kept.len(), coarse.vertices);
        assert!(coarse.min_angle > 15.0, "{}", coarse.min_angle);
        let area = |g: &GarmentMesh| g.rest.iter().map(rest_area).sum::<f64>();
        assert!(
            (area(&coarse) / area(&fine) - 1.0).abs() < 0.01,
            "{} {}",
            area(&coarse),
            area(&fine)
        );
        // Holes, pieces and handles are the same: Euler's number.
        let euler = |g: &GarmentMesh| {
            let t = g.topology().expect("proper");
            g.vertices as i64 + g.faces.len() as i64 - t.edges().len() as i64
        };
        assert_eq!(euler(&coarse), euler(&fine));
        // Both sides of a seam have the same lengths.
        let longest = |g: &GarmentMesh| g.seams.len();
        assert!(longest(&coarse) > 40 && longest(&coarse) < longest(&fine));
        assert!(
            coarse.render.vertex.len() > coarse.vertices,
            "panels keep their own vertices along seams"
        );
        for (f, l) in coarse.faces.iter().zip(&coarse.render.faces) {
            assert_eq!(*f, l.map(|v| coarse.render.vertex[v as usize]));
        }
    }

    #[test]
    fn a_coarse_mesh_stays_as_it_is() {
        let p = library::pattern("skirt", Size::M).expect("pattern");
        let g = GarmentMesh::sew(
            &p,
            &Triangulation {
                edge_length: 0.03,
                min_angle: 20.0,
                ..Triangulation::default()
            },
        )
        .expect("sewn");
        let at = vec![P3::origin(); g.vertices];
        let (same, _) = coarsen(&g, &at, 0.01, &CoarsenSettings::default());
        assert_eq!((same.vertices, &same.faces), (g.vertices, &g.faces));
        assert!((median_edge(&g) - 0.03).abs() < 0.01);
    }
}
