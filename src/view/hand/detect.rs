//! Detection of bare arms: skin-coloured cells grown from the tracked arm.

use super::grid::ArmGrid;
use super::sampling::{PosedLimbs, sample_and_fit};
use crate::area::{Area, NEAR};
use crate::arm::ArmAxis;
use crate::captured_pixels::CapturedPixels;
use crate::evidence::{Evidence, depth_sigma};
use crate::report::HandReport;
use crate::settings::BareArmSettings;
use crate::skin::{SkinClassifier, tone};
use crate::state::State;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::math::P3;

/// State of one cell during detection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Cell {
    #[default]
    Other,
    /// Skin-coloured, within reach of the arm.
    Skin,
    /// Skin next to the arm's axis.
    Seed,
    /// Part of a region.
    Taken,
}

/// Scratch of [`HandDetector::mark`].
#[derive(Clone, Debug, Default)]
pub(crate) struct HandDetector {
    cells: Vec<Cell>,
    /// Captured depth, metres, shape `[cells]`.
    depth: Vec<f32>,
    /// At the end of the reach, shape `[cells]`.
    is_far: Vec<bool>,
    stack: Vec<u32>,
    region: Vec<u32>,
}

/// Depths of garment and tracked trunk at a pixel of the drawn area, metres, infinity = none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerDepths {
    pub(crate) garment: f32,
    pub(crate) trunk: f32,
}

/// Input of [`HandDetector::mark`].
pub(crate) struct ArmScene<'a, F> {
    pub(crate) view: CapturedPixels<'a>,
    pub(crate) body: PosedLimbs<'a>,
    /// Vertices of the garments in the picture's camera, metres.
    pub(crate) garments: &'a [P3],
    pub(crate) area: &'a Area,
    pub(crate) settings: &'a BareArmSettings,
    /// Depths at column and row of the area.
    pub(crate) layers: F,
}

/// An arm and the end of the sleeve on it, in [`ArmCoordinates::along`](crate::arm::ArmCoordinates).
#[derive(Clone, Copy, Debug)]
struct BareArm {
    axis: ArmAxis,
    bare_from: f32,
}

impl HandDetector {
    /// Marks bare arms in front of their garment in `evidence`, shape `[area]`.
    pub(crate) fn mark<F: Fn(usize, usize) -> LayerDepths>(
        &mut self,
        state: &mut State,
        scene: &ArmScene<'_, F>,
        evidence: &mut [Evidence],
    ) -> HandReport {
        let mut report = HandReport::default();
        let body = &scene.body;
        if !body.limbs.fits(body.vertices.len()) {
            return report;
        }
        let axes = (body.limbs.arms.each_ref()).map(|a| a.axis(body.vertices));
        let grids = axes.map(|axis| scene.grid(&axis?, evidence));
        report.tested = grids.iter().flatten().count();
        report.skipped = grids.len() - report.tested;
        if report.tested == 0 {
            return report;
        }
        let Some(skin) = sample_and_fit(state, &scene.view, body, &axes, scene.settings) else {
            return report;
        };
        report.known = true;
        let arms = axes.map(|axis| {
            axis.map(|axis| BareArm {
                axis,
                bare_from: axis
                    .sleeve_end(scene.garments, scene.settings.sleeve_radius)
                    .max(scene.settings.elbow),
            })
        });
        for (side, grid) in grids.iter().enumerate() {
            let (Some(grid), Some(arm)) = (grid, &arms[side]) else {
                continue;
            };
            self.classify(grid, arm, arms[1 - side].as_ref(), &skin, scene);
            let pixels = self.mark_regions(grid, scene, evidence);
            report.pixels += pixels;
            if pixels > 0 {
                fill_unknown(grid, &skin, scene.view.image, scene.area, evidence);
            }
        }
        report
    }

    /// Finds the cells of skin colour within reach of the arm.
    fn classify<F>(
        &mut self,
        grid: &ArmGrid,
        arm: &BareArm,
        other: Option<&BareArm>,
        skin: &SkinClassifier,
        scene: &ArmScene<'_, F>,
    ) {
        let n = grid.len();
        self.cells.clear();
        self.depth.clear();
        self.is_far.clear();
        self.cells.resize(n, Cell::Other);
        self.depth.resize(n, 0.0);
        self.is_far.resize(n, false);
        let settings = *scene.settings;
        let (elbow, wrist) = (&arm.axis.elbow, &arm.axis.wrist);
        let nearest = (elbow.z - settings.forearm_reach)
            .min(wrist.z - settings.hand_reach)
            .max(NEAR);
        let farthest = (elbow.z + settings.forearm_reach).max(wrist.z + settings.hand_reach);
        let view = &scene.view;
        for i in 0..n {
            let (x, y) = grid.pixel(i);
            let (u, v) = (scene.area.left + x as u32, scene.area.top + y as u32);
            let z = view.metres(u, v);
            if z < nearest || z > farthest {
                continue;
            }
            let p = view.viewport.camera.unproject(u as f32, v as f32, z);
            let at = arm.axis.coordinates(&p);
            // Share of the reach.
            let out = (at.distance / settings.forearm_reach)
                .min((p - wrist).norm() / settings.hand_reach);
            if at.along < arm.bare_from || out > 1.0 || !skin.is_skin(&tone(view.image.at(u, v))) {
                continue;
            }
            // Skin under the other arm's sleeve belongs to that arm.
            let is_sleeved = other.is_some_and(|o| {
                let theirs = o.axis.coordinates(&p);
                theirs.along < o.bare_from && theirs.distance < at.distance
            });
            if is_sleeved {
                continue;
            }
            self.depth[i] = z;
            self.is_far[i] = out > settings.end;
            self.cells[i] = if at.distance < settings.seed_distance {
                Cell::Seed
            } else {
                Cell::Skin
            };
        }
    }

