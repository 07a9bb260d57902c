//! Patches of a sheet: partition into owned vertices, ghosts around them, and arrays in local numbers.

use super::blocks::{hinge_blocks, quad_blocks};
use super::elements::{CurvedHinge, EdgeTriangle};
use super::patch_model::{FilterOverflow, FilterRow, PatchModel, ROW};
use super::simd::{LANES, Slot};
use super::stable_sheet::StableSheet;
use super::vec4::MAX_VERTICES;
use crate::live::model::bands::bands;
use crate::live::model::partition::{Partition, cut};

impl StableSheet {
    /// Cuts the sheet into `wanted` patches with `rings` rings of ghosts, more where they would be too large. Islands have
    /// at most `island` vertices; 0 makes each patch one island.
    pub fn compile_patches(&self, wanted: usize, rings: usize, island: usize) -> Vec<PatchModel> {
        let n = self.vertices();
        let mut around = vec![Vec::new(); n];
        for e in &self.ends {
            around[e[0] as usize].push(e[1]);
            around[e[1] as usize].push(e[0]);
        }
        // A large patch leaves half of its capacity to ghosts.
        let needed = if n < MAX_VERTICES {
            1
        } else {
            n.div_ceil(MAX_VERTICES / 2)
        };
        let count = wanted.max(1).max(needed).min(n.max(1));
        let islands = |set: Vec<u32>| {
            if island > 0 {
                cut(n, |v| &around[v as usize], set, island, LANES)
            } else {
                Partition::whole(set)
            }
        };
        let faces: Vec<[u32; 3]> = self.triangles.iter().map(|t| t.v).collect();
        let sets = bands(&around, &self.ends, &faces, count);
        let sets: Vec<Partition> = sets.into_iter().map(islands).collect();
        let mut owner = vec![[0u32; 2]; n];
        for (p, set) in sets.iter().enumerate() {
            for (i, v) in set.order.iter().enumerate() {
                owner[*v as usize] = [p as u32, i as u32];
            }
        }
        let rings = if count > 1 { rings } else { 0 };
        let mut all: Vec<PatchModel> = sets
            .into_iter()
            .map(|set| self.patch(Numbering::new(set, rings, &around), &owner))
            .collect();
        link_borders(&mut all);
        all
    }

    fn patch(&self, numbering: Numbering, owner: &[[u32; 2]]) -> PatchModel {
        let at = |v: u32| numbering.local[v as usize];
        let inside = |v: &[u32]| v.iter().all(|v| numbering.local[*v as usize] != u32::MAX);
        let sorted = |v: &[u32; 2]| [at(v[0]).min(at(v[1])), at(v[0]).max(at(v[1]))];
        // Edges by lower local end, each with its number in the sheet.
        let ends = self.ends.iter().enumerate().filter(|(_, e)| inside(&e[..]));
        let mut edges: Vec<([u32; 2], usize)> = ends.map(|(i, e)| (sorted(e), i)).collect();
        edges.sort_unstable_by_key(|e| e.0);
        let pairs = self.bend.iter().filter(|(v, _)| inside(&v[..]));
        let mut bend: Vec<([u32; 2], f32)> = pairs.map(|(v, w)| (sorted(v), *w)).collect();
        bend.sort_unstable_by_key(|e| e.0);
        let Numbering {
            set,
            owned,
            islands,
            within,
            ..
        } = &numbering;
        let mut bend_count = vec![0u16; set.len()];
        bend.iter().for_each(|e| bend_count[e.0[0] as usize] += 1);
        let inverse_mass: Vec<f32> = set.iter().map(|v| self.inverse_mass[*v as usize]).collect();
        let weight: Vec<f32> = edges.iter().map(|e| self.filter_weight[e.1]).collect();
        let ends: Vec<[u16; 2]> = edges.iter().map(|e| e.0.map(|v| v as u16)).collect();
        let (filter_rows, filter_overflow) = filter_rows(&ends, &weight, &inverse_mass);
        let triangles = self.triangles.iter().filter(|t| inside(&t.v));
        let triangle = |t: &EdgeTriangle| EdgeTriangle {
            v: t.v.map(at),
            ..*t
        };
        let bent = self.bent.iter().filter(|b| inside(&b.v));
        let hinge = |b: &CurvedHinge| CurvedHinge {
            v: b.v.map(at),
            ..*b
        };
        PatchModel {
            quads: quad_blocks(&triangles.map(triangle).collect::<Vec<_>>()),
            bent: hinge_blocks(bent.map(hinge).collect()),
            filter_rows,
            filter_overflow,
            filter: self.filter.clone(),
            ends,
            rest: edges.iter().map(|e| self.rest[e.1]).collect(),
            bend_count,
            bend: bend
                .iter()
                .map(|e| (Slot::new(e.0[1] as usize), e.1))
                .collect(),
            inverse_mass,
            ghosts: set[*owned..].iter().map(|v| owner[*v as usize]).collect(),
            border: Vec::new(),
            within: within.clone(),
            owned: *owned,
            islands: islands.clone(),
            vertices: set.clone(),
            damping: self.damping,
            air: self.air,
        }
    }
}

