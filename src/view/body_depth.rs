//! Depth of the tracked body over the drawn area, at half resolution: it only separates limbs from trunk.

use super::area::{Area, NEAR};
use super::input::{BodyView, Input};
use super::viewport::Viewport;
use tryon_geometry::math::P3;
use tryon_geometry::par::Par;
use tryon_geometry::raster::{Cull, Options, View, VisibilityBuffer, rasterise_with};

/// Output pixels a side of one pixel of the body's depth.
const STEP: u32 = 2;

/// Depth of the tracked body and its scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct BodyDepth {
    drawn: VisibilityBuffer,
    /// Vertices in the colour camera's frame, where there is a separate one.
    moved: Vec<P3>,
}

impl BodyDepth {
    /// Moves the tracked body of `input` into the picture's camera. Before all that asks for its vertices.
    pub(super) fn place(&mut self, input: &Input<'_>) {
        let calibration = input.calibration;
        if let (Some(body), Some(_)) = (input.body, calibration.color) {
            (calibration.color_from_depth).points_f32(body.vertices, &mut self.moved);
        }
    }

    /// Rasterises the placed body of `input`; returns `false` without one.
    pub(super) fn rasterise(
        &mut self,
        par: Par,
        input: &Input<'_>,
        viewport: &Viewport,
        area: &Area,
    ) -> bool {
        let Some(body) = input.body else { return false };
        let (width, height) = (area.width.div_ceil(STEP), area.height.div_ceil(STEP));
        let view = View::Perspective {
            camera: viewport.sample_camera(area, 1).resized(width, height),
            near: NEAR,
        };
        let options = Options {
            par,
            cull: Cull::Back,
            ..Options::default()
        };
        let vertices = match input.calibration.color {
            Some(_) => &self.moved,
            None => body.vertices,
        };
        rasterise_with(options, &view, vertices, body.faces, &mut self.drawn);
        true
    }

    /// Vertices of the placed `body` in the picture's camera.
    pub(super) fn vertices<'a>(&'a self, input: &Input<'a>, body: &BodyView<'a>) -> &'a [P3] {
        match input.calibration.color {
            Some(_) => &self.moved,
            None => body.vertices,
        }
    }

    #[inline]
    fn index(&self, x: usize, y: usize) -> usize {
        y / STEP as usize * self.drawn.width as usize + x / STEP as usize
    }

    /// Depth at a pixel of the area, metres; infinity = not on the body.
    #[inline]
    pub(super) fn at(&self, x: usize, y: usize) -> f32 {
        self.drawn.depth[self.index(x, y)]
    }

    /// Depth of trunk, head or legs at a pixel of the area, metres; infinity = an arm, or not on the body.
    pub(super) fn trunk_at(&self, body: &BodyView<'_>, x: usize, y: usize) -> f32 {
        let face = body.faces.get(self.drawn.face[self.index(x, y)] as usize);
        match face {
            Some(f) if !body.limbs.is_arm(f[0]) => self.at(x, y),
            _ => f32::INFINITY,
        }
    }
}
