//! Islands of a garment: compact groups of vertices that sleep and wake as one.

use crate::contact::SurfaceModel;
use crate::live::model::partition::{Partition, cut};
use crate::live::solver::explicit::PatchModel;

/// Most vertices of an island: a palm of cloth with edges of 12 mm. Larger ones sleep less, smaller ones cost more tests.
pub(in crate::live) const ISLAND: usize = 96;
/// Vertices of a cluster of skin, which is tested as one.
const SKIN_CLUSTER: usize = 64;

/// Immutable islands of one garment.
#[derive(Debug, Default)]
pub(in crate::live) struct IslandModel {
    /// Vertices of each island.
    pub(super) members: Vec<Vec<u32>>,
    /// Island of each vertex.
    pub(super) of: Vec<u32>,
    /// Islands that share an edge with each.
    pub(super) adjacent: Vec<Vec<u32>>,
    /// Edges that leave each island, its own vertex first.
    pub(super) boundary_edges: Vec<Vec<[u32; 2]>>,
    /// First island of each patch.
    pub(super) first: Vec<usize>,
    /// Distance within which other moving cloth wakes an island, metres.
    pub(super) wake_distance: f32,
}

impl IslandModel {
    /// Islands of the patches of a garment with `edges` (vertices, rest length).
    pub(in crate::live) fn new(
        patches: &[PatchModel],
        vertices: usize,
        edges: &[([u32; 2], f64)],
        wake_distance: f32,
    ) -> Self {
        let (mut members, mut first) = (Vec::new(), Vec::new());
        for f in patches {
            first.push(members.len());
            let islands = f.islands.windows(2);
            members.extend(islands.map(|r| f.vertices[r[0]..r[1]].to_vec()));
        }
        let mut of = vec![0u32; vertices];
        for (r, m) in (0u32..).zip(&members) {
            m.iter().for_each(|v| of[*v as usize] = r);
        }
        let mut adjacent = vec![Vec::new(); members.len()];
        let mut boundary_edges = vec![Vec::new(); members.len()];
        for ([a, b], _) in edges {
            for [a, b] in [[*a, *b], [*b, *a]] {
                let [p, q] = [of[a as usize], of[b as usize]];
                if p != q {
                    adjacent[p as usize].push(q);
                    boundary_edges[p as usize].push([a, b]);
                }
            }
        }
        for a in &mut adjacent {
            a.sort_unstable();
            a.dedup();
        }
        Self {
            members,
            of,
            adjacent,
            boundary_edges,
            first,
            wake_distance,
        }
    }
}

/// Body vertices in compact clusters.
pub(in crate::live) fn skin_clusters(surface: &SurfaceModel) -> Partition {
    let n = surface.vertices();
    let all = (0..n as u32).collect();
    cut(n, |v| surface.neighbours(v), all, SKIN_CLUSTER, 1)
}
