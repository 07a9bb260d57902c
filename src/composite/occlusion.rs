//! What is in front of the garments: evidence by pixel, then by area, then a soft edge along the picture's own edges.
//!
//! Depth alone decides badly: the sensor's noise at 3 m is as large as the gap between chest and shirt. So a pixel may
//! hide a garment only together with its neighbours: a connected patch, large enough, part of which is clearly in
//! front. Under the garment the tracked body says how far the shopper's own clothes may bulge.

use super::framing::Stage;
use super::surface::Area;
use crate::camera::ColorImage;
use crate::par::{self, Par};
use serde::{Deserialize, Serialize};

/// When a captured pixel hides a garment. All lengths in metres, on top of twice the sensor's noise at that depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Margins {
    /// In front of the garment by this much, when nothing is known about the body.
    pub plain: f32,
    /// The same where the tracked body itself is in front (an arm).
    pub limb: f32,
    /// The same where the tracked body lies under the garment: own clothes and hair bulge by this much.
    pub covered: f32,
    /// The same for the inner side of a garment, which is behind the body wherever there is a body.
    pub inner: f32,
    /// Somewhere a patch must be in front by this much more, else it is taken for bulging clothes.
    pub clear: f32,
    /// An occluder's edge is a step of at least this in the captured depth, on top of the noise.
    pub step: f32,
    /// Patches smaller than this are noise, square metres.
    pub patch: f32,
}

impl Default for Margins {
    fn default() -> Self {
        Self {
            plain: 0.012,
            limb: 0.004,
            covered: 0.035,
            inner: 0.004,
            clear: 0.012,
            step: 0.012,
            patch: 6e-4,
        }
    }
}

/// Standard deviation of a structured-light depth sensor at depth `z`, metres (Nguyen, Izadi, Lovell 2012).
pub(crate) fn noise(z: f32) -> f32 {
    0.0012 + 0.0019 * (z - 0.4).powi(2)
}

/// What a pixel says about what is in front of the garment there.
pub(crate) mod says {
    /// No garment here.
    pub(crate) const OUTSIDE: u8 = 0;
    /// No reading and nothing known.
    pub(crate) const UNKNOWN: u8 = 1;
    /// The garment is in front.
    pub(crate) const GARMENT: u8 = 2;
    /// Something is in front of the garment.
    pub(crate) const FRONT: u8 = 3;
    /// Something is clearly in front of the garment.
    pub(crate) const CLEAR: u8 = 4;
    /// The tracked body says so too: an arm.
    pub(crate) const LIMB: u8 = 5;
}

/// One pixel of the drawn area, as the decision sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// Garment depth, metres; infinity = no garment.
    pub(crate) garment: f32,
    /// Garment seen from inside.
    pub(crate) inner: bool,
    /// Captured depth, metres; 0 = none.
    pub(crate) captured: f32,
    /// Tracked body's depth, metres; infinity = not on the body.
    pub(crate) body: f32,
    /// There is a tracked body at all.
    pub(crate) tracked: bool,
}

/// The tracked body is in front of the garment when it is so by this much, metres; below that it is the body under
/// the garment touching it.
const LIMB_GAP: f32 = 0.02;

/// The decision for one pixel by itself.
#[inline]
pub(crate) fn evidence(m: &Margins, s: &Seen) -> u8 {
    if s.garment == f32::INFINITY {
        return says::OUTSIDE;
    }
    let limb = s.body < s.garment - LIMB_GAP;
    if s.captured <= 0.0 {
        // The far side of a sleeve's end lies behind the tracked arm and beside the real one: colours decide there.
        return if limb && !s.inner {
            says::LIMB
        } else {
            says::UNKNOWN
        };
    }
    let margin = if s.inner {
        m.inner
    } else if limb {
        m.limb
    } else if s.tracked && s.body < f32::INFINITY {
        m.covered
    } else {
        m.plain
    };
    let gap = s.garment - s.captured - margin - 2.0 * noise(s.captured);
    match () {
        () if gap <= 0.0 => says::GARMENT,
        () if limb || s.inner => says::LIMB,
        () if gap > m.clear => says::CLEAR,
        () => says::FRONT,
    }
}

