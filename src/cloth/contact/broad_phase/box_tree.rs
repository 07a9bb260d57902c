//! Overlaps of two sets of boxes: a refit tree queried leaf by leaf of the other set's tree.

use super::element_box::ElementBox;
use tryon_geometry::math::P3;
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::Bvh;

/// Leaves that one thread queries in a row.
const CHUNK: usize = 32;

/// Bounding volume hierarchy over the boxes of elements. Its shape is that of the boxes it was built from; any shape
/// finds the same.
#[derive(Clone, Debug, Default)]
pub(super) struct BoxTree {
    boxes: Vec<ElementBox>,
    /// Low and high corner of each box.
    corners: Vec<P3>,
    tree: Bvh,
}

impl BoxTree {
    /// Takes over new boxes: refits, or builds anew where their number is another.
    pub(super) fn update(
        &mut self,
        par: Par,
        boxes: usize,
        of: impl Fn(usize) -> ElementBox + Sync,
    ) {
        par::map_into(par, boxes, 1024, &mut self.boxes, of);
        self.corners.clear();
        let corners = self.boxes.iter().flat_map(|b| [b.low, b.high]);
        self.corners.extend(corners.map(P3::from));
        if self.tree.faces().len() == boxes {
            self.tree.refit(&self.corners);
        } else {
            let faces: Vec<_> = (0..boxes as u32)
                .map(|k| [2 * k, 2 * k + 1, 2 * k + 1])
                .collect();
            self.tree = Bvh::new(&faces, &self.corners);
        }
    }

    /// Pairs (own box, box of `other`) that overlap and that `keep` accepts, ascending.
    pub(super) fn join(
        &self,
        par: Par,
        other: &Self,
        keep: impl Fn(u32, u32) -> bool + Sync,
    ) -> Vec<[u32; 2]> {
        self.join_leaves(par, other, |_, here, there| {
            keep(here, there).then_some([here, there])
        })
    }

    /// Pairs of own boxes that overlap and that `keep` accepts, each once, the smaller first, ascending.
    pub(super) fn self_join(
        &self,
        par: Par,
        keep: impl Fn(u32, u32) -> bool + Sync,
    ) -> Vec<[u32; 2]> {
        let own = |leaf: usize, item: u32| self.tree.leaf(leaf).any(|i| i == item);
        self.join_leaves(par, self, |leaf, here, there| {
            // Pairs within a leaf are met in both orders, those of two leaves from the first of them.
            let is_new = here < there || (here != there && !own(leaf, there));
            let pair = [here.min(there), here.max(there)];
            (is_new && keep(pair[0], pair[1])).then_some(pair)
        })
    }

    /// Pairs that `pair` makes of (own leaf, own box, box of `other`), sorted; of leaves after the own one if `other`
    /// is this tree.
    fn join_leaves(
        &self,
        par: Par,
        other: &Self,
        pair: impl Fn(usize, u32, u32) -> Option<[u32; 2]> + Sync,
    ) -> Vec<[u32; 2]> {
        let is_self = std::ptr::eq(self, other);
        let mut chunks: Vec<Vec<[u32; 2]>> = Vec::new();
        let leaves = self.tree.leaf_count();
        par::map_into(par, leaves.div_ceil(CHUNK), 1, &mut chunks, |chunk| {
            let (mut found, mut items, mut group) = (Vec::new(), Vec::new(), Vec::new());
            for leaf in chunk * CHUNK..((chunk + 1) * CHUNK).min(leaves) {
                items.clear();
                items.extend(self.tree.leaf(leaf));
                group.clear();
                let own = |item: &u32| &self.boxes[*item as usize];
                group.extend(items.iter().map(own).map(|b| [b.low, b.high]));
                let first = if is_self { leaf } else { 0 };
                other.tree.overlapping_group(&group, first, |k, there| {
                    let here = items[k];
                    // The tree's boxes are a rounding wider.
                    if own(&here).overlaps(&other.boxes[there as usize]) {
                        found.extend(pair(leaf, here, there));
                    }
                });
            }
            found
        });
        sort_rows(self.boxes.len(), &chunks)
    }
}

/// Sorts pairs by counting their first numbers, which are less than `rows`.
fn sort_rows(rows: usize, chunks: &[Vec<[u32; 2]>]) -> Vec<[u32; 2]> {
    let mut next = vec![0usize; rows + 1];
    let all = || chunks.iter().flatten();
    all().for_each(|[row, _]| next[*row as usize + 1] += 1);
    for row in 0..rows {
        next[row + 1] += next[row];
    }
    let mut sorted = vec![[0; 2]; next[rows]];
    for pair in all() {
        let slot = &mut next[pair[0] as usize];
        sorted[*slot] = *pair;
        *slot += 1;
    }
    sorted
        .chunk_by_mut(|a, b| a[0] == b[0])
        .for_each(|row| row.sort_unstable());
    sorted
}
