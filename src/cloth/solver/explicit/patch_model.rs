//! A patch of a sheet, compiled for the inner loop: its own vertices first, then some rings of its neighbours'.
//!
//! A step moves news by one ring, so a patch with `rings` rings of ghosts can take that many steps alone; then ghosts
//! are copied from their owners. How many patches there are is part of the model, not of the machine: so the bits do
//! not depend on the number of threads.

use super::blocks::{Hinges, Quads, hinges, quads};
use super::fold_limit::Diagonal;
use super::simd::{LANES, Place};
use super::stable_sheet::{Bent, StableSheet, Triangle};
use crate::cloth::model::partition;

/// The most vertices a patch may have.
pub(super) const MOST: usize = 1 << 15;

/// Neighbours of a vertex that fit a row: most vertices of a triangulation have six.
pub(super) const ROW: usize = 6;

/// Two vertices in the smoothing, one after the other: their neighbours, the neighbours' weights and their own.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rows {
    pub(super) near: [[Place; 2]; ROW],
    /// Two of them each; the last their own and nothing.
    pub(super) by: [[[f32; 2]; 2]; ROW / 2 + 1],
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
pub struct PatchModel {
    /// Sheet vertex of each local one; the first [`PatchModel::owned`] belong to this patch.
    pub vertices: Vec<u32>,
    /// Number of owned vertices.
    pub owned: usize,
    /// Where its regions begin among the owned vertices, and how many those are: compact pieces that may sleep.
    pub islands: Vec<usize>,
    /// Vertices within so many rings of the owned ones.
    pub(super) within: Vec<usize>,
    /// Owned vertices that others have as ghosts.
    pub(super) border: Vec<u32>,
    /// Patch of each ghost and where it is in that one's border.
    pub(super) ghosts: Vec<[u32; 2]>,
    pub(super) inverse_mass: Vec<f32>,
    /// By their lowest corner.
    pub(super) quads: Vec<Quads>,
    /// Edges by their lower end.
    pub(super) ends: Vec<[u16; 2]>,
    pub(super) rest: Vec<f32>,
    pub(super) rows: Vec<Rows>,
    pub(super) far: Vec<Far>,
    /// Coefficients of the smoothing, the lowest (1) first.
    pub(super) smoothing: Vec<f32>,
    /// Bending pairs of each vertex with a higher one.
    pub(super) bend_count: Vec<u16>,
    pub(super) bend: Vec<(Place, f32)>,
    pub(super) bent: Vec<Hinges>,
    pub(super) diagonals: Vec<Diagonal>,
    pub(super) damping: f32,
}

impl PatchModel {
    /// Vertices that are computed where what lies `rings` rings around the owned ones must be right.
    pub(super) fn reach(&self, rings: usize) -> usize {
        self.within
            .get(rings)
            .copied()
            .unwrap_or(self.vertices.len())
    }
}

