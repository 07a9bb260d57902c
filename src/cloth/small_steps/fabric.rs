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
    pub(super) pull: f32,
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
    /// Edges of each vertex to a higher one.
    pub(super) count: Vec<u16>,
    pub(super) other: Vec<u16>,
    pub(super) rest: Vec<f32>,
    pub(super) couple: Vec<Couple>,
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
        let k = wanted.max(1).max(self.ends.len() / (MOST / 2) + usize::from(self.ends.len() >= MOST)).min(n.max(1));
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
        Fabric {
            count: counts(&mut edges.iter().map(|e| e.0[0])),
            bend_count: counts(&mut bend.iter().map(|e| e.0[0])),
            other: edges.iter().map(|e| e.0[1] as u16).collect(),
            rest: edges.iter().map(|e| self.rest[e.1]).collect(),
            couple: edges
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
                .collect(),
            bend: bend.iter().map(|e| (e.0[1] as u16, e.1)).collect(),
            bent: self
                .bent
                .iter()
                .filter(|b| inside(&b.v))
                .map(|b| Bent { v: b.v.map(|v| at(v) as u16), c: b.c, pull: b.pull })
                .collect(),
            inverse_mass: set.iter().map(|v| self.inverse_mass[*v as usize]).collect(),
            ghosts: set[owned..].iter().map(|v| owner[*v as usize]).collect(),
            owned,
            vertices: set,
            damping: self.damping,
        }
    }
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
        }
    }
}
