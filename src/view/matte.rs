//! Matte of the captured scene over the garments: per-pixel evidence, occluder patches, soft edges along image edges.

use super::area::Area;
use super::config::Margins;
use super::coverage::PixelCoverage;
use super::evidence::Evidence;
use super::occluder::{FloodScratch, PatchCriteria, drop_specks};
use super::settings::MatteSettings;
use super::viewport::Viewport;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::par::{self, Par};

/// Largest colour difference.
const MAX_DIFFERENCE: usize = 3 * 255;
/// Least and greatest radius of the soft edge, output pixels.
const RADIUS_RANGE: [i32; 2] = [2, 8];
/// Radius above which every second pixel is sampled, output pixels.
const DENSE_RADIUS: i32 = 4;
/// Rows of the picture softened by one task.
const ROWS: usize = 8;

/// Matte of the drawn area and its scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct Matte {
    /// Evidence of each pixel, shape `[area]`.
    pub(crate) evidence: Vec<Evidence>,
    /// Share of each pixel that is in front of the garment, 0 to 1.
    pub(crate) alpha: Vec<f32>,
    patches: FloodScratch,
}

/// Captured picture and depth of the drawn area.
pub(crate) struct MatteInput<'a> {
    pub(crate) par: Par,
    pub(crate) margins: &'a Margins,
    pub(crate) settings: &'a MatteSettings,
    pub(crate) viewport: &'a Viewport,
    pub(crate) area: &'a Area,
    /// Median distance of the garments, metres.
    pub(crate) distance: f32,
    /// Captured picture at the output's size.
    pub(crate) guide: &'a ColorImage,
    /// Captured depth, metres, 0 = none; shape `[area]`.
    pub(crate) depth: &'a [f32],
    /// Coverage of each pixel, shape `[area]`, and the faces that are seen from inside.
    pub(crate) pixels: &'a [PixelCoverage],
    pub(crate) inner: &'a [bool],
}

impl Matte {
    /// Turns `evidence` into `alpha`; returns the number of pixels dropped as noise.
    pub(crate) fn decide(&mut self, input: &MatteInput<'_>) -> usize {
        let camera = &input.viewport.camera;
        let pixel_area = input.distance * input.distance / (camera.fx * camera.fy) as f32;
        let edge_distance = input.settings.edge_step * input.viewport.pixels_per_depth();
        let criteria = PatchCriteria {
            width: input.area.width as usize,
            smallest: (input.margins.patch / pixel_area).ceil() as usize,
            edge_distance: edge_distance.round().max(1.0) as usize,
            step: input.margins.step,
            smooth_share: input.margins.smooth_share,
            depth: input.depth,
        };
        let dropped = drop_specks(&mut self.evidence, &criteria, &mut self.patches);
        self.alpha.clear();
        self.alpha.resize(self.evidence.len(), 0.0);
        if self.evidence.iter().any(|e| e.is_front()) {
            let soft = SoftEdge::new(&self.evidence, input);
            let rows = input.area.width as usize * ROWS;
            par::for_chunks(input.par, &mut self.alpha, rows, |start, chunk| {
                (start..).zip(chunk).for_each(|(i, a)| *a = soft.alpha(i));
            });
        }
        dropped
    }
}

/// Joint bilateral vote: where evidence disagrees, neighbours are weighted by the likeness of their colour.
struct SoftEdge<'a> {
    evidence: &'a [Evidence],
    area: &'a Area,
    guide: &'a ColorImage,
    radius: i32,
    stride: usize,
    certain_share: f32,
    pixels: &'a [PixelCoverage],
    inner: &'a [bool],
    /// Depth between two sheets of cloth, metres.
    sheets_apart: f32,
    /// Weight by colour difference.
    weights: Vec<f32>,
}

