//! Garment and person by cell of the drawn area, and the garment beyond a distance from the person.
//!
//! The Euclidean distance is separable (Felzenszwalb & Huttenlocher 2012): gaps along columns for all cells, then a
//! comparison along the row, only where a garment has no person behind it.

use super::area::Area;
use super::coverage::PixelCoverage;
use std::ops::Range;
use tryon_geometry::math::order_statistics::median;

/// Largest side of a cell, pixels: the pixels of one are counted in 16 bits.
const MAX_STRIDE: usize = 255;
/// Pixels that the median depth is taken of, about: it is right to a millimetre.
const SAMPLES: usize = 8192;
/// Gap of a column without a person, cells: one more a row does not overflow.
const NO_PERSON: u16 = u16::MAX / 2;

/// Drawn garments over the captured depth.
pub(super) struct DressedArea<'a> {
    pub(super) area: &'a Area,
    /// Garments, shape `[area]`.
    pub(super) pixels: &'a [PixelCoverage],
    /// Share of each pixel in front of the garment, shape `[area]`.
    pub(super) alpha: &'a [f32],
    /// Captured depth, metres, 0 = none; shape `[area]`.
    pub(super) depth: &'a [f32],
}

/// Captured depths of the person, metres.
pub(super) struct PersonBounds {
    pub(super) middle: f32,
    /// Largest difference from `middle`.
    pub(super) reach: f32,
    /// Least number of cells along the radius of a measurement, where pixels are that small.
    pub(super) cells: f32,
}

/// Garment and person by cell. A cell with any pixel of the person is one of the person, so that thin limbs count. Edges lie
/// anywhere in their cells, so that distances between centres are right on average.
pub(super) struct SilhouetteGrid {
    /// Pixels a side of a cell.
    stride: usize,
    width: usize,
    /// Garment pixels, shape `[cells]`.
    garment: Vec<u16>,
    /// Distance to the nearest cell of the person in the same column, cells; shape `[cells]`.
    gap: Vec<u16>,
}

/// Neighbouring garment pixels far from the person.
pub(super) struct PatchOff {
    /// Number of pixels.
    pub(super) pixels: f32,
    /// Their mean place in the area, pixels.
    pub(super) centre: [f32; 2],
}

impl DressedArea<'_> {
    fn is_garment(&self, pixel: usize) -> bool {
        is_garment(&self.pixels[pixel], self.alpha[pixel])
    }

    /// Marks the garment pixels of a row with 1.
    fn mark(&self, row: Range<usize>, out: &mut [u16]) {
        let pixels = self.pixels[row.clone()].iter().zip(&self.alpha[row]);
        for (out, (pixel, alpha)) in out.iter_mut().zip(pixels) {
            *out = u16::from(is_garment(pixel, *alpha));
        }
    }

    /// Median captured depth under the garments, metres; `None` without a reading there.
    pub(super) fn median_depth(&self) -> Option<f32> {
        // An odd step meets all columns of an area of even width.
        let step = (self.pixels.len() / SAMPLES) | 1;
        let sampled = (0..self.pixels.len()).step_by(step);
        let readings = sampled.filter(|i| self.depth[*i] > 0.0 && self.is_garment(*i));
        let mut depths: Vec<f32> = readings.map(|i| self.depth[i]).collect();
        median(&mut depths)
    }
}

impl SilhouetteGrid {
    /// Cells of an area that are small against `radius` pixels.
    pub(super) fn new(dressed: &DressedArea<'_>, person: &PersonBounds, radius: f32) -> Self {
        let stride = ((radius / person.cells) as usize).clamp(1, MAX_STRIDE);
        let columns = dressed.area.width as usize;
        let width = columns.div_ceil(stride);
        let cells = width * (dressed.area.height as usize).div_ceil(stride);
        let (mut garment, mut gap) = (vec![0; cells], vec![0; cells]);
        let [mut drawn, mut seen] = [0, 1].map(|_| vec![0; columns]);
        for y in 0..dressed.area.height as usize {
            let cells = y / stride * width..(y / stride + 1) * width;
            let row = y * columns..(y + 1) * columns;
            dressed.mark(row.clone(), &mut drawn);
            count(&drawn, stride, &mut garment[cells.clone()]);
            person.mark(&dressed.depth[row], &mut seen);
            count(&seen, stride, &mut gap[cells]);
        }
        for n in &mut gap {
            *n = if *n > 0 { 0 } else { NO_PERSON };
        }
        spread(&mut gap, width);
        Self {
            stride,
            width,
            garment,
            gap,
        }
    }

