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

/// A depth pixel in the colour view: column, row [pixels] and depth \[mm\].
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
    /// Change of depth by column and row \[mm\].
    slope: [f32; 2],
    /// Largest difference from the depth of the centre \[mm\].
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
        let left = Lanes3::new(rows.middle, first);
        let center = Lanes3::new(rows.middle, first + 1);
        let right = Lanes3::new(rows.middle, first + 2);
        let above = Lanes3::new(rows.above, first + 1);
        let below = Lanes3::new(rows.below, first + 1);
        let mut block = FootprintBlock {
            offset: [0; BLOCK],
            depth: [[EMPTY; BLOCK]; 4],
            is_large: [false; BLOCK],
        };
        for k in 0..BLOCK {
            let footprint = self.of(Neighbourhood {
                center: center.at(k),
                left: left.at(k),
                right: right.at(k),
                above: above.at(k),
                below: below.at(k),
            });
            let corner = self.corner(&footprint);
            let depth = footprint.depths(corner);
            block.offset[k] = whole(corner[1]) * self.size[0] as u32 + whole(corner[0]);
            block.depth[0][k] = depth[0];
            block.depth[1][k] = depth[1];
            block.depth[2][k] = depth[2];
            block.depth[3][k] = depth[3];
            block.is_large[k] =
                (footprint.end[0] - corner[0] > 2.0) | (footprint.end[1] - corner[1] > 2.0);
        }
        block
    }

    /// Upper left pixel of the block of 2 × 2 colour pixels.
    #[inline(always)]
    fn corner(&self, footprint: &Footprint) -> [f32; 2] {
        let [x, y] = footprint.first;
        let within = |at: f32, size: f32| clamp(at, [0.0, size - 2.0]);
        [within(x, self.size[0]), within(y, self.size[1])]
    }

    #[inline(always)]
    fn of(&self, n: Neighbourhood) -> Footprint {
        let across = step([n.left, n.center, n.right], self.steps[0]);
        let down = step([n.above, n.center, n.below], self.steps[1]);
        let half = |c: usize| {
            let parallelogram = 0.5 * (across[c].abs() + down[c].abs());
            clamp(parallelogram + OVERLAP, [0.0, MAX_HALF])
        };
        let bound = |c: usize, at: f32| clamp(round_up(at), [0.0, self.size[c]]);
        let (x, y) = (half(0), half(1));
        let [u, v, z] = n.center;
        // An empty box without reading or beside the image.
        let first = [bound(0, u - x), bound(1, v - y)];
        let is_drawn = (z > 0.0) & (first[0] < self.size[0]) & (first[1] < self.size[1]);
        let end = |c: usize, at: f32| if is_drawn { bound(c, at) } else { 0.0 };
        Footprint {
            first,
            end: [end(0, u + x), end(1, v + y)],
            center: n.center,
            slope: slope(across, down),
            range: 0.5 * (across[2].abs() + down[2].abs()),
        }
    }
}

impl Footprint {
    /// Depth at a colour pixel \[mm\].
    #[inline(always)]
    pub(super) fn depth(&self, [x, y]: [f32; 2]) -> u16 {
        let [u, v, _] = self.center;
        self.limited(self.slope[0] * (x - u) + self.slope[1] * (y - v))
    }

    /// Depth of the centre and a change \[mm\].
    #[inline(always)]
    fn limited(&self, change: f32) -> u16 {
        whole(self.center[2] + clamp(change, [-self.range, self.range])) as u16
    }

    /// Depths of the 2 × 2 colour pixels from `corner` on.
    #[inline(always)]
    fn depths(&self, [x, y]: [f32; 2]) -> [u16; 4] {
        let (first, end) = (self.first, self.end);
        let (left, right) = ((x >= first[0]) & (x < end[0]), x + 1.0 < end[0]);
        let (upper, lower) = ((y >= first[1]) & (y < end[1]), y + 1.0 < end[1]);
        let [u, v, _] = self.center;
        let [by_column, by_row] = self.slope;
        let change = by_column * (x - u) + by_row * (y - v);
        let value = |is_inside: bool, change: f32| {
            let depth = self.limited(change);
            if is_inside { depth } else { EMPTY }
        };
        [
            value(left & upper, change),
            value(right & upper, change + by_column),
            value(left & lower, change + by_row),
            value(right & lower, change + by_column + by_row),
        ]
    }
}

/// Column, row and depth of a block of pixels of a row.
struct Lanes3<'a>([&'a Lanes; 3]);

impl<'a> Lanes3<'a> {
    #[inline(always)]
    fn new(row: &'a ProjectedRow, first: usize) -> Self {
        let lanes = |values: &'a [f32]| values[first..].first_chunk().unwrap_or(&[0.0; BLOCK]);
        let [u, v, z] = &row.0;
        Self([lanes(u), lanes(v), lanes(z)])
    }

    #[inline(always)]
    fn at(&self, k: usize) -> Point {
        let [u, v, z] = self.0;
        [u[k], v[k], z[k]]
    }
}

/// Difference per pixel between the neighbours on the surface of the middle point: central, one-sided, or by default.
#[inline(always)]
fn step([before, center, after]: [Point; 3], default: [f32; 2]) -> Point {
    let tolerance = EDGE_SHARE * center[2];
    let has_before = (before[2] - center[2]).abs() <= tolerance;
    let has_after = (after[2] - center[2]).abs() <= tolerance;
    let scale = if has_before & has_after { 0.5 } else { 1.0 };
    let change = |c: usize, default: f32| {
        let from = if has_before { before[c] } else { center[c] };
        let to = if has_after { after[c] } else { center[c] };
        if has_before | has_after {
            (to - from) * scale
        } else {
            default
        }
    };
    [change(0, default[0]), change(1, default[1]), change(2, 0.0)]
}

/// Change of depth by colour column and row, from two steps on a surface \[mm\]; none where it is seen from the side.
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

/// `x` within limits; the lower one for a NaN. Two instructions, which `f32::clamp` is not.
#[inline(always)]
fn clamp(x: f32, [low, high]: [f32; 2]) -> f32 {
    let x = if x > low { x } else { low };
    if x < high { x } else { high }
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
