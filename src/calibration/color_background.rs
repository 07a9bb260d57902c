//! Empty scene in colour: median of each pixel over the frames in which the person is elsewhere.

use super::depth_background::Pixel;
use super::settings::ExtrinsicsSettings;
use nalgebra::Isometry3;
use tryon_geometry::camera::{DepthImage, Intrinsics};
use tryon_geometry::math::order_statistics::median;

/// Side of a cell in which the same frames are free of the person (pixels).
const CELL: usize = 8;
/// Distance of a person at which the unknown translation counts (m).
const DISTANCE: f64 = 2.0;
/// Every how many pixels of the depth image the person's mask is projected.
const STRIDE: usize = 3;
/// Frames of which a median is taken; where the person is elsewhere in fewer, it is of all.
const LEAST_FREE: usize = 5;

/// Cells of one colour image that the person covers, with the margin that the unknown extrinsics need.
#[derive(Clone, Debug)]
pub(crate) struct CoveredCells {
    columns: usize,
    is_covered: Vec<bool>,
}

/// Colour camera and the extrinsics that the estimation starts from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColorView<'a> {
    pub(crate) depth: &'a Intrinsics,
    pub(crate) color: &'a Intrinsics,
    pub(crate) color_from_depth: &'a Isometry3<f64>,
}

impl CoveredCells {
    /// Cells of the person's mask.
    pub(crate) fn new(
        mask: &[Pixel],
        depth: &DepthImage,
        view: ColorView<'_>,
        settings: &ExtrinsicsSettings,
    ) -> Self {
        let k = view.color;
        let columns = (k.width as usize).div_ceil(CELL);
        let rows = (k.height as usize).div_ceil(CELL);
        let mut is_covered = vec![false; columns * rows];
        let width = view.depth.width as usize;
        let iso = view.color_from_depth.cast::<f32>();
        for (i, pixel) in mask.iter().enumerate() {
            let (u, v) = (i % width, i / width);
            if *pixel != Pixel::Person || u % STRIDE > 0 || v % STRIDE > 0 {
                continue;
            }
            let z = f32::from(depth.data()[i]) * 1e-3;
            let p = iso * view.depth.unproject(u as f32, v as f32, z);
            let at = k.project(&p);
            let (column, row) = (at.x / CELL as f32, at.y / CELL as f32);
            let is_inside = p.z > 0.0 && column >= 0.0 && row >= 0.0;
            if is_inside && (column as usize) < columns && (row as usize) < rows {
                is_covered[row as usize * columns + column as usize] = true;
            }
        }
        let margin = k.fx * (settings.unknown_rotation + settings.unknown_translation / DISTANCE);
        let margin = (margin / CELL as f64).ceil() as usize;
        widen(&mut is_covered, columns, 1, margin);
        widen(&mut is_covered, columns, columns, margin);
        Self {
            columns,
            is_covered,
        }
    }
}

/// Covers the `margin` cells before and after each covered one, along rows (`step` 1) or columns (`step` `columns`).
fn widen(cells: &mut [bool], columns: usize, step: usize, margin: usize) {
    let line = |i: usize| if step == 1 { i / columns } else { i % columns };
    let before = cells.to_vec();
    for i in (0..before.len()).filter(|i| before[*i]) {
        for by in 1..=margin {
            for at in [i.checked_sub(by * step), i.checked_add(by * step)] {
                if let Some(at) = at.filter(|at| *at < before.len() && line(*at) == line(i)) {
                    cells[at] = true;
                }
            }
        }
    }
}

/// Colour of the empty scene, interleaved, of the size of `camera`.
pub(crate) fn color_background(
    camera: &Intrinsics,
    images: &[&[u8]],
    covered: &[CoveredCells],
) -> Vec<u8> {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let mut out = vec![0; 3 * width * height];
    let mut values = Vec::new();
    let all: Vec<usize> = (0..images.len()).collect();
    for v in 0..height {
        for first in (0..width).step_by(CELL) {
            let free = |i: &usize| {
                let of = &covered[*i];
                !of.is_covered[v / CELL * of.columns + first / CELL]
            };
            let free: Vec<usize> = all.iter().copied().filter(free).collect();
            let taken = if free.len() < LEAST_FREE { &all } else { &free };
            for i in 3 * (v * width + first)..3 * (v * width + (first + CELL).min(width)) {
                values.clear();
                values.extend(taken.iter().map(|image| images[*image][i]));
                out[i] = median(&mut values).unwrap_or(0);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The person covers a pixel in most frames, and is known to.
    #[test]
    fn covered_frames_are_left_out() {
        let camera = Intrinsics::KINECT_V1.resized(64, 48);
        let settings = ExtrinsicsSettings {
            unknown_rotation: 0.0,
            unknown_translation: 0.01,
            ..ExtrinsicsSettings::default()
        };
        let depth = DepthImage::new(64, 48, vec![2000; 64 * 48]).expect("64×48");
        let view = ColorView {
            depth: &camera,
            color: &camera,
            color_from_depth: &Isometry3::identity(),
        };
        let frame = |is_here: bool| {
            let mut mask = vec![Pixel::Scene; 64 * 48];
            let mut color = vec![90u8; 3 * 64 * 48];
            if is_here {
                for i in (0..64 * 48).filter(|i| i % 64 < 30) {
                    mask[i] = Pixel::Person;
                    color[3 * i..3 * i + 3].fill(200);
                }
            }
            (color, CoveredCells::new(&mask, &depth, view, &settings))
        };
        let frames: Vec<_> = (0..20).map(|i| frame(i >= 6)).collect();
        let images: Vec<&[u8]> = frames.iter().map(|(c, _)| c.as_slice()).collect();
        let covered: Vec<CoveredCells> = frames.iter().map(|(_, c)| c.clone()).collect();
        let empty = color_background(&camera, &images, &covered);
        assert!(empty.iter().all(|c| *c == 90));
    }
}