impl<'a> SoftEdge<'a> {
    fn new(evidence: &'a [Evidence], input: &MatteInput<'a>) -> Self {
        let radius =
            (input.settings.edge_radius * input.viewport.pixels_per_depth()).round() as i32;
        let radius = radius.clamp(RADIUS_RANGE[0], RADIUS_RANGE[1]);
        Self {
            evidence,
            area: input.area,
            guide: input.guide,
            radius,
            certain_share: input.settings.certain_share,
            pixels: input.pixels,
            inner: input.inner,
            sheets_apart: input.settings.sheets_apart,
            stride: if radius > DENSE_RADIUS { 2 } else { 1 },
            weights: (0..=MAX_DIFFERENCE)
                .map(|d| (-(d as f32 / input.settings.color_scale).powi(2)).exp())
                .collect(),
        }
    }

    /// Share of pixel `i` that is in front of the garment.
    fn alpha(&self, i: usize) -> f32 {
        if self.evidence[i] == Evidence::Outside {
            return 0.0;
        }
        if self.is_mixed(i) {
            return self.vote(i);
        }
        if self.evidence[i].is_front() {
            1.0
        } else {
            0.0
        }
    }

    /// Two pixels show one sheet of cloth. At the end of a sheet, a hem or collar before what is inside, evidence changes with
    /// the garment, not with the captured picture.
    fn is_one_sheet(&self, i: usize, k: usize) -> bool {
        let (a, b) = (&self.pixels[i], &self.pixels[k]);
        let side = |p: &PixelCoverage| self.inner.get(p.face as usize);
        side(a) == side(b) && (a.depth - b.depth).abs() < self.sheets_apart
    }

    fn position(&self, i: usize) -> [i32; 2] {
        let width = self.area.width as i32;
        [i as i32 % width, i as i32 / width]
    }

    /// Evidence disagrees among centre, corners and side centres of the window.
    fn is_mixed(&self, i: usize) -> bool {
        let (width, height) = (self.area.width as i32, self.area.height as i32);
        let [x, y] = self.position(i);
        let (mut front, mut garment) = (false, self.evidence[i] == Evidence::Unknown);
        for dy in [-self.radius, 0, self.radius] {
            let row = (y + dy).clamp(0, height - 1) * width;
            for dx in [-self.radius, 0, self.radius] {
                let k = (row + (x + dx).clamp(0, width - 1)) as usize;
                let e = self.evidence[k];
                if e >= Evidence::Garment && self.is_one_sheet(i, k) {
                    front |= e.is_front();
                    garment |= e == Evidence::Garment;
                }
            }
        }
        front && garment
    }

    fn color(&self, x: i32, y: i32) -> [i32; 3] {
        let (u, v) = (x as u32 + self.area.left, y as u32 + self.area.top);
        self.guide.at(u, v).map(i32::from)
    }

    /// Weighted share of front pixels in the window, sharpened.
    fn vote(&self, i: usize) -> f32 {
        let (width, height) = (self.area.width as i32, self.area.height as i32);
        let [x, y] = self.position(i);
        let here = self.color(x, y);
        let (mut front, mut total) = (0.0, 0.0);
        for v in (y - self.radius..=y + self.radius).step_by(self.stride) {
            for u in (x - self.radius..=x + self.radius).step_by(self.stride) {
                if u < 0 || v < 0 || u >= width || v >= height {
                    continue;
                }
                let k = (v * width + u) as usize;
                let e = self.evidence[k];
                if e < Evidence::Garment || !self.is_one_sheet(i, k) {
                    continue;
                }
                let c = self.color(u, v);
                let difference: i32 = (0..3).map(|k| (c[k] - here[k]).abs()).sum();
                let w = self.weights[difference as usize];
                total += w;
                if e.is_front() {
                    front += w;
                }
            }
        }
        let share: f32 = if total > 0.0 { front / total } else { 0.0 };
        let certain = self.certain_share;
        ((share - certain) / (1.0 - 2.0 * certain)).clamp(0.0, 1.0)
    }
}
