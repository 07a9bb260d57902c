//! Labelled cells of many images, in the form in which the trainer reads them.

use super::feature::{DepthFeature, DepthWindow, PersonCells, ProbeFrame, WindowBox, ray_axes};
use super::tree::OFFSET_UNIT;
use super::yaw::sector;
use tryon_geometry::math::P3;

/// A cell of known class.
#[derive(Clone, Copy, Debug)]
pub(super) struct LabelledCell {
    pub(super) frame: ProbeFrame,
    pub(super) image: u32,
    pub(super) class: u8,
    /// Sector of the person's yaw.
    pub(super) sector: u8,
    /// Way to the joint, [`OFFSET_UNIT`]s.
    pub(super) offset: [i8; 3],
}

/// Truth of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellLabel {
    /// A cell with a reading.
    pub cell: u32,
    /// Its class.
    pub class: u8,
    /// Joint of the class, camera frame, metres.
    pub joint: P3,
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
    /// Adds a person; `labelled` are some of its cells. `yaw` is the turn about gravity from
    /// facing the camera to the subject's left, radians; `None` for one who lies.
    pub fn add(&mut self, person: &PersonCells<'_>, labelled: &[CellLabel], yaw: Option<f64>) {
        let start = self.depth.len();
        let place = WindowBox::append(person, &mut self.depth);
        let image = self.windows.len() as u32;
        self.windows.push(WindowSlot {
            start,
            columns: place.columns as u16,
            rows: place.rows as u16,
        });
        let inside = labelled
            .iter()
            .filter(|l| person.cells.binary_search(&l.cell).is_ok());
        self.cells.extend(inside.map(|l| {
            let p = person.cloud.centre(l.cell as usize);
            let axes = ray_axes(&p, &person.up);
            LabelledCell {
                frame: place.frame(person, l.cell as usize),
                image,
                class: l.class,
                sector: sector(yaw),
                // The cast saturates.
                offset: axes.map(|a| (a.dot(&(l.joint - p)) / OFFSET_UNIT).round() as i8),
            }
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
