//! Footprints of depth pixels in the colour view: a box of colour pixels and a plane of depth each.

use super::projection::{BLOCK, Lanes, ProjectedRow};

/// Neighbours whose depth differs by more than this share are on another surface: 40 mm at 2 m. Larger bridges limbs and
/// trunk, smaller cuts surfaces that are seen under less than 10° into single pixels.
const EDGE_SHARE: f32 = 0.02;
/// Added to each side of a box [pixels], so that the boxes of a sheared or curved grid leave no holes.
const OVERLAP: f32 = 0.0625;
/// Half of a box's side at most [pixels]: bounds the time of a frame for any calibration.
const MAX_HALF: f32 = 8.0;
/// Smallest area of a depth pixel in the colour view that has a plane of depth [pixels²].
const MIN_AREA: f32 = 0.05;
/// Adding it leaves the nearest whole number (of −2²² to 2²²) in the last bits of an f32.
const ROUND: f32 = 12_582_912.0;
/// Value of colour pixels without reading during the z-test.
pub(super) const EMPTY: u16 = u16::MAX;

/// A depth pixel in the colour view: column, row [pixels] and depth [mm].
type Point = [f32; 3];

/// Constants of all footprints of a pair of cameras.
#[derive(Clone, Copy, Debug)]
pub(super) struct FootprintModel {
    /// Columns and rows from a depth pixel to its right and to its lower neighbour, for pixels without one [pixels].
    pub(super) steps: [[f32; 2]; 2],
    /// Columns and rows of the colour image, two at least.
    pub(super) size: [f32; 2],
}

/// Three rows of depth pixels, those of the middle one to be drawn.
pub(super) struct RowWindow<'a> {
    pub(super) above: &'a ProjectedRow,
    pub(super) middle: &'a ProjectedRow,
    pub(super) below: &'a ProjectedRow,
}

/// A depth pixel and its neighbours.
#[derive(Clone, Copy)]
struct Neighbourhood {
    center: Point,
    left: Point,
    right: Point,
    above: Point,
    below: Point,
}

/// Box of colour pixels around the parallelogram between a depth pixel and its neighbours, and its depth.
#[derive(Clone, Copy, Debug)]
pub(super) struct Footprint {
    /// First column and row.
    pub(super) first: [f32; 2],
    /// Behind the last column and row.
    pub(super) end: [f32; 2],
    center: Point,
    /// Change of depth by column and row [mm].
    slope: [f32; 2],
    /// Largest difference from the depth of the centre [mm].
    range: f32,
}

/// Footprints of a block of pixels, as blocks of 2 × 2 colour pixels.
pub(super) struct FootprintBlock {
    /// Position of the upper left colour pixel in the image.
    pub(super) offset: [u32; BLOCK],
    /// Depth of the four colour pixels, row-major; [`EMPTY`] outside the footprint.
    pub(super) depth: [[u16; BLOCK]; 4],
    /// True if the footprint is larger.
    pub(super) is_large: [bool; BLOCK],
}

impl FootprintModel {
    /// Footprint of depth pixel `i` of the middle row.
    pub(super) fn footprint(&self, rows: &RowWindow<'_>, i: usize) -> Footprint {
        let at = |row: &ProjectedRow, i: usize| row.0.each_ref().map(|values| values[i]);
        self.of(Neighbourhood {
            center: at(rows.middle, i + 1),
            left: at(rows.middle, i),
            right: at(rows.middle, i + 2),
            above: at(rows.above, i + 1),
            below: at(rows.below, i + 1),
        })
    }

    /// Footprints of the depth pixels of the middle row from pixel `first` on.
    #[inline(always)]
    pub(super) fn block(&self, rows: &RowWindow<'_>, first: usize) -> FootprintBlock {
        let [center, left, right] = [1, 0, 2].map(|shift| lanes(rows.middle, first + shift));
        let [above, below] = [rows.above, rows.below].map(|row| lanes(row, first + 1));
        let mut block = FootprintBlock {
            offset: [0; BLOCK],
            depth: [[EMPTY; BLOCK]; 4],
            is_large: [false; BLOCK],
        };
        for k in 0..BLOCK {
            let at = |lanes: &[Lanes; 3]| [lanes[0][k], lanes[1][k], lanes[2][k]];
            let footprint = self.of(Neighbourhood {
                center: at(&center),
                left: at(&left),
                right: at(&right),
                above: at(&above),
                below: at(&below),
            });
            let corner = self.corner(&footprint);
            let depth = footprint.depths(corner);
            block.offset[k] = whole(corner[1]) * self.size[0] as u32 + whole(corner[0]);
            (0..4).for_each(|c| block.depth[c][k] = depth[c]);
            block.is_large[k] =
                (footprint.end[0] - corner[0] > 2.0) | (footprint.end[1] - corner[1] > 2.0);
        }
        block
    }