/// A patch with a smaller share of its edge (against the garment) on a step of depth belongs to the body below.
const SMOOTH_SHARE: f32 = 0.35;
/// Distance from a patch's edge at which depths are compared, depth pixels: flying pixels lie in between.
const EDGE_STEP: f64 = 3.0;

/// Scratch of [`Matte::decide`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Matte {
    /// What each pixel says, shape `[area]`.
    pub(crate) says: Vec<u8>,
    /// Share of each pixel that is in front of the garment, 0 to 1.
    pub(crate) alpha: Vec<f32>,
    visited: Vec<bool>,
    stack: Vec<u32>,
    patch: Vec<u32>,
}

/// Colour difference (sum over channels) at which a neighbour's word counts e⁻¹.
const COLOR_SCALE: f32 = 48.0;
/// Radius of the soft edge in depth pixels: the misalignment of depth and colour edges that it must bridge.
const EDGE_RADIUS: f64 = 3.0;
/// More than this many output pixels of radius are sampled every second pixel.
const DENSE_RADIUS: i32 = 4;

impl Matte {
    /// Turns `self.says` into `self.alpha`; returns how many pixels were dropped as noise.
    pub(crate) fn decide(
        &mut self,
        par: Par,
        margins: &Margins,
        stage: &Stage,
        area: &Area,
        distance: f32,
        guide: &ColorImage,
        depth: &[f32],
    ) -> usize {
        let pixel = distance * distance / (stage.camera.fx * stage.camera.fy) as f32;
        let step = (EDGE_STEP * stage.pixels_per_depth()).round().max(1.0) as usize;
        let smallest = (margins.patch / pixel).ceil() as usize;
        let dropped = self.drop_specks(area.width as usize, smallest, step, margins.step, depth);
        self.soften(par, stage, area, guide);
        dropped
    }

    /// Removes connected patches of front pixels that are too small, nowhere clearly in front, or that run smoothly
    /// into what the garment covers: an arm ends in a step of depth, a bulging belly does not.
    fn drop_specks(
        &mut self,
        width: usize,
        smallest: usize,
        step: usize,
        jump: f32,
        depth: &[f32],
    ) -> usize {
        let n = self.says.len();
        self.visited.clear();
        self.visited.resize(n, false);
        let mut dropped = 0;
        for seed in 0..n {
            if self.says[seed] < says::FRONT || self.visited[seed] {
                continue;
            }
            self.patch.clear();
            self.stack.clear();
            self.stack.push(seed as u32);
            self.visited[seed] = true;
            let (mut clear, mut limb) = (false, 0usize);
            let (mut edges, mut steps) = (0usize, 0usize);
            while let Some(i) = self.stack.pop() {
                self.patch.push(i);
                let i = i as usize;
                clear |= self.says[i] >= says::CLEAR;
                limb += usize::from(self.says[i] == says::LIMB);
                let x = i % width;
                let beside = [
                    (x > 0).then(|| i - 1),
                    (x + 1 < width).then(|| i + 1),
                    i.checked_sub(width),
                    (i + width < n).then(|| i + width),
                ];
                for (side, j) in beside
                    .into_iter()
                    .enumerate()
                    .filter_map(|(s, j)| Some((s, j?)))
                {
                    if self.says[j] == says::GARMENT {
                        // Compare a little away from the edge on both sides: the sensor blurs it.
                        let away = if side < 2 { step } else { step * width };
                        let (out, inward) = if side % 2 == 0 {
                            (j.checked_sub(away), i.checked_add(away))
                        } else {
                            (j.checked_add(away), i.checked_sub(away))
                        };
                        let at =
                            |k: Option<usize>| k.and_then(|k| depth.get(k)).copied().unwrap_or(0.0);
                        let (behind, front) = (at(out), at(inward));
                        edges += 1;
                        // No reading beside the edge is the shadow that a step throws.
                        steps += usize::from(
                            behind == 0.0 || (front > 0.0 && behind - front > jump + noise(behind)),
                        );
                    }
                    if self.says[j] >= says::FRONT && !self.visited[j] {
                        self.visited[j] = true;
                        self.stack.push(j as u32);
                    }
                }
            }
            let smooth =
                (steps as f32) < SMOOTH_SHARE * edges as f32 && 3 * limb < self.patch.len();
            if !clear || smooth || self.patch.len() < smallest {
                dropped += self.patch.len();
                for &i in &self.patch {
                    self.says[i as usize] = says::GARMENT;
                }
            }
        }
        dropped
    }

