//! A patch of a sheet, compiled for the inner loop: its own vertices first, then some rings of its neighbours'.
//!
//! A step moves news by one ring, so a patch with `rings` rings of ghosts can take that many steps alone; then ghosts
//! are copied from their owners. How many patches there are is part of the model, not of the machine: so the bits do
//! not depend on the number of threads.

use super::motion::Motion;
use super::plan::Plan;

/// The most vertices or edges a patch may have: indices are 16 bits.
pub(super) const MOST: usize = 1 << 16;

/// Stiffness between an edge and its neighbours.
#[derive(Clone, Copy, Debug)]
pub(super) struct Couple {
    pub(super) own: f32,
    pub(super) by: [f32; 4],
    pub(super) edge: [u16; 4],
}

/// A hinge bent at rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bent {
    pub(super) v: [u16; 4],
    pub(super) c: [f32; 4],
    pub(super) w: f32,
    pub(super) rest: f32,
}

/// Edges that are taken together, so that their vectors stay in the nearest cache until they are used up.
pub(super) const BLOCK: usize = 256;
/// Edges of a vertex that fit a row: most vertices of a triangulation have six.
pub(super) const ROW: usize = 6;

/// What a vertex gathers: three edges that begin in it and three that end there (one number beyond the last edge where
/// there are fewer), its neighbours and their weights in the smoothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) edges: [u16; ROW],
    pub(super) near: [u16; ROW],
    pub(super) by: [f32; ROW],
    pub(super) own: f32,
}

/// An edge that did not fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extra {
    pub(super) vertex: u16,
    pub(super) edge: u16,
    /// 1 where it begins in the vertex, -1 where it ends there.
    pub(super) sign: f32,
}

/// A neighbour that did not fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Far {
    pub(super) vertex: u16,
    pub(super) near: u16,
    pub(super) by: f32,
}

/// Immutable.
#[derive(Clone, Debug)]
pub struct Fabric {
    /// Sheet vertex of each local one; the first [`Fabric::owned`] belong to this patch.
    pub vertices: Vec<u32>,
    /// Number of owned vertices.
    pub owned: usize,
    /// Patch and place there of each ghost.
    pub(super) ghosts: Vec<[u32; 2]>,
    pub(super) inverse_mass: Vec<f32>,
    /// Edges by their lower end, directed so that about as many begin as end in each vertex.
    pub(super) ends: Vec<[u16; 2]>,
    pub(super) rest: Vec<f32>,
    pub(super) couple: Vec<Couple>,
    pub(super) rows: Vec<Row>,
    pub(super) extra: Vec<Extra>,
    pub(super) far: Vec<Far>,
    /// For each block of edges: how many edges have all their tension, and how many vertices all their pull, when the
    /// lengths of the block are known.
    pub(super) ready: Vec<[u32; 2]>,
    /// Coefficients of the smoothing, the lowest (1) first.
    pub(super) smoothing: Vec<f32>,
    /// Bending pairs of each vertex with a higher one.
    pub(super) bend_count: Vec<u16>,
    pub(super) bend: Vec<(u16, f32)>,
    pub(super) bent: Vec<Bent>,
    pub(super) damping: f32,
}

