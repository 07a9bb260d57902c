//! Connected components of the cells that are neither floor nor background.

use super::refusals::CandidateBox;
use crate::settings::PersonSettings;
use nalgebra::Vector3;
use tryon_geometry::math::{P3, principal_axes};
use tryon_geometry::spatial::{Label, OrganisedCloud};

/// Number of cells on a rim of the image above which a component extends beyond it.
pub(super) const RIM_CELLS: usize = 3;
/// Largest distance in the image between two parts of one body, cells.
const PART_GAP: i32 = 2;

/// One connected component. Its box has the axes right, up and depth.
#[derive(Clone, Debug)]
pub(super) struct Component {
    pub(super) id: u32,
    pub(super) cells: usize,
    /// Visible area as if it faced the camera, m².
    pub(super) area: f32,
    pub(super) lo: P3,
    pub(super) hi: P3,
    /// Mean of its points, camera frame, metres.
    pub(super) centre: P3,
    /// Cells on the left or right rim of the image.
    pub(super) side_cells: usize,
    /// Image rows from the first to the last cell.
    pub(super) rows: usize,
    /// Cells on the upper rim of the image.
    pub(super) top_cells: usize,
}

impl Component {
    fn new(id: u32) -> Self {
        Self {
            id,
            cells: 0,
            area: 0.0,
            lo: P3::new(f32::MAX, f32::MAX, f32::MAX),
            hi: P3::new(f32::MIN, f32::MIN, f32::MIN),
            centre: P3::origin(),
            side_cells: 0,
            rows: 0,
            top_cells: 0,
        }
    }

    /// Its place and size.
    pub(super) fn candidate(&self) -> CandidateBox {
        CandidateBox {
            centre: self.centre,
            lo: self.lo,
            hi: self.hi,
        }
    }
}

/// Components of a cloud and the component of every cell. Scratch.
#[derive(Clone, Debug, Default)]
pub(super) struct ComponentMap {
    pub(super) list: Vec<Component>,
    /// Component number per cell; [`ComponentMap::NONE`] for other cells. Shape `[cells]`.
    pub(super) of_cell: Vec<u32>,
    stack: Vec<u32>,
}

impl ComponentMap {
    /// Number of a cell without a component.
    pub(super) const NONE: u32 = u32::MAX;

    /// Finds the connected components of [`Label::Other`] cells. `up` is the vertical in the camera frame.
    pub(super) fn update(
        &mut self,
        cloud: &OrganisedCloud,
        up: &Vector3<f32>,
        settings: &PersonSettings,
    ) {
        let (columns, rows) = cloud.size();
        self.of_cell.clear();
        self.of_cell.resize(columns * rows, Self::NONE);
        self.list.clear();
        for seed in 0..columns * rows {
            if cloud.labels[seed] == Label::Other && self.of_cell[seed] == Self::NONE {
                let component = self.flood(cloud, up, seed, settings);
                self.list.push(component);
            }
        }
    }

    /// Flood fill from a seed cell.
    fn flood(
        &mut self,
        cloud: &OrganisedCloud,
        up: &Vector3<f32>,
        seed: usize,
        settings: &PersonSettings,
    ) -> Component {
        let (columns, rows) = cloud.size();
        let focal = cloud.focal();
        let right = up.cross(&Vector3::z());
        let mut c = Component::new(self.list.len() as u32);
        let (mut first_row, mut last_row) = (rows, 0);
        self.of_cell[seed] = c.id;
        self.stack.push(seed as u32);
        while let Some(i) = self.stack.pop() {
            let i = i as usize;
            let (u, v) = (i % columns, i / columns);
            let (p, z) = (cloud.centre(i), cloud.depth[i]);
            let q = P3::new(right.dot(&p.coords), up.dot(&p.coords), z);
            (c.lo, c.hi) = (c.lo.inf(&q), c.hi.sup(&q));
            c.centre += p.coords;
            c.cells += 1;
            c.area += z * z / (focal[0] * focal[1]);
            c.side_cells += usize::from(u == 0 || u + 1 == columns);
            c.top_cells += usize::from(v == 0);
            (first_row, last_row) = (first_row.min(v), last_row.max(v));
            let link = settings.link + settings.link_slope * z;
            for (du, dv) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
                let Some(k) = cloud.cell(u as i32 + du, v as i32 + dv) else {
                    continue;
                };
                let open = cloud.labels[k] == Label::Other && self.of_cell[k] == Self::NONE;
                if open && (cloud.depth[k] - z).abs() < link {
                    self.of_cell[k] = c.id;
                    self.stack.push(k as u32);
                }
            }
        }
        c.centre = P3::from(c.centre.coords / c.cells as f32);
        c.rows = last_row + 1 - first_row;
        c
    }

    /// Component of a cell that is in the set `members` (shape `[components]`).
    pub(super) fn member(&self, cell: usize, members: &[bool]) -> Option<&Component> {
        let id = self.of_cell[cell];
        (id != Self::NONE && members[id as usize]).then(|| &self.list[id as usize])
    }

    /// True if a cell of the set `members` lies near this cell in the image.
    pub(super) fn is_near(&self, cloud: &OrganisedCloud, members: &[bool], cell: usize) -> bool {
        let columns = cloud.size().0;
        let (u, v) = ((cell % columns) as i32, (cell / columns) as i32);
        (-PART_GAP..=PART_GAP).any(|dv| {
            (-PART_GAP..=PART_GAP).any(|du| {
                cloud
                    .cell(u + du, v + dv)
                    .is_some_and(|k| self.member(k, members).is_some())
            })
        })
    }

    /// Standard deviation of a component's points from their own plane, metres.
    pub(super) fn thickness(&self, c: &Component, cloud: &OrganisedCloud) -> Option<f64> {
        let own = self.of_cell.iter().enumerate();
        let own = own.filter(|(_, id)| **id == c.id);
        let points: Vec<P3> = own.map(|(i, _)| cloud.centre(i)).collect();
        principal_axes(&points).map(|(_, _, variance)| variance[2].sqrt())
    }
}