    /// Where the neighbourhood disagrees, each neighbour votes with the likeness of its colour.
    fn soften(&mut self, par: Par, stage: &Stage, area: &Area, guide: &ColorImage) {
        let radius = ((EDGE_RADIUS * stage.pixels_per_depth()).round() as i32).clamp(2, 8);
        let step = if radius > DENSE_RADIUS { 2 } else { 1 };
        let (width, height) = (area.width as i32, area.height as i32);
        let says = &self.says;
        let table: Vec<f32> = (0..=765)
            .map(|d| (-(d as f32 / COLOR_SCALE).powi(2)).exp())
            .collect();
        let any_front = says.iter().any(|s| *s >= says::FRONT);
        self.alpha.clear();
        self.alpha.resize(says.len(), 0.0);
        if !any_front {
            return;
        }
        let color = |x: i32, y: i32| {
            let i = 3
                * ((y + area.top as i32) as usize * guide.width() as usize
                    + (x + area.left as i32) as usize);
            let c = &guide.data()[i..i + 3];
            [i32::from(c[0]), i32::from(c[1]), i32::from(c[2])]
        };
        par::for_chunks(
            par,
            &mut self.alpha,
            area.width as usize * 8,
            |start, chunk| {
                for (k, alpha) in chunk.iter_mut().enumerate() {
                    let i = start + k;
                    if says[i] == says::OUTSIDE {
                        continue;
                    }
                    let (x, y) = (i as i32 % width, i as i32 / width);
                    // Corners and centre of the window first: most windows agree, and then that is the answer.
                    let at = |dx: i32, dy: i32| {
                        let (u, v) = ((x + dx).clamp(0, width - 1), (y + dy).clamp(0, height - 1));
                        says[(v * width + u) as usize]
                    };
                    let (mut front, mut garment) = (false, false);
                    for (dx, dy) in [
                        (0, 0),
                        (-1, -1),
                        (1, -1),
                        (-1, 1),
                        (1, 1),
                        (0, -1),
                        (0, 1),
                        (-1, 0),
                        (1, 0),
                    ] {
                        let s = at(dx * radius, dy * radius);
                        front |= s >= says::FRONT;
                        garment |= s == says::GARMENT;
                    }
                    if !(front && (garment || says[i] == says::UNKNOWN)) {
                        *alpha = if says[i] >= says::FRONT { 1.0 } else { 0.0 };
                        continue;
                    }
                    let here = color(x, y);
                    let (mut sum, mut total) = (0.0, 0.0);
                    let mut dy = -radius;
                    while dy <= radius {
                        let mut dx = -radius;
                        while dx <= radius {
                            let (u, v) = (x + dx, y + dy);
                            dx += step;
                            if u < 0 || v < 0 || u >= width || v >= height {
                                continue;
                            }
                            let s = says[(v * width + u) as usize];
                            if s < says::GARMENT {
                                continue;
                            }
                            let c = color(u, v);
                            let d = (c[0] - here[0]).abs()
                                + (c[1] - here[1]).abs()
                                + (c[2] - here[2]).abs();
                            let w = table[d as usize];
                            total += w;
                            if s >= says::FRONT {
                                sum += w;
                            }
                        }
                        dy += step;
                    }
                    // Sharpened: half-way votes are edges, not half-transparent arms.
                    let t: f32 = if total > 0.0 { sum / total } else { 0.0 };
                    *alpha = ((t - 0.25) * 2.0).clamp(0.0, 1.0);
                }
            },
        );
    }
}
