//! Labelled cells of many images, in the form in which the trainer reads them.

use super::feature::{DepthFeature, DepthWindow, ProbeFrame, WindowBox};
use crate::math::V3;
use crate::spatial::OrganisedCloud;

/// A cell of known class.
#[derive(Clone, Copy, Debug)]
pub(super) struct LabelledCell {
    pub(super) frame: ProbeFrame,
    pub(super) image: u32,
    pub(super) class: u8,
}

/// Depths of one image within [`TrainingSet::depth`].
#[derive(Clone, Copy, Debug)]
struct WindowSlot {
    start: usize,
    columns: u16,
    rows: u16,
}

/// Labelled cells and the depths of their images. About 8 kB and 24 B a cell for each image.
#[derive(Clone, Debug, Default)]
pub struct TrainingSet {
    depth: Vec<u16>,
    windows: Vec<WindowSlot>,
    pub(super) cells: Vec<LabelledCell>,
}

impl TrainingSet {
    /// Adds a person's cells; `labelled` are pairs of a cell with a reading and its class, `up` is the unit direction
    /// against gravity, camera frame.
    pub fn add(&mut self, cloud: &OrganisedCloud, cells: &[u32], up: &V3, labelled: &[(u32, u8)]) {
        let start = self.depth.len();
        let place = WindowBox::append(cloud, cells, &mut self.depth);
        let image = self.windows.len() as u32;
        self.windows.push(WindowSlot {
            start,
            columns: place.columns as u16,
            rows: place.rows as u16,
        });
        let inside = labelled.iter().filter(|l| cells.binary_search(&l.0).is_ok());
        self.cells.extend(inside.map(|&(cell, class)| LabelledCell {
            frame: place.frame(cloud, cell as usize, up),
            image,
            class,
        }));
    }
    /// Number of labelled cells.
    pub fn len(&self) -> usize {
        self.cells.len()
    }
    /// Has no labelled cells.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }
    /// Depths of an image.
    pub(super) fn window(&self, image: u32) -> DepthWindow<'_> {
        let w = self.windows[image as usize];
        let cells = usize::from(w.columns) * usize::from(w.rows);
        DepthWindow {
            columns: w.columns,
            rows: w.rows,
            depth: &self.depth[w.start..w.start + cells],
        }
    }
    /// Response of a feature at a labelled cell.
    pub(super) fn response(&self, feature: DepthFeature, cell: &LabelledCell) -> i16 {
        self.window(cell.image).response(feature, &cell.frame)
    }
}
