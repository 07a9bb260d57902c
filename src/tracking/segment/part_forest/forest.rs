//! The forest: mean of its trees' leaf distributions per cell (section 3.2 of Shotton et al. 2011).

use super::bytes::{self, PartForestError};
use super::class_map::ClassMap;
use super::feature::{DepthWindow, PersonCells, WindowBox};
use super::modes::{JointProposal, ModeScratch, find_modes};
use super::tree::{DecisionTree, LEAF, LeafShares};
use super::yaw::{YAW_BINS, YawBelief};
use crate::settings::PartVoteSettings;
use std::sync::{Arc, OnceLock};

/// Bytes of the embedded forest, from `tryon-bench train-parts`.
static EMBEDDED: &[u8] = include_bytes!("parts.bin");

/// Classifier of the cells of a person into body parts.
#[derive(Clone, Debug, PartialEq)]
pub struct PartForest {
    pub(super) classes: usize,
    pub(super) trees: Vec<DecisionTree>,
    pub(super) settings: PartVoteSettings,
}

/// Scratch of the classification; dropping it changes no result.
#[derive(Clone, Debug, Default)]
pub struct PartScratch {
    depth: Vec<u16>,
    /// Leaves of each cell, shape `[cells × trees]`; [`LEAF`] for a cell without reading.
    leaves: Vec<u32>,
    /// Class distributions of the last classification.
    pub map: ClassMap,
    /// Yaw of the last classification.
    pub yaw: YawBelief,
    modes: ModeScratch,
}

