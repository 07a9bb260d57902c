//! A patch of a sheet, compiled for the inner loop: its own vertices first, then some rings of its neighbours'.
//!
//! A step moves news by one ring, so a patch with `rings` rings of ghosts can take that many steps alone; then ghosts
//! are copied from their owners. How many patches there are is part of the model, not of the machine: so the bits do
//! not depend on the number of threads.

use super::lanes::{At, LANES, Place};
use super::motion::Motion;
use super::plan::{Plan, Triangle};

/// The most vertices a patch may have.
pub(super) const MOST: usize = 1 << 15;

/// Eight triangles; the last eight are filled up with ones that pull nothing.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(32))]
pub(super) struct Triangles {
    pub(super) rest: [[f32; LANES]; 3],
    pub(super) k: [[f32; LANES]; 6],
    pub(super) v: [At; 3],
}

/// A hinge bent at rest; sorted by the lowest vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bent {
    pub(super) v: [Place; 4],
    pub(super) c: [f32; 4],
    pub(super) w: f32,
    pub(super) rest: f32,
}

/// Neighbours of a vertex that fit a row: most vertices of a triangulation have six.
pub(super) const ROW: usize = 6;

/// A vertex in the smoothing: its neighbours, their weights and its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) near: [Place; ROW],
    pub(super) by: [f32; ROW],
    pub(super) own: f32,
}

/// A neighbour that did not fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Far {
    pub(super) vertex: Place,
    pub(super) near: Place,
    pub(super) by: f32,
}

/// Immutable.
#[derive(Clone, Debug)]
pub struct Fabric {
    /// Sheet vertex of each local one; the first [`Fabric::owned`] belong to this patch.
    pub vertices: Vec<u32>,
    /// Number of owned vertices.
    pub owned: usize,
    /// Vertices within so many rings of the owned ones.
    pub(super) within: Vec<usize>,
    /// Patch and place there of each ghost.
    pub(super) ghosts: Vec<[u32; 2]>,
    pub(super) inverse_mass: Vec<f32>,
    /// By their lowest corner.
    pub(super) triangles: Vec<Triangles>,
    /// Edges by their lower end.
    pub(super) ends: Vec<[u16; 2]>,
    pub(super) rest: Vec<f32>,
    pub(super) rows: Vec<Row>,
    pub(super) far: Vec<Far>,
    /// Coefficients of the smoothing, the lowest (1) first.
    pub(super) smoothing: Vec<f32>,
    /// Bending pairs of each vertex with a higher one.
    pub(super) bend_count: Vec<u16>,
    pub(super) bend: Vec<(Place, f32)>,
    pub(super) bent: Vec<Bent>,
    pub(super) damping: f32,
}

impl Fabric {
    /// Vertices that are computed where what lies `rings` rings around the owned ones must be right.
    pub(super) fn reach(&self, rings: usize) -> usize {
        self.within.get(rings).copied().unwrap_or(self.vertices.len())
    }
}

impl Plan {
    /// Cuts the sheet into patches: as many as asked for, more where they would be too large.
    pub fn patches(&self, wanted: usize, rings: usize) -> Vec<Fabric> {
        let n = self.vertices();
        let mut around = vec![Vec::new(); n];
        for e in &self.ends {
            around[e[0] as usize].push(e[1]);
            around[e[1] as usize].push(e[0]);
        }
        let order = by_distance(&around);
        // A large patch leaves half of its room to ghosts.
        let k = wanted.max(1).max(if n < MOST { 1 } else { n.div_ceil(MOST / 2) }).min(n.max(1));
        let mut owner = vec![[0u32; 2]; n];
        let sets: Vec<Vec<u32>> = (0..k).map(|p| order[p * n / k..(p + 1) * n / k].to_vec()).collect();
        for (p, set) in sets.iter().enumerate() {
            for (i, v) in set.iter().enumerate() {
                owner[*v as usize] = [p as u32, i as u32];
            }
        }
        sets.into_iter().map(|set| self.patch(set, if k > 1 { rings } else { 0 }, &around, &owner)).collect()
    }

