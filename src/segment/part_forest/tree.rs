//! Decision tree over depth features; leaves hold class shares.

use super::feature::{DepthFeature, DepthWindow, ProbeFrame};

/// Classes of a leaf that are kept; 98 % of the weight of a leaf at depth 16.
pub(super) const KEPT: usize = 4;
/// Marks a child that is a leaf.
pub(super) const LEAF: u32 = 1 << 23;

/// Inner node: responses below the threshold (millimetres) go to the first child.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SplitNode {
    pub(super) feature: DepthFeature,
    pub(super) threshold: i16,
    /// Index of a node, or of a leaf with [`LEAF`].
    pub(super) children: [u32; 2],
}

/// Most frequent classes of a leaf with their shares in 255ths; unused entries have share 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct LeafShares(pub(super) [[u8; 2]; KEPT]);

impl LeafShares {
    /// The largest counts of a histogram over classes.
    pub(super) fn of(histogram: &[u32]) -> Self {
        let mut order: Vec<usize> = (0..histogram.len()).filter(|c| histogram[*c] > 0).collect();
        order.sort_by(|a, b| histogram[*b].cmp(&histogram[*a]).then(a.cmp(b)));
        order.truncate(KEPT);
        let sum: u32 = histogram.iter().sum::<u32>().max(1);
        let mut out = Self::default();
        for (slot, c) in out.0.iter_mut().zip(order) {
            let share = (u64::from(histogram[c]) * 255 + u64::from(sum) / 2) / u64::from(sum);
            *slot = [c as u8, share as u8];
        }
        out
    }
}

/// One tree; node 0 is the root. A tree without nodes has one leaf.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct DecisionTree {
    pub(super) nodes: Vec<SplitNode>,
    pub(super) leaves: Vec<LeafShares>,
}

impl DecisionTree {
    /// Leaf of a cell.
    #[inline]
    pub(super) fn leaf(&self, window: &DepthWindow<'_>, frame: &ProbeFrame) -> LeafShares {
        let mut at = if self.nodes.is_empty() { LEAF } else { 0 };
        while at & LEAF == 0 {
            let node = &self.nodes[at as usize];
            let response = window.response(node.feature, frame);
            at = node.children[usize::from(response >= node.threshold)];
        }
        self.leaves[(at & !LEAF) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leaf_keeps_the_largest_shares() {
        let leaf = LeafShares::of(&[0, 10, 60, 5, 20, 5]);
        assert_eq!(leaf.0, [[2, 153], [4, 51], [1, 26], [3, 13]]);
        assert_eq!(LeafShares::of(&[0, 7]).0[0], [1, 255]);
        assert_eq!(LeafShares::of(&[]), LeafShares::default());
    }
}