impl Plan {
    /// Cuts the sheet into patches: as many as asked for, more where 16 bits would not do.
    pub fn patches(&self, wanted: usize, rings: usize) -> Vec<Fabric> {
        let n = self.vertices();
        let mut around = vec![Vec::new(); n];
        for e in &self.ends {
            around[e[0] as usize].push(e[1]);
            around[e[1] as usize].push(e[0]);
        }
        let order = by_distance(&around);
        let k =
            wanted.max(1).max(self.ends.len() / (MOST / 2) + usize::from(self.ends.len() >= MOST - 1)).min(n.max(1));
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
        let mut from = 0;
        for _ in 0..rings {
            let to = set.len();
            for i in from..to {
                for &w in &around[set[i] as usize] {
                    if local[w as usize] == u32::MAX {
                        local[w as usize] = set.len() as u32;
                        set.push(w);
                    }
                }
            }
            from = to;
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
        let mut number = vec![u16::MAX; self.ends.len()];
        edges.iter().enumerate().for_each(|(i, e)| number[e.1] = i as u16);
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
        let present = |e: u32| number[e as usize] != u16::MAX;
        let mut ends: Vec<[u16; 2]> = edges.iter().map(|e| e.0.map(|v| v as u16)).collect();
        balance(&mut ends, set.len());
        let inverse_mass: Vec<f32> = set.iter().map(|v| self.inverse_mass[*v as usize]).collect();
        let weight: Vec<f32> = edges.iter().map(|e| self.smooth[e.1]).collect();
        let (rows, extra, far) = rows(&ends, &weight, &inverse_mass);
        let couple: Vec<Couple> = edges
            .iter()
            .enumerate()
            .map(|(i, e)| {
                let c = &self.couple[e.1];
                let ok = c.edge.map(present);
                Couple {
                    own: c.own,
                    by: std::array::from_fn(|k| if ok[k] { c.by[k] } else { 0.0 }),
                    edge: std::array::from_fn(|k| if ok[k] { number[c.edge[k] as usize] } else { i as u16 }),
                }
            })
            .collect();
        Fabric {
            ready: ready(&couple, &rows),
            rows,
            extra,
            far,
            smoothing: self.smoothing.clone(),
            ends,
            bend_count: counts(&mut bend.iter().map(|e| e.0[0])),
            rest: edges.iter().map(|e| self.rest[e.1]).collect(),
            couple,
            bend: bend.iter().map(|e| (e.0[1] as u16, e.1)).collect(),
            bent: self
                .bent
                .iter()
                .filter(|b| inside(&b.v))
                .map(|b| Bent { v: b.v.map(|v| at(v) as u16), c: b.c, w: b.w, rest: b.rest })
                .collect(),
            inverse_mass,
            ghosts: set[owned..].iter().map(|v| owner[*v as usize]).collect(),
            owned,
            vertices: set,
            damping: self.damping,
        }
    }
}

/// Directs edges along trails that never break off where they could go on: then as many begin as end in each vertex,
/// but for one.
fn balance(ends: &mut [[u16; 2]], vertices: usize) {
    let mut around = vec![Vec::new(); vertices];
    for (e, v) in ends.iter().enumerate() {
        v.iter().for_each(|v| around[usize::from(*v)].push(e));
    }
    let mut used = vec![false; ends.len()];
    // Trails that end somewhere must begin at odd vertices.
    let odd = (0..vertices).filter(|v| around[*v].len() % 2 == 1);
    for start in odd.collect::<Vec<_>>().into_iter().chain(0..vertices) {
        let mut at = start;
        while let Some(e) = std::iter::from_fn(|| around[at].pop()).find(|e| !used[*e]) {
            used[e] = true;
            let [a, b] = ends[e].map(usize::from);
            if a != at {
                ends[e].swap(0, 1);
            }
            at = a + b - at;
        }
    }
}

/// See [`Fabric::ready`]. The last block finishes all.
fn ready(couple: &[Couple], rows: &[Row]) -> Vec<[u32; 2]> {
    let (mut edge, mut vertex) = (0usize, 0usize);
    let blocks = couple.len().div_ceil(BLOCK).max(1);
    (1..=blocks)
        .map(|k| {
            let known = (k * BLOCK).min(couple.len());
            while edge < known && couple[edge].edge.iter().all(|e| usize::from(*e) < known) {
                edge += 1;
            }
            let complete = |r: &Row| r.edges.iter().all(|e| usize::from(*e) < edge || usize::from(*e) == couple.len());
            while vertex < rows.len() && complete(&rows[vertex]) {
                vertex += 1;
            }
            [edge as u32, vertex as u32]
        })
        .collect()
}

fn rows(ends: &[[u16; 2]], weight: &[f32], inverse_mass: &[f32]) -> (Vec<Row>, Vec<Extra>, Vec<Far>) {
    let none = Row { edges: [ends.len() as u16; ROW], near: [0; ROW], by: [0.0; ROW], own: 0.0 };
    let mut rows = vec![none; inverse_mass.len()];
    let mut filled = vec![[0usize; 3]; inverse_mass.len()];
    let (mut extra, mut far) = (Vec::new(), Vec::new());
    for (e, (v, weight)) in ends.iter().zip(weight).enumerate() {
        for side in 0..2 {
            let (vertex, near) = (v[side], v[1 - side]);
            let i = usize::from(vertex);
            let half = ROW / 2;
            if filled[i][side] < half {
                rows[i].edges[side * half + filled[i][side]] = e as u16;
                filled[i][side] += 1;
            } else {
                extra.push(Extra { vertex, edge: e as u16, sign: 1.0 - 2.0 * side as f32 });
            }
            let by = weight * inverse_mass[i];
            rows[i].own += by;
            if filled[i][2] < ROW {
                (rows[i].near[filled[i][2]], rows[i].by[filled[i][2]]) = (near, by);
                filled[i][2] += 1;
            } else {
                far.push(Far { vertex, near, by });
            }
        }
    }
    (rows, extra, far)
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

/// Copies what owners know to the ghosts of every patch.
pub fn exchange(fabrics: &[Fabric], motions: &mut [Motion]) {
    for p in 0..fabrics.len() {
        for (k, [q, j]) in fabrics[p].ghosts.iter().enumerate() {
            let i = fabrics[p].owned + k;
            let (m, v) = (motions[*q as usize].moved[*j as usize], motions[*q as usize].velocity[*j as usize]);
            motions[p].moved[i] = m;
            motions[p].velocity[i] = v;
            motions[p].work.looked = false;
        }
    }
}
