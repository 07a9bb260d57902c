//! Parts of the tracked body over the whole picture, and around it the nearest ones.

use crate::area::{Area, NEAR};
use crate::input::BodyView;
use crate::viewport::Viewport;
use std::collections::VecDeque;
use tryon_body::parts::BodySegment;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::par::Par;
use tryon_geometry::raster::{Cull, Options, View, VisibilityBuffer, rasterise_with};

/// Columns of the field, about: parts of a body two metres away are several cells wide.
const COLUMNS: u32 = 320;

/// Nearest face of the body by cell.
#[derive(Clone, Debug, Default)]
pub(crate) struct BodyField {
    /// Pixels a side of a cell.
    pub(super) stride: u32,
    pub(super) width: usize,
    pub(super) height: usize,
    drawn: VisibilityBuffer,
    /// Nearest cell on the body, shape `[cells]`; `NONE` beyond the reach.
    nearest: Vec<u32>,
    queue: VecDeque<u32>,
    /// Focal length, cells.
    focal: f32,
}

/// No cell.
const NONE: u32 = u32::MAX;

/// The body at or next to a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearBody {
    pub(super) face: u32,
    /// Depth there, metres.
    pub(super) depth: f32,
    /// The cell itself is on the body.
    pub(super) is_on: bool,
}

impl BodyField {
    /// Rasterises a body (picture's camera, metres) and finds the nearest cell on it for those within `reach` metres.
    pub(super) fn build(
        &mut self,
        par: Par,
        viewport: &Viewport,
        body: &BodyView<'_>,
        vertices: &[P3],
        reach: f32,
    ) {
        let camera = &viewport.camera;
        self.stride = (camera.width.min(camera.height) / (COLUMNS * 3 / 4)).max(1);
        let [width, height] = [camera.width, camera.height].map(|s| s.div_ceil(self.stride));
        let mut view = camera.resized(width, height);
        // Cells at the right and lower border may be larger than the picture.
        let scale = 1.0 / f64::from(self.stride);
        (view.fx, view.fy) = (camera.fx * scale, camera.fy * scale);
        (view.cx, view.cy) = (
            (camera.cx + 0.5) * scale - 0.5,
            (camera.cy + 0.5) * scale - 0.5,
        );
        let options = Options {
            par,
            cull: Cull::Back,
            ..Options::default()
        };
        let view = View::Perspective {
            camera: view,
            near: NEAR,
        };
        rasterise_with(options, &view, vertices, body.faces, &mut self.drawn);
        (self.width, self.height) = (width as usize, height as usize);
        self.focal = (camera.fx * scale) as f32;
        self.spread(reach);
    }

    /// Breadth first from the body's cells; a cell beside a near part reaches farther than one beside a far part.
    fn spread(&mut self, reach: f32) {
        let on = |i: usize| self.drawn.face[i] != VisibilityBuffer::NONE;
        self.nearest.clear();
        self.nearest
            .extend((0..self.width * self.height).map(|i| if on(i) { i as u32 } else { NONE }));
        self.queue.clear();
        self.queue
            .extend(self.nearest.iter().filter(|i| **i != NONE));
        while let Some(i) = self.queue.pop_front() {
            let (x, y) = (i as usize % self.width, i as usize / self.width);
            let from = self.nearest[i as usize];
            let (fx, fy) = (from as usize % self.width, from as usize / self.width);
            let radius = self.focal * reach / self.drawn.depth[from as usize];
            for [dx, dy] in [[0, 1], [1, 0], [0, -1], [-1, 0]] {
                let (Some(x), Some(y)) = (x.checked_add_signed(dx), y.checked_add_signed(dy))
                else {
                    continue;
                };
                if x >= self.width || y >= self.height {
                    continue;
                }
                let away = (x.abs_diff(fx).pow(2) + y.abs_diff(fy).pow(2)) as f32;
                let next = y * self.width + x;
                if self.nearest[next] == NONE && away <= radius * radius {
                    self.nearest[next] = from;
                    self.queue.push_back(next as u32);
                }
            }
        }
    }