/// Vertices of a patch, owned ones first, and their local numbers.
struct Numbering {
    set: Vec<u32>,
    owned: usize,
    islands: Vec<usize>,
    /// Number of vertices within each number of rings.
    within: Vec<usize>,
    /// Local number of each vertex of the sheet, `u32::MAX` outside.
    local: Vec<u32>,
}

impl Numbering {
    fn new(own: Partition, rings: usize, around: &[Vec<u32>]) -> Self {
        let (mut set, islands) = (own.order, own.starts);
        let owned = set.len();
        let mut local = vec![u32::MAX; around.len()];
        for (i, v) in set.iter().enumerate() {
            local[*v as usize] = i as u32;
        }
        let (mut from, mut within) = (0, vec![owned]);
        for _ in 0..rings {
            let to = set.len();
            for i in from..to {
                for &w in &around[set[i] as usize] {
                    // A vertex with more neighbours than the capacity loses some.
                    if local[w as usize] == u32::MAX && set.len() < MAX_VERTICES {
                        local[w as usize] = set.len() as u32;
                        set.push(w);
                    }
                }
            }
            from = to;
            within.push(set.len());
        }
        Self {
            set,
            owned,
            islands,
            within,
            local,
        }
    }
}

/// Fills the borders; ghosts name their owner's vertex before and its index in the border after.
fn link_borders(all: &mut [PatchModel]) {
    for q in 0..all.len() as u32 {
        let ghosts = all.iter().flat_map(|f| &f.ghosts);
        let mut border: Vec<u32> = ghosts.filter(|g| g[0] == q).map(|g| g[1]).collect();
        border.sort_unstable();
        border.dedup();
        let ghosts = all.iter_mut().flat_map(|f| &mut f.ghosts);
        for g in ghosts.filter(|g| g[0] == q) {
            g[1] = border.binary_search(&g[1]).unwrap_or(0) as u32;
        }
        all[q as usize].border = border;
    }
}

fn filter_rows(
    ends: &[[u16; 2]],
    weight: &[f32],
    inverse_mass: &[f32],
) -> (Vec<FilterRow>, Vec<FilterOverflow>) {
    let mut rows = vec![FilterRow::default(); inverse_mass.len().div_ceil(2)];
    let mut filled = vec![0usize; inverse_mass.len()];
    let mut overflow = Vec::new();
    for (v, weight) in ends.iter().zip(weight) {
        for (vertex, near) in [(v[0], v[1]), (v[1], v[0])] {
            let (i, near) = (usize::from(vertex), Slot::new(usize::from(near)));
            let by = weight * inverse_mass[i];
            let (row, k) = (&mut rows[i / 2], i % 2);
            row.by[ROW / 2][0][k] += by;
            if filled[i] < ROW {
                let n = filled[i];
                (row.near[n][k], row.by[n / 2][n % 2][k]) = (near, by);
                filled[i] += 1;
            } else {
                overflow.push(FilterOverflow {
                    vertex: Slot::new(i),
                    near,
                    by,
                });
            }
        }
    }
    (rows, overflow)
}