impl PartForest {
    /// The forest of the embedded body, read on first use and shared; its classes are those of `tracking::part_classes`.
    ///
    /// # Panics
    /// Never in a build that passes its tests: the bytes are part of the build.
    pub fn embedded() -> Arc<Self> {
        static FOREST: OnceLock<Arc<PartForest>> = OnceLock::new();
        #[expect(
            clippy::expect_used,
            reason = "the bytes are part of the build; a test reads them"
        )]
        FOREST
            .get_or_init(|| Arc::new(Self::from_bytes(EMBEDDED).expect("the embedded forest")))
            .clone()
    }
    /// Reads a forest.
    ///
    /// # Errors
    /// Names the fault in the bytes.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, PartForestError> {
        let (classes, trees) = bytes::decode(bytes)?;
        Ok(Self {
            classes,
            trees,
            settings: PartVoteSettings::default(),
        })
    }
    /// Bytes of the forest, little-endian, with a version and a checksum.
    pub fn to_bytes(&self) -> Vec<u8> {
        bytes::encode(self.classes, &self.trees)
    }
    /// Number of classes.
    pub fn classes(&self) -> usize {
        self.classes
    }
    /// Number of trees, and of split nodes in all of them.
    pub fn size(&self) -> (usize, usize) {
        let splits = self.trees.iter().map(|t| t.nodes.len()).sum();
        (self.trees.len(), splits)
    }

    /// Yaw of the person and class distribution of each cell, both in `scratch`. The belief in front and back weights the
    /// classes: left and right change places with the facing.
    pub fn classify<'a>(
        &self,
        person: &PersonCells<'_>,
        scratch: &'a mut PartScratch,
    ) -> &'a ClassMap {
        self.descend(person, scratch);
        self.vote_yaw(scratch);
        let prior = scratch.yaw.front_and_back();
        self.weigh(prior, scratch);
        &scratch.map
    }

    /// Proposed joints of a person's cells: at most two modes a class, the heavier first, classes ascending. Yaw and class
    /// distributions stay in `scratch`.
    pub fn propose(
        &self,
        person: &PersonCells<'_>,
        scratch: &mut PartScratch,
    ) -> Vec<JointProposal> {
        self.classify(person, scratch);
        self.modes(person, scratch)
    }

    /// Proposed joints for given probabilities of front and back in place of the forest's own. `scratch.yaw` still is
    /// the forest's own belief.
    pub fn propose_for(
        &self,
        person: &PersonCells<'_>,
        front_and_back: [f32; 2],
        scratch: &mut PartScratch,
    ) -> Vec<JointProposal> {
        self.descend(person, scratch);
        self.vote_yaw(scratch);
        self.weigh(front_and_back, scratch);
        self.modes(person, scratch)
    }

    /// Finds the leaves of all cells.
    fn descend(&self, person: &PersonCells<'_>, scratch: &mut PartScratch) {
        scratch.depth.clear();
        let place = WindowBox::append(person, &mut scratch.depth);
        let window = DepthWindow {
            columns: place.columns as u16,
            rows: place.rows as u16,
            depth: &scratch.depth,
        };
        scratch.leaves.clear();
        for &cell in person.cells {
            if person.cloud.depth[cell as usize] <= 0.0 {
                scratch.leaves.extend(self.trees.iter().map(|_| LEAF));
                continue;
            }
            let frame = place.frame(person, cell as usize);
            let leaves = self.trees.iter().map(|t| t.leaf(&window, &frame));
            scratch.leaves.extend(leaves);
        }
    }

    /// Leaves of one cell; none for a cell without reading.
    fn leaves_of<'a>(&'a self, leaves: &'a [u32]) -> impl Iterator<Item = &'a LeafShares> {
        let of = |(t, l): (&'a DecisionTree, &u32)| t.leaves.get(*l as usize);
        self.trees.iter().zip(leaves).filter_map(of)
    }

    /// Multiplies the yaw distributions of all cells.
    fn vote_yaw(&self, scratch: &mut PartScratch) {
        let (mut logs, mut cells) = ([0.0; YAW_BINS], 0);
        for leaves in scratch.leaves.chunks_exact(self.trees.len().max(1)) {
            let mut sums = [0u16; YAW_BINS];
            for leaf in self.leaves_of(leaves) {
                for (s, y) in sums.iter_mut().zip(leaf.yaw) {
                    *s += u16::from(y);
                }
            }
            let total = f32::from(sums.iter().sum::<u16>());
            if total > 0.0 {
                cells += 1;
                for (l, s) in logs.iter_mut().zip(sums) {
                    *l += (f32::from(s.max(1)) / total).ln();
                }
            }
        }
        scratch.yaw = YawBelief::of_votes(&logs, cells, self.settings.independent_votes);
    }

    /// Class distributions for probabilities of front and back.
    fn weigh(&self, [front, back]: [f32; 2], scratch: &mut PartScratch) {
        let least = self.settings.least_prior;
        let (front, back) = (front.max(least), back.max(least));
        let weight: [f32; 256] = std::array::from_fn(|f| {
            let f = f as f32 / 255.0;
            front * f + back * (1.0 - f)
        });
        let map = &mut scratch.map;
        map.classes = self.classes();
        map.shares.clear();
        let trees = self.trees.len().max(1);
        map.shares
            .resize(scratch.leaves.len() / trees * map.classes, 0.0);
        map.offsets.clear();
        map.offsets.resize(map.shares.len(), [0.0; 3]);
        let width = map.classes.max(1);
        let offsets = map.offsets.chunks_exact_mut(width);
        let cells = map.shares.chunks_exact_mut(width).zip(offsets);
        for ((shares, offsets), leaves) in cells.zip(scratch.leaves.chunks_exact(trees)) {
            let mut sum = 0.0;
            for leaf in self.leaves_of(leaves) {
                for c in &leaf.classes {
                    let w = f32::from(c.share) * weight[usize::from(c.front)];
                    shares[usize::from(c.class)] += w;
                    let sums = offsets[usize::from(c.class)].iter_mut();
                    sums.zip(c.offset).for_each(|(s, o)| *s += w * f32::from(o));
                    sum += w;
                }
            }
            let scale = 1.0 / f32::max(sum, f32::MIN_POSITIVE);
            shares.iter_mut().for_each(|s| *s *= scale);
            offsets
                .as_flattened_mut()
                .iter_mut()
                .for_each(|o| *o *= scale);
        }
    }

    fn modes(&self, person: &PersonCells<'_>, scratch: &mut PartScratch) -> Vec<JointProposal> {
        let (map, modes) = (&scratch.map, &mut scratch.modes);
        modes.gather(person, map, self.settings.least_share);
        find_modes(modes, &self.settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedded_forest_is_whole_and_small() {
        let forest = PartForest::from_bytes(EMBEDDED).expect("the embedded bytes");
        assert_eq!(forest, *PartForest::embedded());
        assert!(
            forest.size().0 >= 1 && EMBEDDED.len() <= 4 << 20,
            "{}",
            EMBEDDED.len()
        );
    }
}
