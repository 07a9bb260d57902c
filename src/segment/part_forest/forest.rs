//! The forest: mean of its trees' leaf distributions per cell (section 3.2 of Shotton et al. 2011).

use super::bytes::{self, PartForestError};
use super::feature::{DepthWindow, WindowBox};
use super::modes::{JointProposal, ModeScratch, find_modes};
use super::tree::DecisionTree;
use crate::math::V3;
use crate::spatial::OrganisedCloud;

/// Classifier of the cells of a person into body parts.
#[derive(Clone, Debug, PartialEq)]
pub struct PartForest {
    /// Distance from the surface to the joint of each class along the viewing ray, metres, shape `[classes]`.
    pub(super) push: Vec<f32>,
    pub(super) trees: Vec<DecisionTree>,
}

/// Class distribution of each cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClassMap {
    classes: usize,
    shares: Vec<f32>,
}

/// Scratch of the classification; dropping it changes no result.
#[derive(Clone, Debug, Default)]
pub struct PartScratch {
    depth: Vec<u16>,
    /// Result of the last classification.
    pub map: ClassMap,
    modes: ModeScratch,
}

impl ClassMap {
    /// Number of classes.
    pub fn classes(&self) -> usize {
        self.classes
    }
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.shares.len() / self.classes.max(1)
    }
    /// Has no cells.
    pub fn is_empty(&self) -> bool {
        self.shares.is_empty()
    }
    /// Shares of all classes at the `i`-th cell, shape `[classes]`; their sum is 1, or 0 for a cell without reading.
    pub fn shares(&self, i: usize) -> &[f32] {
        &self.shares[i * self.classes..(i + 1) * self.classes]
    }
    /// Class of the largest share at the `i`-th cell, the first of equals; `None` for a cell without reading.
    pub fn best(&self, i: usize) -> Option<u8> {
        let (mut best, mut most) = (None, 0.0);
        for (c, s) in self.shares(i).iter().enumerate() {
            if *s > most {
                (best, most) = (Some(c as u8), *s);
            }
        }
        best
    }
}

impl PartForest {
    /// Reads a forest.
    ///
    /// # Errors
    /// Names the fault in the bytes.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, PartForestError> {
        bytes::decode(bytes)
    }
    /// Bytes of the forest, little-endian, with a version and a checksum.
    pub fn to_bytes(&self) -> Vec<u8> {
        bytes::encode(self)
    }
    /// Number of classes.
    pub fn classes(&self) -> usize {
        self.push.len()
    }
    /// Number of trees, and of split nodes in all of them.
    pub fn size(&self) -> (usize, usize) {
        (
            self.trees.len(),
            self.trees.iter().map(|t| t.nodes.len()).sum(),
        )
    }

    /// Class distribution of each of a person's cells; `up` is the unit direction against gravity, camera frame. Features
    /// read the depths of these cells only.
    pub fn classify<'a>(
        &self,
        cloud: &OrganisedCloud,
        cells: &[u32],
        up: &V3,
        scratch: &'a mut PartScratch,
    ) -> &'a ClassMap {
        scratch.depth.clear();
        let place = WindowBox::append(cloud, cells, &mut scratch.depth);
        let window = DepthWindow {
            columns: place.columns as u16,
            rows: place.rows as u16,
            depth: &scratch.depth,
        };
        let map = &mut scratch.map;
        map.classes = self.classes();
        map.shares.clear();
        map.shares.resize(cells.len() * map.classes, 0.0);
        for (&cell, shares) in cells
            .iter()
            .zip(map.shares.chunks_exact_mut(map.classes.max(1)))
        {
            let cell = cell as usize;
            if cloud.depth[cell] <= 0.0 {
                continue;
            }
            let frame = place.frame(cloud, cell, up);
            let mut sum = 0.0;
            for tree in &self.trees {
                for [class, share] in tree.leaf(&window, &frame).0 {
                    shares[usize::from(class)] += f32::from(share);
                    sum += f32::from(share);
                }
            }
            let scale = 1.0 / f32::max(sum, 1.0);
            shares.iter_mut().for_each(|s| *s *= scale);
        }
        map
    }

    /// Proposed joints of a person's cells: at most two modes a class, the heavier first, classes ascending. The class
    /// distributions stay in `scratch.map`.
    pub fn propose(
        &self,
        cloud: &OrganisedCloud,
        cells: &[u32],
        up: &V3,
        scratch: &mut PartScratch,
    ) -> Vec<JointProposal> {
        self.classify(cloud, cells, up, scratch);
        let (map, modes) = (&scratch.map, &mut scratch.modes);
        modes.gather(cloud, cells, map, &self.push);
        find_modes(modes)
    }
}
