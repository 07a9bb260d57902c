//! Camera of the output picture and its mapping to the captured images.

use super::area::Area;
use super::focus::Focus;
use super::input::{Framing, Input};
use super::settings::FocusSettings;
use tryon_geometry::camera::Intrinsics;

/// Camera of the output picture and its mapping to the captured images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Viewport {
    /// Camera of the output picture.
    pub(crate) camera: Intrinsics,
    /// Size of the colour image.
    pub(crate) color: [u32; 2],
    /// Size of the depth image as seen from the picture's camera.
    pub(crate) depth: [u32; 2],
    /// Output pixels per colour pixel.
    pub(crate) scale: f64,
    /// Output position of the colour image's corner, pixels.
    pub(crate) shift: [f64; 2],
}

impl Viewport {
    /// The viewport of `input.output_size()`, seen from the colour camera if there is a separate one. A crop shows the focus,
    /// or the middle without one.
    pub(crate) fn new(input: &Input<'_>, focus: Option<&Focus>, settings: &FocusSettings) -> Self {
        let [width, height] = input.output_size();
        let depth = [input.frame.depth.width(), input.frame.depth.height()];
        let base = input.calibration.color.unwrap_or(input.calibration.depth);
        let color = input
            .frame
            .color
            .as_ref()
            .map_or([base.width, base.height], |c| [c.width(), c.height()]);
        let base = base.resized(color[0], color[1]);
        let ratio = [0, 1].map(|k| f64::from([width, height][k]) / f64::from(color[k]));
        let scale = match input.output.map_or(Framing::Contain, |o| o.framing) {
            Framing::Cover => ratio[0].max(ratio[1]),
            Framing::Contain => ratio[0].min(ratio[1]),
        };
        let shift = [0, 1].map(|k| {
            let (out, whole) = (f64::from([width, height][k]), scale * f64::from(color[k]));
            match focus {
                // Never past the captured picture.
                Some(focus) if whole > out => {
                    (settings.place[k] * out - focus.at[k] * whole).clamp(out - whole, 0.0)
                }
                _ => (out - whole) * 0.5,
            }
        });
        let camera = Intrinsics {
            width,
            height,
            fx: base.fx * scale,
            fy: base.fy * scale,
            cx: (base.cx + 0.5) * scale + shift[0] - 0.5,
            cy: (base.cy + 0.5) * scale + shift[1] - 0.5,
        };
        // Depth seen from another camera is resampled at about its own resolution.
        let rows = f64::from(depth[0]) * f64::from(color[1]) / f64::from(color[0]);
        let depth = match input.calibration.color {
            Some(_) => [depth[0], (rows.round() as u32).max(1)],
            None => depth,
        };
        Self {
            camera,
            color,
            depth,
            scale,
            shift,
        }
    }

    /// Position on the colour image (pixel centres at integers) of an output column (axis 0) or row (axis 1).
    pub(crate) fn color_at(&self, axis: usize, out: u32) -> f64 {
        (f64::from(out) + 0.5 - self.shift[axis]) / self.scale - 0.5
    }

    /// Nearest depth column or row, if there is one.
    pub(crate) fn depth_at(&self, axis: usize, out: u32) -> Option<u32> {
        let x = (self.color_at(axis, out) + 0.5) * f64::from(self.depth[axis])
            / f64::from(self.color[axis]);
        (x >= 0.0 && x < f64::from(self.depth[axis])).then_some(x as u32)
    }

    /// Output pixels per depth pixel.
    pub(crate) fn pixels_per_depth(&self) -> f64 {
        self.scale * f64::from(self.color[0]) / f64::from(self.depth[0])
    }

    /// Intrinsics of the depth image resampled to the picture's camera `base`.
    pub(crate) fn depth_camera(&self, base: &Intrinsics) -> Intrinsics {
        base.resized(self.depth[0], self.depth[1])
    }

    /// Intrinsics of `area` alone with `n` samples along each side of a pixel.
    pub(crate) fn sample_camera(&self, area: &Area, n: u32) -> Intrinsics {
        let full = self
            .camera
            .resized(self.camera.width * n, self.camera.height * n);
        Intrinsics {
            width: area.width * n,
            height: area.height * n,
            cx: full.cx - f64::from(area.left * n),
            cy: full.cy - f64::from(area.top * n),
            ..full
        }
    }
}