    /// Number of garment pixels.
    pub(super) fn garment_pixels(&self) -> usize {
        self.garment.iter().map(|n| usize::from(*n)).sum()
    }

    /// Garment pixels without a person within `radius` pixels, by squares of about that side.
    pub(super) fn patches_off(&self, radius: f32) -> Vec<PatchOff> {
        let radius = radius / self.stride as f32;
        // Largest gap of a column within the radius, by distance along the row.
        let reach: Vec<u16> = (0..=radius as usize)
            .map(|dx| (radius * radius - (dx * dx) as f32).max(0.0).sqrt() as u16)
            .collect();
        let side = reach.len();
        let across = self.width.div_ceil(side);
        let height = self.garment.len() / self.width;
        // Pixels, and the sums of their columns and rows.
        let mut sums = vec![[0.0; 3]; across * height.div_ceil(side)];
        let rows = (self.garment.chunks(self.width)).zip(self.gap.chunks(self.width));
        for (y, (garment, gap)) in rows.enumerate() {
            let bare = garment.iter().zip(gap).enumerate();
            for (x, (n, _)) in bare.filter(|(_, (n, gap))| (**n > 0) & (**gap > 0)) {
                if !is_near(gap, x, &reach) {
                    let sums = &mut sums[y / side * across + x / side];
                    let n = f32::from(*n);
                    for (sum, more) in sums.iter_mut().zip([n, n * x as f32, n * y as f32]) {
                        *sum += more;
                    }
                }
            }
        }
        let stride = self.stride as f32;
        let patch = |[n, x, y]: [f32; 3]| PatchOff {
            pixels: n,
            centre: [x, y].map(|sum| (sum / n + 0.5) * stride - 0.5),
        };
        sums.into_iter().filter(|s| s[0] > 0.0).map(patch).collect()
    }
}

impl PersonBounds {
    /// Marks the readings of the person in a row with 1.
    fn mark(&self, depth: &[f32], out: &mut [u16]) {
        for (out, z) in out.iter_mut().zip(depth) {
            *out = u16::from((*z > 0.0) & ((z - self.middle).abs() < self.reach));
        }
    }
}

/// Adds the marks of a row of pixels to its cells.
fn count(marks: &[u16], stride: usize, cells: &mut [u16]) {
    if stride == 1 {
        (cells.iter_mut().zip(marks)).for_each(|(cell, mark)| *cell += mark);
        return;
    }
    for (cell, marks) in cells.iter_mut().zip(marks.chunks(stride)) {
        *cell += marks.iter().sum::<u16>();
    }
}

/// The picture shows a garment here.
fn is_garment(pixel: &PixelCoverage, alpha: f32) -> bool {
    (pixel.covered > 0) & (alpha < 0.5)
}

/// Some column near column `x` of a row has a gap within its reach.
fn is_near(gap: &[u16], x: usize, reach: &[u16]) -> bool {
    (reach.iter().enumerate()).any(|(dx, reach)| {
        let is_within = |x: usize| gap.get(x).is_some_and(|g| g <= reach);
        is_within(x + dx) || x.checked_sub(dx).is_some_and(is_within)
    })
}

