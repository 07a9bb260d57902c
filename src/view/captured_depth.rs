//! Captured depth from the picture's camera.

use super::area::Area;
use super::input::{Input, RenderError};
use super::viewport::Viewport;
use std::borrow::Cow;
use tryon_geometry::camera::{Calibration, DepthImage, Registration};

/// Captured depth drawn into the picture's camera; the table of rays is kept until a camera changes.
#[derive(Clone, Debug, Default)]
pub(crate) struct PictureDepth {
    registration: Option<(Calibration, Registration)>,
}

impl PictureDepth {
    /// Depth from the picture's camera, millimetres, shape `viewport.depth`: the sensor's own, or registered when the colour
    /// camera stands elsewhere.
    pub(crate) fn take<'a>(
        &mut self,
        input: &Input<'a>,
        viewport: &Viewport,
    ) -> Result<Cow<'a, DepthImage>, RenderError> {
        let depth = &input.frame.depth;
        let Some(color) = &input.calibration.color else {
            return Ok(Cow::Borrowed(depth));
        };
        let cameras = Calibration {
            depth: (input.calibration.depth).resized(depth.width(), depth.height()),
            color: Some(viewport.depth_camera(color)),
            color_from_depth: input.calibration.color_from_depth,
        };
        let mut image = DepthImage::default();
        (self.registration(cameras)).depth_in_color(depth, &mut image)?;
        Ok(Cow::Owned(image))
    }

    fn registration(&mut self, cameras: Calibration) -> &mut Registration {
        let kept = (self.registration.take()).filter(|(of, _)| *of == cameras);
        let build = || {
            let registration = Registration::new(cameras.clone());
            (cameras, registration)
        };
        &mut self.registration.insert(kept.unwrap_or_else(build)).1
    }
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
    use crate::settings::FocusSettings;
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
        let viewport = Viewport::new(&input, None, &FocusSettings::default());
        assert_eq!(viewport.depth, [160, 120]);
        let resampled = PictureDepth::default()
            .take(&input, &viewport)
            .expect("registered");
        // 5 cm at 2 m are 3.3 of these pixels: the wall moves right, no gaps inside.
        let row = &resampled.data()[60 * 160..61 * 160];
        assert!(
            row[..2].iter().all(|d| *d == 0) && row[5..].iter().all(|d| *d == 2000),
            "{row:?}"
        );
    }
}