impl StableSheet {
    /// Cuts the sheet into patches: as many as asked for, more where they would be too large; and these into regions of at
    /// most `region` vertices, if that is not 0.
    pub fn compile_patches(&self, wanted: usize, rings: usize, region: usize) -> Vec<PatchModel> {
        let n = self.vertices();
        let mut around = vec![Vec::new(); n];
        for e in &self.ends {
            around[e[0] as usize].push(e[1]);
            around[e[1] as usize].push(e[0]);
        }
        // A large patch leaves half of its room to ghosts.
        let k = wanted
            .max(1)
            .max(if n < MOST { 1 } else { n.div_ceil(MOST / 2) })
            .min(n.max(1));
        let orders = if k > 1 {
            self.orders(&around)
        } else {
            vec![by_distance(&around)]
        };
        let bands = |order: Vec<u32>| -> Vec<Vec<u32>> {
            (0..k)
                .map(|p| order[p * n / k..(p + 1) * n / k].to_vec())
                .collect()
        };
        // The one whose patches have the fewest neighbours in others.
        let cut = |sets: &Vec<Vec<u32>>| {
            let mut of = vec![0usize; n];
            for (p, set) in sets.iter().enumerate() {
                set.iter().for_each(|v| of[*v as usize] = p);
            }
            self.ends
                .iter()
                .filter(|e| of[e[0] as usize] != of[e[1] as usize])
                .count()
        };
        let sets = orders
            .into_iter()
            .map(bands)
            .min_by_key(cut)
            .unwrap_or_default();
        let whole = |set: Vec<u32>| partition::Partition {
            starts: vec![0, set.len()],
            order: set,
        };
        let in_regions = |set| partition::cut(n, |v| &around[v as usize], set, region, LANES);
        let sets: Vec<partition::Partition> = sets
            .into_iter()
            .map(|set| {
                if region > 0 {
                    in_regions(set)
                } else {
                    whole(set)
                }
            })
            .collect();
        let mut owner = vec![[0u32; 2]; n];
        for (p, set) in sets.iter().enumerate() {
            for (i, v) in set.order.iter().enumerate() {
                owner[*v as usize] = [p as u32, i as u32];
            }
        }
        let mut all: Vec<PatchModel> = sets
            .into_iter()
            .map(|set| self.patch(set, if k > 1 { rings } else { 0 }, &around, &owner))
            .collect();
        // Ghosts name the owner's vertex so far; now its place in the border.
        for q in 0..all.len() as u32 {
            let wanted = all
                .iter()
                .flat_map(|f| &f.ghosts)
                .filter(|g| g[0] == q)
                .map(|g| g[1]);
            let mut border: Vec<u32> = wanted.collect();
            border.sort_unstable();
            border.dedup();
            for g in all
                .iter_mut()
                .flat_map(|f| &mut f.ghosts)
                .filter(|g| g[0] == q)
            {
                g[1] = border.binary_search(&g[1]).unwrap_or(0) as u32;
            }
            all[q as usize].border = border;
        }
        all
    }

    /// Orders in which stretches may be short to cut: by the distance from a corner, from each rim, and from a shortest
    /// way between two rims (which halves a tube along its length).
    fn orders(&self, around: &[Vec<u32>]) -> Vec<Vec<u32>> {
        let mut orders = vec![by_distance(around)];
        let rims = self.rims();
        for rim in &rims {
            let ways = ways(around, rim);
            orders.push(ways.order.clone());
            let others = rims.iter().filter(|o| o[0] != rim[0]).flatten();
            if let Some(mut v) = others.copied().min_by_key(|v| ways.far[*v as usize]) {
                let mut line = vec![v];
                while ways.from[v as usize] != v {
                    v = ways.from[v as usize];
                    line.push(v);
                }
                orders.push(self::ways(around, &line).order);
            }
        }
        orders
    }

    /// Vertices of each rim, the longest two first and no more.
    fn rims(&self) -> Vec<Vec<u32>> {
        let mut edges: Vec<[u32; 2]> = self
            .triangles
            .iter()
            .flat_map(|t| {
                [(0, 1), (1, 2), (2, 0)].map(|(i, j)| [t.v[i].min(t.v[j]), t.v[i].max(t.v[j])])
            })
            .collect();
        edges.sort_unstable();
        let mut next = vec![Vec::new(); self.vertices()];
        for same in edges.chunk_by(|a, b| a == b).filter(|s| s.len() == 1) {
            let [a, b] = same[0];
            next[a as usize].push(b);
            next[b as usize].push(a);
        }
        let mut seen = vec![false; next.len()];
        let mut rims = Vec::new();
        for v in 0..next.len() as u32 {
            if seen[v as usize] || next[v as usize].is_empty() {
                continue;
            }
            seen[v as usize] = true;
            let (mut rim, mut at) = (vec![v], 0);
            while at < rim.len() {
                for w in &next[rim[at] as usize] {
                    if !std::mem::replace(&mut seen[*w as usize], true) {
                        rim.push(*w);
                    }
                }
                at += 1;
            }
            rims.push(rim);
        }
        rims.sort_by_key(|r| std::cmp::Reverse(r.len()));
        rims.truncate(2);
        rims
    }

