//! Decision tree over depth features; leaves hold class shares and a distribution of yaw.

use super::feature::{DepthFeature, DepthWindow, ProbeFrame};
use super::yaw::{NO_YAW, YAW_BINS, bin, is_front};
use crate::settings::ForestSpec;

/// Classes of a leaf that are kept; 98 % of the weight of a leaf at depth 16.
pub(super) const KEPT: usize = 4;
/// Marks a child that is a leaf.
pub(super) const LEAF: u32 = 1 << 23;
/// Unit of the ways to joints, metres; the longest way is 127 of them.
pub(super) const OFFSET_UNIT: f32 = 0.005;

/// Inner node: responses below the threshold (millimetres) go to the first child.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SplitNode {
    pub(super) feature: DepthFeature,
    pub(super) threshold: i16,
    /// Index of a node, or of a leaf with [`LEAF`].
    pub(super) children: [u32; 2],
}

/// A class of a leaf; shares in 255ths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct ClassShare {
    pub(super) class: u8,
    /// Share of the leaf's cells; 0 for an unused entry.
    pub(super) share: u8,
    /// Share of these cells whose person is seen from the front.
    pub(super) front: u8,
    /// Mean way from these cells to the joint of the class: right, down, away ([`ray_axes`]), [`OFFSET_UNIT`]s.
    ///
    /// [`ray_axes`]: super::feature::ray_axes
    pub(super) offset: [i8; 3],
}

/// Distributions of a leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct LeafShares {
    /// Most frequent classes, descending.
    pub(super) classes: [ClassShare; KEPT],
    /// Bins of yaw, 255ths, at least 1 each in a leaf of the training.
    pub(super) yaw: [u8; YAW_BINS],
}

/// Counts of a leaf.
#[derive(Clone, Debug)]
pub(super) struct LeafCounts {
    /// Cells of each class whose person is seen from the front, from behind, and lies, shape `[classes]`.
    classes: Vec<[u32; 3]>,
    /// Sums of the ways to the joint, shape `[classes]`.
    offsets: Vec<[i64; 3]>,
    yaw: [u32; YAW_BINS],
}

impl LeafCounts {
    pub(super) fn new(classes: usize) -> Self {
        Self {
            classes: vec![[0; 3]; classes],
            offsets: vec![[0; 3]; classes],
            yaw: [0; YAW_BINS],
        }
    }
    /// Adds a cell of a class whose person has that sector of yaw, and its way to the joint.
    pub(super) fn add(&mut self, class: u8, sector: u8, offset: [i8; 3]) {
        let seen = match sector {
            NO_YAW => 2,
            s => usize::from(!is_front(s)),
        };
        self.classes[usize::from(class)][seen] += 1;
        let sums = self.offsets[usize::from(class)].iter_mut();
        sums.zip(offset).for_each(|(s, o)| *s += i64::from(o));
        if sector != NO_YAW {
            self.yaw[bin(sector)] += 1;
        }
    }
    /// The leaf.
    pub(super) fn shares(&self, spec: &ForestSpec) -> LeafShares {
        let count = |c: usize| self.classes[c].iter().sum::<u32>();
        let mut order: Vec<usize> = (0..self.classes.len()).filter(|c| count(*c) > 0).collect();
        order.sort_by(|a, b| count(*b).cmp(&count(*a)).then(a.cmp(b)));
        let sum = u64::from(order.iter().map(|c| count(*c)).sum::<u32>().max(1));
        let mut out = LeafShares::default();
        for (slot, c) in out.classes.iter_mut().zip(order) {
            let [front, back, _] = self.classes[c].map(|n| n as f32);
            let front = (front + spec.front_prior) / (front + back + 2.0 * spec.front_prior);
            *slot = ClassShare {
                class: c as u8,
                share: ((u64::from(count(c)) * 255 + sum / 2) / sum) as u8,
                front: (255.0 * front + 0.5) as u8,
                offset: self.offsets[c].map(|s| (s as f32 / count(c) as f32).round() as i8),
            };
        }
        let total = self.yaw.iter().sum::<u32>() as f32 + spec.yaw_prior * YAW_BINS as f32;
        let share = |n: u32| (255.0 * (n as f32 + spec.yaw_prior) / total + 0.5).max(1.0) as u8;
        out.yaw = self.yaw.map(share);
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
    pub(super) fn leaf(&self, window: &DepthWindow<'_>, frame: &ProbeFrame) -> u32 {
        let mut at = if self.nodes.is_empty() { LEAF } else { 0 };
        while at & LEAF == 0 {
            let node = &self.nodes[at as usize];
            let response = window.response(node.feature, frame);
            at = node.children[usize::from(response >= node.threshold)];
        }
        at & !LEAF
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leaf_keeps_the_largest_shares() {
        let mut counts = LeafCounts::new(6);
        for (class, n) in [(1, 10), (2, 60), (3, 5), (4, 20), (5, 5)] {
            (0..n).for_each(|i| {
                counts.add(
                    class,
                    if i % 4 == 0 { 8 } else { 0 },
                    [i as i8 % 2, -3, 100],
                )
            });
        }
        let leaf = counts.shares(&ForestSpec::default());
        let kept = leaf.classes.map(|c| (c.class, c.share));
        assert_eq!(kept, [(2, 153), (4, 51), (1, 26), (3, 13)]);
        assert_eq!(leaf.classes[0].front, 190, "45.5 of 61");
        assert!(
            leaf.yaw[0] > 150 && leaf.yaw[4] > 50 && leaf.yaw[2] == 1,
            "{leaf:?}"
        );
        assert_eq!(
            leaf.classes[0].offset,
            [1, -3, 100],
            "a half away from zero"
        );
        let nothing = LeafCounts::new(3).shares(&ForestSpec::default());
        assert_eq!(nothing.classes, [ClassShare::default(); KEPT]);
        assert_eq!(nothing.yaw, [32; 8]);
    }
}
