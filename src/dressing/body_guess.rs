//! The body under a garment when its file does not say: scale, arms and place at which the cloth lies just above the skin.

use super::error::MeshGarmentError;
use super::file_frame::{FileFrame, bounds};
use super::settings::GuessSettings;
use nalgebra::{UnitQuaternion, Vector3};
use std::sync::Arc;
use tryon_body::{BodyShape, BoneTransforms, Pose, RestBody, SkinSearch, Template};
use tryon_geometry::math::{Body, P3, Rigid, V3, World, log_so3};

/// Scale, arms below the horizontal (rad), shift of the garment up and to the front (m).
type Guess = [f64; 4];

/// Frame in which the garment's vertices lie over the skin of `template`.
pub(super) fn locate(template: &Template, garment: &[P3], settings: &GuessSettings) -> FileFrame {
    let fit = GuessFit::new(template, garment, false, settings);
    fit.frame(&fit.minimise().1)
}

/// `template` scaled, with its arms turned, and the frame in which the garment's vertices lie over its skin.
///
/// # Errors
/// When no body lies near the garment.
pub(super) fn guess(
    template: &Template,
    garment: &[P3],
    settings: &GuessSettings,
) -> Result<(Arc<Template>, FileFrame), MeshGarmentError> {
    let fit = GuessFit::new(template, garment, true, settings);
    let (cost, q) = fit.minimise();
    if cost > settings.not_worn * settings.far {
        let why = "no body fits into it: is it worn, upright, y up, and facing +z?";
        return Err(MeshGarmentError::NotFound(why.into()));
    }
    let (vertices, bones) = fit.stand(&q);
    let made = template.at_rest("guessed", vertices, &bones.joints)?;
    Ok((Arc::new(made), fit.frame(&q)))
}

/// A garment and the body that is fitted under it.
struct GuessFit<'a> {
    settings: &'a GuessSettings,
    template: &'a Template,
    rest: RestBody,
    stature: f32,
    /// Scale and arms are unknowns too.
    free: bool,
    /// First frame of the garment, and samples of it there.
    start: FileFrame,
    points: Vec<P3>,
    /// The garment's lowest height in `start`, metres.
    lowest: f32,
}

impl<'a> GuessFit<'a> {
    fn new(
        template: &'a Template,
        garment: &[P3],
        free: bool,
        settings: &'a GuessSettings,
    ) -> Self {
        let (lo, hi) = bounds(garment.iter());
        let scale = FileFrame::unit_of((hi - lo).amax(), settings.extent).unwrap_or(1.0);
        // The person in a file may stand anywhere in a room.
        let middle = nalgebra::center(&lo, &hi).coords * scale;
        let aside = V3::new(middle.x, 0.0, middle.z);
        let start = FileFrame {
            scale,
            shift: if aside.norm() > settings.aside {
                -aside
            } else {
                V3::zeros()
            },
            ..FileFrame::metres()
        };
        let rest = template.personalise(&BodyShape::default());
        Self {
            settings,
            template,
            stature: rest.vertices.iter().map(|p| p.y).fold(0.0, f32::max),
            rest,
            free,
            start,
            points: garment
                .iter()
                .step_by(garment.len().div_ceil(settings.samples).max(1))
                .map(|p| start.to_metres(p))
                .collect(),
            lowest: lo.y * scale,
        }
    }
    fn frame(&self, q: &Guess) -> FileFrame {
        FileFrame {
            shift: self.start.shift + V3::new(0.0, q[2] as f32, q[3] as f32),
            ..self.start
        }
    }
    /// The template scaled, its arms turned if they are free: vertices and bones.
    fn stand(&self, q: &Guess) -> (Vec<P3>, BoneTransforms) {
        let (sk, rest, [scale, down, ..]) = (self.template.skeleton(), &self.rest, *q);
        let mut pose = Pose::rest(sk, Rigid::<World, Body>::identity());
        let arms = [("left", 1.0), ("right", -1.0)];
        for (side, sign) in arms.into_iter().filter(|_| self.free) {
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
    /// Mean distance of the cloth from its height over the skin, plus the prior, metres.
    fn cost(&self, q: &Guess) -> f32 {
        let (far, inside, above) = (self.settings.far, self.settings.inside, self.settings.above);
        let (vertices, _) = self.stand(q);
        let skin = SkinSearch::new(self.template, &vertices, 0.0);
        let shift = V3::new(0.0, q[2] as f32, q[3] as f32);
        let distance = |p: &P3| {
            let p = p + shift;
            let Some((near, d2)) = skin.nearest(&p, &V3::zeros(), self.settings.search) else {
                return far * inside;
            };
            if skin.height(&p, near) < 0.0 {
                (inside * d2.sqrt()).min(far * inside)
            } else {
                (d2.sqrt() - above).abs().min(far)
            }
        };
        let sum: f32 = self.points.iter().map(distance).sum();
        // A short body in a loose garment costs as little as a tall one in a tight one: the prior decides.
        // Files have the floor at zero, or zero at half the stature.
        let floor = q[2]
            .abs()
            .min((q[2] - q[0] * f64::from(self.stature) / 2.0).abs());
        let s = self.settings;
        let prior = ((q[0] - 1.0) / s.stature_spread).powi(2) + (floor / s.floor_spread).powi(2);
        sum / self.points.len().max(1) as f32 + self.settings.prior * prior as f32
    }
    /// Coordinate descent with halved steps: least cost and its guess.
    fn minimise(&self) -> (f32, Guess) {
        let settings = self.settings;
        let [scale, arms] = settings.start;
        let at = |up: f64| -> Guess { [scale, arms, up, 0.0] };
        let starts = [at(f64::from(self.stature) / 2.0), at(0.0)];
        let count = if self.lowest < self.settings.underground {
            1
        } else {
            2
        };
        let mut best = starts[..count]
            .iter()
            .map(|s| (self.cost(s), *s))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or_default();
        let mut step = settings.steps;
        for _ in 0..settings.halvings {
            for k in if self.free { 0..4 } else { 2..4 } {
                for sign in [-1.0, 1.0] {
                    loop {
                        let mut q = best.1;
                        q[k] += sign * step[k];
                        let within = |k: usize, [low, high]: [f64; 2]| (low..high).contains(&q[k]);
                        let inside = within(0, settings.scales) && within(1, settings.arms);
                        let c = if inside { self.cost(&q) } else { f32::MAX };
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

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;

    #[test]
    fn locate_finds_unit_and_shift_of_a_garment_that_is_an_offset_skin() {
        let (t, settings) = (embedded::template(), GuessSettings::default());
        let x = t.mesh().vertices();
        let normals = t.normals(x);
        let garment: Vec<P3> = (0..x.len())
            .filter(|i| (0.9..1.3).contains(&x[*i].y) && x[*i].x.abs() < 0.2)
            .map(|i| (x[i] + normals[i] * settings.above + V3::new(0.0, 0.0, 0.04)) * 1e3)
            .collect();
        let frame = locate(&t, &garment, &settings);
        assert_eq!(frame.scale, 0.001);
        let miss = frame.shift - V3::new(0.0, 0.0, -0.04);
        assert!(miss.norm() < 0.01, "{miss}");
    }

    #[test]
    fn a_garment_in_mid_air_has_no_body() {
        let corners = [[0.0, 4.0], [0.5, 4.0], [0.5, 4.4], [0.0, 4.4]];
        let garment = corners.map(|[x, y]| P3::new(x, y, 0.0));
        let e = guess(&embedded::template(), &garment, &GuessSettings::default())
            .expect_err("nobody is that tall");
        assert!(e.to_string().contains("no body fits"), "{e}");
    }
}
