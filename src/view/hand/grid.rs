//! Grid of cells over the part of the drawn area that one arm can reach.

use crate::area::Area;
use crate::arm::ArmAxis;
use crate::settings::BareArmSettings;
use crate::viewport::Viewport;

/// Cells of a part of the drawn area, each decided as one.
#[derive(Clone, Copy, Debug)]
pub(super) struct ArmGrid {
    /// First column and row, within the area, pixels.
    from: [usize; 2],
    /// Columns and rows of cells.
    pub(super) size: [usize; 2],
    /// Pixels a side of a cell.
    pub(super) step: usize,
    /// Area of a cell, square metres.
    pub(super) cell_area: f32,
}

impl ArmGrid {
    /// The grid around forearm and hand; `None` outside the area.
    pub(super) fn around(
        axis: &ArmAxis,
        viewport: &Viewport,
        area: &Area,
        settings: &BareArmSettings,
    ) -> Option<Self> {
        let (mut lo, mut hi) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        let c = &viewport.camera;
        for (p, reach) in [
            (axis.elbow, settings.forearm_reach),
            (axis.wrist, settings.hand_reach),
        ] {
            if p.z < 2.0 * reach {
                return None;
            }
            let q = c.project(&p);
            let r = [reach * c.fx as f32 / p.z, reach * c.fy as f32 / p.z];
            for k in 0..2 {
                lo[k] = lo[k].min(q[k] - r[k]);
                hi[k] = hi[k].max(q[k] + r[k]);
            }
        }
        let (start, side) = ([area.left, area.top], [area.width, area.height]);
        let clip = |x: f32, k: usize| (x - start[k] as f32).clamp(0.0, side[k] as f32) as usize;
        let pixel = [axis.wrist.z / c.fx as f32, axis.wrist.z / c.fy as f32];
        let step = ((settings.cell / pixel[0]).round() as usize).max(1);
        let from = [0, 1].map(|k| clip(lo[k], k));
        let size = [0, 1].map(|k| (clip(hi[k], k) - from[k]) / step);
        let cell_area = pixel[0] * pixel[1] * (step * step) as f32;
        (size[0] > 0 && size[1] > 0).then_some(Self {
            from,
            size,
            step,
            cell_area,
        })
    }

    /// Number of cells.
    pub(super) fn len(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// Representative pixel of a cell, at its centre.
    #[inline]
    pub(super) fn pixel(&self, cell: usize) -> (usize, usize) {
        let at = |k: usize, i: usize| self.from[k] + i * self.step + self.step / 2;
        (at(0, cell % self.size[0]), at(1, cell / self.size[0]))
    }

    /// All pixels of a cell.
    pub(super) fn cell_pixels(&self, cell: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (x, y) = (
            cell % self.size[0] * self.step + self.from[0],
            cell / self.size[0] * self.step + self.from[1],
        );
        let step = self.step;
        (0..step * step).map(move |k| (x + k % step, y + k / step))
    }

    /// Left, right, upper and lower neighbours of a cell.
    pub(super) fn neighbours(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let across = self.size[0];
        let all = [
            (!cell.is_multiple_of(across)).then(|| cell - 1),
            (cell % across + 1 < across).then(|| cell + 1),
            cell.checked_sub(across),
            (cell + across < self.len()).then(|| cell + across),
        ];
        all.into_iter().flatten()
    }
}