    /// Grows regions from the seeds and marks those that are hands; returns the number of pixels.
    fn mark_regions<F: Fn(usize, usize) -> LayerDepths>(
        &mut self,
        grid: &ArmGrid,
        scene: &ArmScene<'_, F>,
        evidence: &mut [Evidence],
    ) -> usize {
        let width = scene.area.width as usize;
        let pixels = grid.step as f64 / scene.view.viewport.pixels_per_depth();
        let smallest = (scene.settings.smallest / grid.cell_area).ceil() as usize;
        let mut marked = 0;
        for seed in 0..self.cells.len() {
            if self.cells[seed] != Cell::Seed {
                continue;
            }
            let far = self.grow(grid, seed, scene.settings.step * pixels.max(1.0) as f32);
            let size = self.region.len();
            if size < smallest || far as f32 > scene.settings.leak * size as f32 {
                continue;
            }
            if !self.is_in_front(grid, scene, evidence) {
                continue;
            }
            let cells = self.region.iter();
            for (x, y) in cells.flat_map(|&i| grid.cell_pixels(i as usize)) {
                let mark = &mut evidence[y * width + x];
                if *mark != Evidence::Outside {
                    *mark = Evidence::Limb;
                    marked += 1;
                }
            }
        }
        marked
    }

    /// Collects the connected region of `seed`; returns the number of its cells at the end of the reach.
    fn grow(&mut self, grid: &ArmGrid, seed: usize, step: f32) -> usize {
        self.region.clear();
        self.stack.clear();
        self.stack.push(seed as u32);
        self.cells[seed] = Cell::Taken;
        let mut far = 0;
        while let Some(cell) = self.stack.pop() {
            self.region.push(cell);
            let i = cell as usize;
            far += usize::from(self.is_far[i]);
            let z = self.depth[i];
            for j in grid.neighbours(i) {
                let is_joined = (self.depth[j] - z).abs() < step + depth_sigma(z);
                if matches!(self.cells[j], Cell::Skin | Cell::Seed) && is_joined {
                    self.cells[j] = Cell::Taken;
                    self.stack.push(j as u32);
                }
            }
        }
        far
    }

    /// Majority of the region's covered cells in front of garment and trunk. One decision for the whole region: single
    /// pixels would flicker with the noise.
    fn is_in_front<F: Fn(usize, usize) -> LayerDepths>(
        &self,
        grid: &ArmGrid,
        scene: &ArmScene<'_, F>,
        evidence: &[Evidence],
    ) -> bool {
        let width = scene.area.width as usize;
        let BareArmSettings { loose, behind, .. } = *scene.settings;
        let (mut covered, mut front) = (0, 0);
        for &i in &self.region {
            let (x, y) = grid.pixel(i as usize);
            if evidence[y * width + x] != Evidence::Outside {
                let (layers, z) = ((scene.layers)(x, y), self.depth[i as usize]);
                covered += 1;
                front += i32::from(z - layers.garment < loose && z < layers.trunk + behind);
            }
        }
        2 * front >= covered
    }
}

impl<F> ArmScene<'_, F> {
    /// The grid around an arm; `None` if no garment is near it.
    fn grid(&self, axis: &ArmAxis, evidence: &[Evidence]) -> Option<ArmGrid> {
        let grid = ArmGrid::around(axis, self.view.viewport, self.area, self.settings)?;
        let width = self.area.width as usize;
        let is_garment = |(x, y): (usize, usize)| evidence[y * width + x] != Evidence::Outside;
        (0..grid.len())
            .any(|i| is_garment(grid.pixel(i)))
            .then_some(grid)
    }
}

/// Turns unknown pixels without skin colour into garment: depth sensors are blind beside a hand.
fn fill_unknown(
    grid: &ArmGrid,
    skin: &SkinClassifier,
    image: &ColorImage,
    area: &Area,
    evidence: &mut [Evidence],
) {
    for (x, y) in (0..grid.len()).flat_map(|i| grid.cell_pixels(i)) {
        let mark = &mut evidence[y * area.width as usize + x];
        let (u, v) = (area.left + x as u32, area.top + y as u32);
        if *mark == Evidence::Unknown && !skin.is_skin(&tone(image.at(u, v))) {
            *mark = Evidence::Garment;
        }
    }
}