    /// Upper left pixel of the block of 2 × 2 colour pixels.
    #[inline(always)]
    fn corner(&self, footprint: &Footprint) -> [f32; 2] {
        std::array::from_fn(|c| footprint.first[c].min(self.size[c] - 2.0))
    }

    #[inline(always)]
    fn of(&self, n: Neighbourhood) -> Footprint {
        let across = step([n.left, n.center, n.right], self.steps[0]);
        let down = step([n.above, n.center, n.below], self.steps[1]);
        let is_reading = n.center[2] > 0.0;
        let half = |c: usize| {
            let parallelogram = 0.5 * (across[c].abs() + down[c].abs());
            (parallelogram + OVERLAP).min(MAX_HALF)
        };
        let bound = |c: usize, at: f32| round_up(at).max(0.0).min(self.size[c]);
        let end = |c: usize| bound(c, n.center[c] + half(c));
        Footprint {
            first: [0, 1].map(|c| bound(c, n.center[c] - half(c))),
            end: [0, 1].map(|c| if is_reading { end(c) } else { 0.0 }),
            center: n.center,
            slope: slope(across, down),
            range: 0.5 * (across[2].abs() + down[2].abs()),
        }
    }
}

impl Footprint {
    /// Depth at a colour pixel [mm].
    #[inline(always)]
    pub(super) fn depth(&self, [x, y]: [f32; 2]) -> u16 {
        let change = self.slope[0] * (x - self.center[0]) + self.slope[1] * (y - self.center[1]);
        whole(self.center[2] + change.max(-self.range).min(self.range)) as u16
    }

    /// Depths of the 2 × 2 colour pixels from `corner` on.
    #[inline(always)]
    fn depths(&self, [x, y]: [f32; 2]) -> [u16; 4] {
        [[x, y], [x + 1.0, y], [x, y + 1.0], [x + 1.0, y + 1.0]].map(|pixel| {
            let is_inside = (pixel[0] >= self.first[0])
                & (pixel[0] < self.end[0])
                & (pixel[1] >= self.first[1])
                & (pixel[1] < self.end[1]);
            if is_inside { self.depth(pixel) } else { EMPTY }
        })
    }
}

/// Values of a block of pixels of a row.
#[inline(always)]
fn lanes(row: &ProjectedRow, first: usize) -> [Lanes; 3] {
    row.0.each_ref().map(|values| {
        let mut lanes = [0.0; BLOCK];
        lanes.copy_from_slice(&values[first..][..BLOCK]);
        lanes
    })
}

/// Difference per pixel between the neighbours on the surface of the middle point: central, one-sided, or by default.
#[inline(always)]
fn step([before, center, after]: [Point; 3], default: [f32; 2]) -> Point {
    let tolerance = EDGE_SHARE * center[2];
    let has_before = (before[2] - center[2]).abs() <= tolerance;
    let has_after = (after[2] - center[2]).abs() <= tolerance;
    let scale = if has_before & has_after { 0.5 } else { 1.0 };
    let default = [default[0], default[1], 0.0];
    std::array::from_fn(|c| {
        let from = if has_before { before[c] } else { center[c] };
        let to = if has_after { after[c] } else { center[c] };
        if has_before | has_after {
            (to - from) * scale
        } else {
            default[c]
        }
    })
}

/// Change of depth by colour column and row, from two steps on a surface [mm]; none where it is seen from the side.
#[inline(always)]
fn slope(across: Point, down: Point) -> [f32; 2] {
    let area = across[0] * down[1] - down[0] * across[1];
    let inverse = if area.abs() > MIN_AREA {
        1.0 / area
    } else {
        0.0
    };
    [
        (across[2] * down[1] - down[2] * across[1]) * inverse,
        (across[0] * down[2] - down[0] * across[2]) * inverse,
    ]
}

/// Smallest whole number not below `x`, −2²² to 2²²; the same side of a tie for the same `x`.
#[inline(always)]
fn round_up(x: f32) -> f32 {
    (x + 0.5 + ROUND) - ROUND
}

/// Nearest whole number of 0 to 2²².
#[inline(always)]
fn whole(x: f32) -> u32 {
    (x + ROUND).to_bits() & 0x003f_ffff
}