    fn patch(&self, mut set: Vec<u32>, rings: usize, around: &[Vec<u32>], owner: &[[u32; 2]]) -> Fabric {
        let owned = set.len();
        let mut local = vec![u32::MAX; self.vertices()];
        set.iter().enumerate().for_each(|(i, v)| local[*v as usize] = i as u32);
        let (mut from, mut within) = (0, vec![owned]);
        for _ in 0..rings {
            let to = set.len();
            for i in from..to {
                for &w in &around[set[i] as usize] {
                    // Where one vertex has more neighbours than there is room for, some are left out.
                    if local[w as usize] == u32::MAX && set.len() < MOST {
                        local[w as usize] = set.len() as u32;
                        set.push(w);
                    }
                }
            }
            from = to;
            within.push(set.len());
        }
        let at = |v: u32| local[v as usize];
        let inside = |v: &[u32]| v.iter().all(|v| local[*v as usize] != u32::MAX);
        // Edges by lower local end, each with its number in the sheet.
        let mut edges: Vec<([u32; 2], usize)> = self
            .ends
            .iter()
            .enumerate()
            .filter(|(_, e)| inside(&e[..]))
            .map(|(i, e)| ([at(e[0]).min(at(e[1])), at(e[0]).max(at(e[1]))], i))
            .collect();
        edges.sort_unstable_by_key(|e| e.0);
        let mut bend: Vec<([u32; 2], f32)> = self
            .bend
            .iter()
            .filter(|(v, _)| inside(&v[..]))
            .map(|(v, w)| ([at(v[0]).min(at(v[1])), at(v[0]).max(at(v[1]))], *w))
            .collect();
        bend.sort_unstable_by_key(|e| e.0);
        let counts = |of: &mut dyn Iterator<Item = u32>| {
            let mut c = vec![0u16; set.len()];
            of.for_each(|v| c[v as usize] += 1);
            c
        };
        let inverse_mass: Vec<f32> = set.iter().map(|v| self.inverse_mass[*v as usize]).collect();
        let weight: Vec<f32> = edges.iter().map(|e| self.smooth[e.1]).collect();
        let ends: Vec<[u16; 2]> = edges.iter().map(|e| e.0.map(|v| v as u16)).collect();
        let (rows, far) = rows(&ends, &weight, &inverse_mass);
        let triangles = self.triangles.iter().filter(|t| inside(&t.v)).map(|t| Triangle { v: t.v.map(at), ..*t });
        let bent = self.bent.iter().filter(|b| inside(&b.v));
        let mut bent: Vec<Bent> =
            bent.map(|b| Bent { v: b.v.map(|v| Place::of(at(v) as usize)), c: b.c, w: b.w, rest: b.rest }).collect();
        bent.sort_by_key(|b| b.v.iter().min().copied());
        Fabric {
            triangles: eights(triangles.collect()),
            rows,
            far,
            within,
            smoothing: self.smoothing.clone(),
            ends,
            bend_count: counts(&mut bend.iter().map(|e| e.0[0])),
            rest: edges.iter().map(|e| self.rest[e.1]).collect(),
            bend: bend.iter().map(|e| (Place::of(e.0[1] as usize), e.1)).collect(),
            bent,
            inverse_mass,
            ghosts: set[owned..].iter().map(|v| owner[*v as usize]).collect(),
            owned,
            vertices: set,
            damping: self.damping,
        }
    }
}

/// Triangles by their lowest corner, eight to a block.
fn eights(mut all: Vec<Triangle>) -> Vec<Triangles> {
    all.sort_by_key(|t| t.v.iter().min().copied());
    let block = |of: &[Triangle]| {
        let mut out = Triangles::default();
        for (lane, t) in of.iter().enumerate() {
            for i in 0..3 {
                (out.v[i][lane], out.rest[i][lane]) = (Place::of(t.v[i] as usize), t.rest[i]);
            }
            for i in 0..6 {
                out.k[i][lane] = t.k[i];
            }
        }
        out
    };
    all.chunks(LANES).map(block).collect()
}

fn rows(ends: &[[u16; 2]], weight: &[f32], inverse_mass: &[f32]) -> (Vec<Row>, Vec<Far>) {
    let mut rows = vec![Row { near: [Place::default(); ROW], by: [0.0; ROW], own: 0.0 }; inverse_mass.len()];
    let mut filled = vec![0usize; rows.len()];
    let mut far = Vec::new();
    for (v, weight) in ends.iter().zip(weight) {
        for (vertex, near) in [(v[0], v[1]), (v[1], v[0])] {
            let (i, near) = (usize::from(vertex), Place::of(usize::from(near)));
            let by = weight * inverse_mass[i];
            rows[i].own += by;
            if filled[i] < ROW {
                (rows[i].near[filled[i]], rows[i].by[filled[i]]) = (near, by);
                filled[i] += 1;
            } else {
                far.push(Far { vertex: Place::of(i), near, by });
            }
        }
    }
    (rows, far)
}

/// Vertices in order of their distance (in edges) from one at the rim: neighbours come close together in memory, and
/// stretches of the order are bands of the sheet.
fn by_distance(around: &[Vec<u32>]) -> Vec<u32> {
    let n = around.len();
    let sweep = |from: &[u32]| {
        let mut seen = vec![false; n];
        let mut order: Vec<u32> = Vec::with_capacity(n);
        for &f in from {
            if seen[f as usize] {
                continue;
            }
            seen[f as usize] = true;
            let mut next = order.len();
            order.push(f);
            while next < order.len() {
                for &w in &around[order[next] as usize] {
                    if !seen[w as usize] {
                        seen[w as usize] = true;
                        order.push(w);
                    }
                }
                next += 1;
            }
        }
        order
    };
    let all: Vec<u32> = (0..n as u32).collect();
    let mut first = sweep(&all);
    first.reverse();
    sweep(&first)
}

/// Copies what owners know to the ghosts of every patch; `motion` finds a patch's motion.
pub fn exchange<T>(fabrics: &[Fabric], patches: &mut [T], motion: impl Fn(&mut T) -> &mut Motion) {
    for p in 0..fabrics.len() {
        for (k, [q, j]) in fabrics[p].ghosts.iter().enumerate() {
            let (i, j) = (fabrics[p].owned + k, *j as usize);
            let from = motion(&mut patches[*q as usize]);
            let (m, v, a) = (from.moved[j], from.velocity[j], from.work.ahead.0[j % MOST]);
            let to = motion(&mut patches[p]);
            (to.moved[i], to.velocity[i], to.work.ahead.0[i % MOST]) = (m, v, a);
        }
    }
}