    fn patch(
        &self,
        own: partition::Partition,
        rings: usize,
        around: &[Vec<u32>],
        owner: &[[u32; 2]],
    ) -> PatchModel {
        let partition::Partition {
            order: mut set,
            starts: islands,
        } = own;
        let owned = set.len();
        let mut local = vec![u32::MAX; self.vertices()];
        set.iter()
            .enumerate()
            .for_each(|(i, v)| local[*v as usize] = i as u32);
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
        let triangles = self
            .triangles
            .iter()
            .filter(|t| inside(&t.v))
            .map(|t| Triangle {
                v: t.v.map(at),
                ..*t
            });
        let bent = self.bent.iter().filter(|b| inside(&b.v)).map(|b| Bent {
            v: b.v.map(at),
            ..*b
        });
        let diagonals = self
            .diagonals
            .iter()
            .filter(|s| inside(&s.ends))
            .map(|s| Diagonal {
                ends: s.ends.map(at),
                ..*s
            });
        PatchModel {
            diagonals: diagonals.collect(),
            quads: quads(&triangles.collect::<Vec<_>>()),
            rows,
            far,
            within,
            smoothing: self.smoothing.clone(),
            ends,
            bend_count: counts(&mut bend.iter().map(|e| e.0[0])),
            rest: edges.iter().map(|e| self.rest[e.1]).collect(),
            bend: bend
                .iter()
                .map(|e| (Place::of(e.0[1] as usize), e.1))
                .collect(),
            bent: hinges(bent.collect()),
            inverse_mass,
            ghosts: set[owned..].iter().map(|v| owner[*v as usize]).collect(),
            border: Vec::new(),
            owned,
            islands,
            vertices: set,
            damping: self.damping,
        }
    }
}

fn rows(ends: &[[u16; 2]], weight: &[f32], inverse_mass: &[f32]) -> (Vec<Rows>, Vec<Far>) {
    let mut rows = vec![Rows::default(); inverse_mass.len().div_ceil(2)];
    let mut filled = vec![0usize; inverse_mass.len()];
    let mut far = Vec::new();
    for (v, weight) in ends.iter().zip(weight) {
        for (vertex, near) in [(v[0], v[1]), (v[1], v[0])] {
            let (i, near) = (usize::from(vertex), Place::of(usize::from(near)));
            let by = weight * inverse_mass[i];
            let (row, k) = (&mut rows[i / 2], i % 2);
            row.by[ROW / 2][0][k] += by;
            if filled[i] < ROW {
                let n = filled[i];
                (row.near[n][k], row.by[n / 2][n % 2][k]) = (near, by);
                filled[i] += 1;
            } else {
                far.push(Far {
                    vertex: Place::of(i),
                    near,
                    by,
                });
            }
        }
    }
    (rows, far)
}

/// Shortest ways in edges.
struct Ways {
    /// All vertices, the nearest first.
    order: Vec<u32>,
    far: Vec<u32>,
    /// The one before each on its way; itself at the start.
    from: Vec<u32>,
}

/// Ways from some vertices to all, sheet by sheet where there are several.
fn ways(around: &[Vec<u32>], starts: &[u32]) -> Ways {
    let n = around.len();
    let mut w = Ways {
        order: Vec::with_capacity(n),
        far: vec![u32::MAX; n],
        from: (0..n as u32).collect(),
    };
    let mut next = 0;
    let all = 0..n as u32;
    // The starts together, then whatever they do not reach.
    for group in std::iter::once(starts.to_vec()).chain(all.map(|v| vec![v])) {
        for v in group {
            if w.far[v as usize] == u32::MAX {
                w.far[v as usize] = 0;
                w.order.push(v);
            }
        }
        while next < w.order.len() {
            let v = w.order[next];
            for &o in &around[v as usize] {
                if w.far[o as usize] == u32::MAX {
                    (w.far[o as usize], w.from[o as usize]) = (w.far[v as usize] + 1, v);
                    w.order.push(o);
                }
            }
            next += 1;
        }
    }
    w
}

/// Vertices in order of their distance (in edges) from one at the rim: neighbours come close together in memory, and
/// stretches of the order are bands of the sheet.
fn by_distance(around: &[Vec<u32>]) -> Vec<u32> {
    let last = ways(around, &[]).order.last().copied();
    ways(around, last.as_slice()).order
}
