//! Captured depth from the picture's camera.

use super::area::Area;
use super::input::Input;
use super::viewport::Viewport;
use std::borrow::Cow;
use tryon_geometry::math::{P3, V3};

/// Margin around half a reading's footprint, target pixels: closes gaps between readings that rounding leaves.
const FOOTPRINT_MARGIN: f32 = 0.25;

/// Depth from the picture's camera, millimetres, shape `viewport.depth`: the sensor's own, or resampled when the colour
/// camera stands elsewhere. A reading covers the pixels of its own footprint; the nearest wins.
pub(crate) fn depth_from_picture<'a>(input: &Input<'a>, viewport: &Viewport) -> Cow<'a, [u16]> {
    let Some(color) = &input.calibration.color else {
        return Cow::Borrowed(input.frame.depth.data());
    };
    let target = viewport.depth_camera(color);
    let [width, height] = viewport.depth;
    let mut out = vec![0; width as usize * height as usize];
    let depth = &input.frame.depth;
    let source = input
        .calibration
        .depth
        .resized(depth.width(), depth.height());
    let iso: nalgebra::Isometry3<f32> = input.calibration.color_from_depth.iso().cast();
    let rotation = iso.rotation.to_rotation_matrix().into_inner();
    let shift: V3 = iso.translation.vector;
    let reach =
        (0.5 * (target.fx / source.fx).max(target.fy / source.fy)) as f32 + FOOTPRINT_MARGIN;
    let range = |x: f32, side: u32| {
        let lo = (x - reach).ceil().max(0.0) as u32;
        lo..((x + reach).floor() + 1.0).clamp(0.0, side as f32) as u32
    };
    for (i, mm) in depth.data().iter().enumerate().filter(|(_, mm)| **mm != 0) {
        let (u, v) = (i as u32 % depth.width(), i as u32 / depth.width());
        let ray = source.unproject(u as f32, v as f32, f32::from(*mm) * 1e-3);
        let p = P3::from(rotation * ray.coords + shift);
        if p.z <= 0.0 {
            continue;
        }
        let q = target.project(&p);
        let mm = (p.z * 1e3).clamp(1.0, f32::from(u16::MAX)) as u16;
        for y in range(q.y, height) {
            for slot in range(q.x, width).map(|x| (y * width + x) as usize) {
                if out[slot] == 0 || mm < out[slot] {
                    out[slot] = mm;
                }
            }
        }
    }
    Cow::Owned(out)
}

/// Captured depth by pixel of the drawn area.
pub(crate) struct AreaDepth {
    /// Metres, 0 = no reading; shape `[area]`.
    pub(crate) metres: Vec<f32>,
    width: usize,
}

impl AreaDepth {
    /// Nearest readings of `depth` (millimetres, shape `viewport.depth`).
    pub(crate) fn new(viewport: &Viewport, area: &Area, depth: &[u16]) -> Self {
        let width = viewport.depth[0] as usize;
        let columns: Vec<Option<u32>> = (0..area.width)
            .map(|x| viewport.depth_at(0, area.left + x))
            .collect();
        let mut metres = vec![0.0; area.len()];
        for (y, out) in metres.chunks_mut(area.width as usize).enumerate() {
            let Some(v) = viewport.depth_at(1, area.top + y as u32) else {
                continue;
            };
            let row = &depth[v as usize * width..(v as usize + 1) * width];
            for (z, column) in out.iter_mut().zip(&columns) {
                *z = column.map_or(0.0, |c| f32::from(row[c as usize]) * 1e-3);
            }
        }
        Self {
            metres,
            width: area.width as usize,
        }
    }

    /// Depth at a pixel of the area, metres; 0 = no reading.
    #[inline]
    pub(crate) fn at(&self, x: usize, y: usize) -> f32 {
        self.metres[y * self.width + x]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Framing;
    use tryon_geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};
    use tryon_geometry::math::Rigid;

    #[test]
    fn resampled_depth_shifts_by_the_parallax_without_gaps() {
        let depth = Intrinsics::KINECT_V1.resized(160, 120);
        let calibration = Calibration {
            depth,
            color: Some(Intrinsics::KINECT_V1),
            color_from_depth: Rigid::new(nalgebra::Isometry3::translation(0.05, 0.0, 0.0)),
        };
        let frame = RgbdFrame {
            sequence: 0,
            time_ns: 0,
            depth: DepthImage::new(160, 120, vec![2000; 160 * 120]).expect("size"),
            color: Some(ColorImage::filled(640, 480, [9; 3])),
        };
        let input = Input {
            frame: &frame,
            calibration: &calibration,
            garments: &[],
            body: None,
            output: None,
        };
        let viewport = Viewport::new(&input, Framing::Cover);
        assert_eq!(viewport.depth, [160, 120]);
        let resampled = depth_from_picture(&input, &viewport);
        // 5 cm at 2 m are 3.3 of these pixels: the wall moves right, no gaps inside.
        let row = &resampled[60 * 160..61 * 160];
        assert!(
            row[..2].iter().all(|d| *d == 0) && row[5..].iter().all(|d| *d == 2000),
            "{row:?}"
        );
    }
}