/// Spreads the zeros of a grid to distances from them along its columns.
fn spread(gap: &mut [u16], width: usize) {
    let relax = |to: &mut [u16], from: &[u16]| {
        (to.iter_mut().zip(from)).for_each(|(to, from)| *to = (*to).min(from + 1));
    };
    let height = gap.len() / width;
    for y in 1..height {
        let (above, rest) = gap.split_at_mut(y * width);
        relax(&mut rest[..width], &above[(y - 1) * width..]);
    }
    for y in (1..height).rev() {
        let (above, rest) = gap.split_at_mut(y * width);
        relax(&mut above[(y - 1) * width..], &rest[..width]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERSON: PersonBounds = PersonBounds {
        cells: 12.0,
        middle: 2.0,
        reach: 0.7,
    };

    /// An arm and a sleeve that leaves it, `scale` pixels for one of 640×480.
    struct Arm {
        area: Area,
        pixels: Vec<PixelCoverage>,
        depth: Vec<f32>,
    }

    /// Distance from the middle of a pixel to a segment, pixels.
    fn distance([x, y]: [f32; 2], [[ax, ay], [bx, by]]: [[f32; 2]; 2]) -> f32 {
        let (dx, dy) = (bx - ax, by - ay);
        let along = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy);
        let along = along.clamp(0.0, 1.0);
        (x - ax - along * dx).hypot(y - ay - along * dy)
    }

    impl Arm {
        fn new(scale: f32) -> Self {
            let side = |pixels: f32| (pixels * scale) as u32;
            let area = Area {
                left: 7,
                top: 5,
                width: side(170.0),
                height: side(200.0),
            };
            let (mut pixels, mut depth) = (Vec::new(), Vec::new());
            for i in 0..area.len() as u32 {
                let at = [i % area.width, i / area.width].map(|c| (c as f32 + 0.5) / scale);
                let is_arm = distance(at, [[60.0, 20.0], [85.0, 150.0]]) < 14.0;
                let is_finger = distance(at, [[85.0, 150.0], [92.0, 190.0]]) < 0.8;
                // A wall behind, and holes.
                depth.push(match is_arm || is_finger {
                    _ if i % 31 == 0 => 0.0,
                    true => 2.0,
                    false => 3.2,
                });
                let is_sleeve = distance(at, [[62.0, 20.0], [105.0, 185.0]]) < 22.0;
                pixels.push(PixelCoverage {
                    covered: u8::from(is_sleeve),
                    ..PixelCoverage::default()
                });
            }
            Self {
                area,
                pixels,
                depth,
            }
        }

        fn dressed<'a>(&'a self, alpha: &'a [f32]) -> DressedArea<'a> {
            DressedArea {
                area: &self.area,
                pixels: &self.pixels,
                alpha,
                depth: &self.depth,
            }
        }

        /// Share of the sleeve farther than `radius` pixels from each pixel of the arm, by comparing all.
        fn share_off(&self, radius: f32) -> f32 {
            let (width, height) = (self.area.width as i32, self.area.height as i32);
            let is_person = |x: i32, y: i32| {
                let z = self.depth[(y * width + x) as usize];
                z > 0.0 && (z - PERSON.middle).abs() < PERSON.reach
            };
            let reach = radius as i32;
            let is_off = |x: i32, y: i32| {
                let rows = (y - reach).max(0)..=(y + reach).min(height - 1);
                let near = |v: i32| {
                    ((x - reach).max(0)..=(x + reach).min(width - 1)).any(|u| {
                        let squared = ((u - x).pow(2) + (v - y).pow(2)) as f32;
                        squared <= radius * radius && is_person(u, v)
                    })
                };
                !rows.into_iter().any(near)
            };
            let sleeve = (0..self.area.len() as i32)
                .filter(|i| self.pixels[*i as usize].covered > 0)
                .map(|i| is_off(i % width, i / width));
            let (mut off, mut all) = (0, 0);
            sleeve.for_each(|is_off| (off, all) = (off + i32::from(is_off), all + 1));
            off as f32 / all as f32
        }
    }

    #[test]
    fn cells_of_any_size_agree_with_the_distances_of_all_pixels() {
        for (scale, stride) in [(1.0, 1), (1.6, 1), (2.4, 2), (4.0, 3)] {
            let arm = Arm::new(scale);
            let alpha = vec![0.0; arm.pixels.len()];
            let radius = 10.5 * scale;
            let grid = SilhouetteGrid::new(&arm.dressed(&alpha), &PERSON, radius);
            assert_eq!(grid.stride, stride);
            let off: f32 = grid.patches_off(radius).iter().map(|p| p.pixels).sum();
            let (share, oracle) = (off / grid.garment_pixels() as f32, arm.share_off(radius));
            assert!((0.1..0.4).contains(&oracle), "{oracle}");
            let most = if stride == 1 { 1e-6 } else { 3e-3 };
            assert!(
                (share - oracle).abs() < most,
                "cells of {stride}: {share}, {oracle}"
            );
        }
    }

    #[test]
    fn hidden_garments_and_areas_without_person_or_depth_are_no_fault() {
        let mut arm = Arm::new(1.0);
        let (shown, hidden) = (vec![0.0; arm.pixels.len()], vec![0.5; arm.pixels.len()]);
        let wall = arm.dressed(&shown).median_depth();
        assert_eq!(wall, Some(3.2), "most of the sleeve is before the wall");
        assert_eq!(arm.dressed(&hidden).median_depth(), None);
        let grid = SilhouetteGrid::new(&arm.dressed(&hidden), &PERSON, 10.5);
        assert_eq!(
            (grid.garment_pixels(), grid.patches_off(10.5).len()),
            (0, 0)
        );

        arm.depth.fill(0.0);
        assert_eq!(arm.dressed(&shown).median_depth(), None);
        let grid = SilhouetteGrid::new(&arm.dressed(&shown), &PERSON, 10.5);
        let off: f32 = grid.patches_off(10.5).iter().map(|p| p.pixels).sum();
        assert_eq!(off, grid.garment_pixels() as f32);
    }
}