    /// The body at or next to a pixel; `None` beyond the reach.
    pub(super) fn at(&self, [u, v]: [u32; 2]) -> Option<NearBody> {
        let i = (v / self.stride) as usize * self.width + (u / self.stride) as usize;
        self.at_cell(i)
    }

    /// Distance of a pixel's cell from the body across the picture, metres; infinite beyond the reach.
    pub(super) fn beside(&self, [u, v]: [u32; 2]) -> f32 {
        let cell = [u, v].map(|p| (p / self.stride) as usize);
        let nearest = self.nearest.get(cell[1] * self.width + cell[0]);
        let Some(nearest) = nearest.filter(|n| **n != NONE).map(|n| *n as usize) else {
            return f32::INFINITY;
        };
        let on = [nearest % self.width, nearest / self.width];
        let [x, y] = [0, 1].map(|k| cell[k].abs_diff(on[k]) as f32);
        x.hypot(y) * self.drawn.depth[nearest] / self.focal
    }

    /// Share of the body at a pixel, linear between the middles of cells.
    pub(super) fn coverage(&self, pixel: [u32; 2]) -> f32 {
        let stride = self.stride as f32;
        let at = pixel.map(|p| (p as f32 + 0.5) / stride - 0.5);
        let low = at.map(f32::floor);
        let on = |x: f32, y: f32| {
            let x = (x.max(0.0) as usize).min(self.width - 1);
            let y = (y.max(0.0) as usize).min(self.height - 1);
            f32::from(u8::from(
                self.drawn.face[y * self.width + x] != VisibilityBuffer::NONE,
            ))
        };
        let row = |y: f32| {
            let [a, b] = [on(low[0], y), on(low[0] + 1.0, y)];
            a + (b - a) * (at[0] - low[0])
        };
        let [a, b] = [row(low[1]), row(low[1] + 1.0)];
        a + (b - a) * (at[1] - low[1])
    }

    /// The body at or next to a cell.
    pub(super) fn at_cell(&self, i: usize) -> Option<NearBody> {
        let nearest = *self.nearest.get(i).filter(|n| **n != NONE)? as usize;
        Some(NearBody {
            face: self.drawn.face[nearest],
            depth: self.drawn.depth[nearest],
            is_on: nearest == i,
        })
    }

    /// Pixels of a picture of that size within the reach of the body; `None` without any.
    pub(super) fn bounds(&self, size: [u32; 2]) -> Option<Area> {
        let near = |i: &usize| self.nearest[*i] != NONE;
        let cells = || (0..self.nearest.len()).filter(near);
        let columns = || cells().map(|i| i % self.width);
        let rows = || cells().map(|i| i / self.width);
        let range = |from: Option<usize>, to: Option<usize>, side: u32| {
            let from = from? as u32 * self.stride;
            let to = ((to? as u32 + 1) * self.stride).min(side);
            Some((from, to.checked_sub(from).filter(|n| *n > 0)?))
        };
        let (left, width) = range(columns().min(), columns().max(), size[0])?;
        let (top, height) = range(rows().min(), rows().max(), size[1])?;
        Some(Area {
            left,
            top,
            width,
            height,
        })
    }

    /// Middle of a cell, pixels of the picture.
    pub(super) fn pixel(&self, cell: usize) -> [u32; 2] {
        [cell % self.width, cell / self.width].map(|c| c as u32 * self.stride + self.stride / 2)
    }

    /// Number of cells.
    pub(super) fn cells(&self) -> usize {
        self.width * self.height
    }
}

/// Segment that a face belongs to.
pub(super) fn segment(body: &BodyView<'_>, face: u32) -> Option<BodySegment> {
    let first = body.faces.get(face as usize)?[0];
    body.limbs.segments.get(first as usize).copied()
}

/// Unit normals of the posed vertices.
pub(super) fn normals(body: &BodyView<'_>, vertices: &[P3]) -> Vec<V3> {
    let mut sums = vec![V3::zeros(); vertices.len()];
    for f in body.faces {
        let [a, b, c] = f.map(|v| vertices[v as usize]);
        let n = (b - a).cross(&(c - a));
        f.iter().for_each(|v| sums[*v as usize] += n);
    }
    sums.iter()
        .map(|n| n.try_normalize(0.0).unwrap_or_default())
        .collect()
}
