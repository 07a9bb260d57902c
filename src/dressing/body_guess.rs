//! A body under a garment: scale, arms and place at which the cloth lies just above the skin.

use super::file_frame::{FileFrame, bounds};
use super::settings::GuessSettings;
use nalgebra::{UnitQuaternion, Vector3};
use tryon_body::{BodyShape, BoneTransforms, Pose, RestBody, SkinSearch, Template};
use tryon_geometry::math::{Body, P3, Rigid, V3, World, log_so3};

/// Scale, arms below the horizontal (rad), shift of the garment up and to the front (m).
pub(super) type Guess = [f64; 4];

/// A body that may have worn a garment.
pub(super) struct TriedBody<'a> {
    pub(super) settings: &'a GuessSettings,
    template: &'a Template,
    rest: RestBody,
    pub(super) stature: f32,
    /// Scale and arms are unknowns too.
    is_free: bool,
}

impl<'a> TriedBody<'a> {
    pub(super) fn new(template: &'a Template, is_free: bool, settings: &'a GuessSettings) -> Self {
        let rest = template.personalise(&BodyShape::default());
        Self {
            settings,
            template,
            stature: rest.vertices.iter().map(|p| p.y).fold(0.0, f32::max),
            rest,
            is_free,
        }
    }
    /// The guess from which a search starts, `up` metres above the file's zero.
    pub(super) fn start(&self, up: f64) -> Guess {
        let [scale, arms] = self.settings.start;
        [scale, arms, up, 0.0]
    }
    /// The template scaled, its arms turned if they are free: vertices and bones.
    pub(super) fn stand(&self, q: &Guess) -> (Vec<P3>, BoneTransforms) {
        let (sk, rest, [scale, down, ..]) = (self.template.skeleton(), &self.rest, *q);
        let mut pose = Pose::rest(sk, Rigid::<World, Body>::identity());
        let arms = [("left", 1.0), ("right", -1.0)];
        for (side, sign) in arms.into_iter().filter(|_| self.is_free) {
            let at = |n: &str| sk.index(&format!("{side}_{n}"));
            let (Some(j), Some(c)) = (at("shoulder"), at("elbow")) else {
                continue;
            };
            let arm = rest.joints[c] - rest.joints[j];
            let wanted = Vector3::new(sign * down.cos(), -down.sin(), 0.0);
            if let Some(q) = UnitQuaternion::rotation_between(&arm, &wanted) {
                pose.set(sk, &format!("{side}_shoulder"), log_so3(&q).as_slice());
            }
        }
        let mut bones = BoneTransforms::default();
        let mut out = Vec::new();
        self.template.skin_pose(rest, &pose, &mut bones, &mut out);
        out.iter_mut().for_each(|p| *p *= scale as f32);
        bones.joints.iter_mut().for_each(|p| *p *= scale);
        (out, bones)
    }
    /// Search of the skin of [`TriedBody::stand`].
    pub(super) fn skin<'s>(&'s self, vertices: &'s [P3]) -> SkinSearch<'s> {
        SkinSearch::new(self.template, vertices, 0.0)
    }
}

/// Samples of a garment around a wearer.
#[derive(Clone)]
pub(super) struct GarmentSamples {
    /// First frame of the garment, and samples of it there.
    pub(super) start: FileFrame,
    points: Vec<P3>,
}

impl GarmentSamples {
    /// About `count` vertices of a garment in a frame; one far from the file's zero is moved there.
    pub(super) fn new(
        garment: &[P3],
        mut frame: FileFrame,
        count: usize,
        settings: &GuessSettings,
    ) -> Self {
        // The person in a file may stand anywhere in a room.
        let (lo, hi) = bounds(garment.iter());
        let middle = frame.to_metres(&nalgebra::center(&lo, &hi));
        let aside = V3::new(middle.x, 0.0, middle.z);
        if aside.norm() > settings.aside {
            frame.shift -= aside;
        }
        let step = garment.len().div_ceil(count).max(1);
        Self {
            start: frame,
            points: garment
                .iter()
                .step_by(step)
                .map(|p| frame.to_metres(p))
                .collect(),
        }
    }
    /// Lowest and highest sample, metres.
    pub(super) fn heights(&self) -> [f32; 2] {
        let (lo, hi) = bounds(self.points.iter());
        [lo.y, hi.y]
    }
    /// The frame after a guess.
    pub(super) fn frame(&self, q: &Guess) -> FileFrame {
        FileFrame {
            shift: self.start.shift + V3::new(0.0, q[2] as f32, q[3] as f32),
            ..self.start
        }
    }
    /// Mean distance of the cloth from its height over a skin, metres; saturated.
    pub(super) fn distance(&self, wearer: &TriedBody<'_>, skin: &SkinSearch<'_>, q: &Guess) -> f32 {
        let s = wearer.settings;
        let shift = V3::new(0.0, q[2] as f32, q[3] as f32);
        let distance = |p: &P3| {
            let p = p + shift;
            let Some((near, d2)) = skin.nearest(&p, &V3::zeros(), s.search) else {
                return s.far * s.inside;
            };
            if skin.height(&p, near) < 0.0 {
                (s.inside * d2.sqrt()).min(s.far * s.inside)
            } else {
                (d2.sqrt() - s.above).abs().min(s.far)
            }
        };
        let sum: f32 = self.points.iter().map(distance).sum();
        sum / self.points.len().max(1) as f32
    }
    /// Distance plus prior, metres.
    pub(super) fn cost(&self, wearer: &TriedBody<'_>, q: &Guess) -> f32 {
        let (vertices, _) = wearer.stand(q);
        self.distance(wearer, &wearer.skin(&vertices), q) + prior(wearer, q)
    }
    /// Coordinate descent with halved steps: least cost and its guess.
    pub(super) fn minimise(&self, wearer: &TriedBody<'_>, start: Guess) -> (f32, Guess) {
        let settings = wearer.settings;
        let mut best = (self.cost(wearer, &start), start);
        let mut step = settings.steps;
        for _ in 0..settings.halvings {
            for k in if wearer.is_free { 0..4 } else { 2..4 } {
                for sign in [-1.0, 1.0] {
                    loop {
                        let mut q = best.1;
                        q[k] += sign * step[k];
                        let within = |k: usize, [low, high]: [f64; 2]| (low..high).contains(&q[k]);
                        let inside = within(0, settings.scales) && within(1, settings.arms);
                        let c = if inside {
                            self.cost(wearer, &q)
                        } else {
                            f32::MAX
                        };
                        if c >= best.0 {
                            break;
                        }
                        best = (c, q);
                    }
                }
            }
            step.iter_mut().for_each(|s| *s *= 0.5);
        }
        best
    }
}

/// Price of an unusual guess, metres: a short body in a loose garment costs as little as a tall one in a tight one.
pub(super) fn prior(wearer: &TriedBody<'_>, q: &Guess) -> f32 {
    let s = wearer.settings;
    // Files have the floor at zero, or zero at half the stature; a few have it anywhere.
    let half = q[0] * f64::from(wearer.stature) / 2.0;
    let floor = q[2].abs().min((q[2] - half).abs());
    let variances = (floor / s.floor_spread).powi(2);
    let floor = variances / (1.0 + variances / s.floor_cap);
    s.prior * (((q[0] - 1.0) / s.stature_spread).powi(2) + floor) as f32
}
