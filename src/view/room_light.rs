//! Light of the room from the captured person: its direction and colour, as a linear function of the normal.
//!
//! A surface of albedo ρ in distant light looks like ρ (1 + k·n) to first order (Ramamoorthi & Hanrahan 2001). Each part of the
//! body has an albedo of its own; one k for each channel explains them all.

use super::captured_pixels::CapturedPixels;
use super::config::Config;
use super::input::BodyView;
use super::room_level;
use super::settings::RoomLightSettings;
use super::srgb::linear;
use nalgebra::{Matrix4, Vector4};
use serde::{Deserialize, Serialize};
use tryon_body::parts::BodyPart;
use tryon_geometry::math::{P3, V3};

/// Parts of the body with an albedo of their own: trunk with the head, arms, legs.
const REGIONS: usize = 3;
/// Least factor of the mean that the albedos left: a fit that goes astray divides by no less.
const LEAST_MEAN: f32 = 0.2;
/// Rounds of albedo and light in turns, each with new weights.
const ROUNDS: usize = 8;

/// Square of the light on a side that the room's light would leave black.
const LEAST_LIGHT: f32 = 0.02;

/// Linear light with a smooth end: no side is without any.
#[inline]
pub(crate) fn lit(e: f32) -> f32 {
    0.5 * (e + (e * e + LEAST_LIGHT).sqrt())
}

/// Light of a room by channel: the mean, times 1 + slope·n on a surface of normal n (picture's camera).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RoomLight {
    /// Light on a white surface towards the camera, 1 = it comes out white; `None` where too little surrounds the person.
    #[serde(default)]
    pub level: Option<[f32; 3]>,
    /// Change with the normal over the mean, for red, green and blue: each vector points to where that colour comes from.
    pub slope: [[f32; 3]; 3],
}

/// A lit patch of the body.
#[derive(Clone, Copy, Debug)]
struct LitPatch {
    normal: V3,
    /// Linear light.
    color: [f32; 3],
    region: usize,
}

impl RoomLight {
    /// Light of the tracked body's captured colours; `None` with too few of them, or all alike.
    pub(crate) fn measure(
        captured: &CapturedPixels<'_>,
        body: &BodyView<'_>,
        vertices: &[P3],
        config: &Config,
    ) -> Option<Self> {
        let patches = patches(captured, body, vertices, &config.room_light);
        let level = room_level::measure(captured, vertices, &body.limbs.face, &config.room_level);
        let light = Self::fit(&patches, &config.room_light)?;
        Some(Self { level, ..light })
    }

    fn fit(patches: &[LitPatch], settings: &RoomLightSettings) -> Option<Self> {
        if patches.len() < settings.least_patches {
            return None;
        }
        let slope = [0, 1, 2].map(|c| V3::from(fit_channel(patches, c, settings)));
        // Lamps differ in direction more than in colour, and prints in colour.
        let mean = (slope[0] + slope[1] + slope[2]) / 3.0;
        let slope = slope.map(|s| (mean + (s - mean) * settings.tint).into());
        let is_finite = slope.iter().flatten().all(|v: &f32| v.is_finite());
        is_finite.then_some(Self { level: None, slope })
    }

    /// Light on a surface of normal `n` over the mean, by channel.
    pub(crate) fn relative(&self, n: &V3) -> [f32; 3] {
        self.slope.map(|k| lit(1.0 + V3::from(k).dot(n)))
    }

    /// This light after `seconds` of another.
    pub(crate) fn toward(&self, other: &Self, seconds: f32, settings: &RoomLightSettings) -> Self {
        let share = settings.share(seconds);
        let mix = |a: [f32; 3], b: [f32; 3]| [0, 1, 2].map(|k| a[k] + (b[k] - a[k]) * share);
        Self {
            level: match (self.level, other.level) {
                (Some(a), Some(b)) => Some(mix(a, b)),
                (old, new) => new.or(old),
            },
            slope: [0, 1, 2].map(|c| mix(self.slope[c], other.slope[c])),
        }
    }
}

impl RoomLightSettings {
    /// Share of something new after a time, seconds.
    pub(crate) fn share(&self, seconds: f32) -> f32 {
        1.0 - (-seconds.max(0.0) / self.memory).exp()
    }
}

/// Patches of the body's surface that the camera sees.
fn patches(
    captured: &CapturedPixels<'_>,
    body: &BodyView<'_>,
    vertices: &[P3],
    settings: &RoomLightSettings,
) -> Vec<LitPatch> {
    let step = (body.faces.len() / settings.most_patches).max(1);
    let patch = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| vertices[v as usize].coords);
        let centre = (a + b + c) / 3.0;
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0)?;
        let facing = -normal.dot(&centre) / centre.norm();
        if !(facing > settings.least_facing) {
            return None;
        }
        let (rgb, depth) = captured.at(&P3::from(centre))?;
        // The skin, or cloth over it, and not something in between.
        if !(depth > 0.0 && (depth - centre.z).abs() < settings.most_apart) {
            return None;
        }
        let brightest = rgb.iter().max().copied().unwrap_or(0);
        let is_exposed = (settings.exposed[0]..=settings.exposed[1]).contains(&brightest);
        is_exposed.then(|| LitPatch {
            normal,
            color: rgb.map(linear),
            region: region(body, f[0]),
        })
    };
    body.faces.iter().step_by(step).filter_map(patch).collect()
}

/// Number of a vertex's part among those with an albedo of their own.
fn region(body: &BodyView<'_>, vertex: u32) -> usize {
    match body.limbs.part(vertex) {
        Some(BodyPart::LeftArm | BodyPart::RightArm) => 1,
        Some(BodyPart::LeftLeg | BodyPart::RightLeg) => 2,
        _ => 0,
    }
}

/// k of one channel: albedos by region and the slope in turns, weighted against folds, prints and hair.
fn fit_channel(patches: &[LitPatch], c: usize, settings: &RoomLightSettings) -> [f32; 3] {
    let prior = V3::from(settings.prior);
    let mut slope = prior;
    let mut albedo = [0.0f32; REGIONS];
    let mut weights = vec![1.0f32; patches.len()];
    for round in 0..ROUNDS {
        let light = |p: &LitPatch| (1.0 + slope.dot(&p.normal)).max(settings.least_light);
        let mut sums = [[0.0f32; 2]; REGIONS];
        for (p, w) in patches.iter().zip(&weights) {
            let e = light(p);
            sums[p.region][0] += w * e * p.color[c];
            sums[p.region][1] += w * e * e;
        }
        for (a, [num, den]) in albedo.iter_mut().zip(sums) {
            *a = if den > 0.0 { num / den } else { 0.0 };
        }
        // Least squares of ratio = 1 + d + k·n with a ridge to the prior; d takes up what the albedos left.
        let mut normal = Matrix4::<f32>::zeros();
        let mut right = Vector4::<f32>::zeros();
        for (p, w) in patches.iter().zip(weights.iter_mut()) {
            if albedo[p.region] <= 0.0 {
                continue;
            }
            let ratio = p.color[c] / albedo[p.region];
            if round > 0 {
                let off = (ratio - light(p)) / settings.spread;
                *w = 1.0 / (1.0 + off * off).powi(2);
            }
            let row = Vector4::new(1.0, p.normal.x, p.normal.y, p.normal.z);
            normal += row * row.transpose() * *w;
            right += row * ((ratio - 1.0) * *w);
        }
        let ridge = settings.ridge * patches.len() as f32;
        for k in 0..3 {
            normal[(k + 1, k + 1)] += ridge;
            right[k + 1] += ridge * prior[k];
        }
        let Some(x) = normal.cholesky().map(|n| n.solve(&right)) else {
            break;
        };
        slope = V3::new(x[1], x[2], x[3]) / (1.0 + x[0]).max(LEAST_MEAN);
        let length = slope.norm();
        if length > settings.most_slope {
            slope *= settings.most_slope / length;
        }
    }
    slope.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Patches of three albedos on a half sphere towards the camera, in a light of this slope.
    fn lit(slope: V3) -> Vec<LitPatch> {
        let patch = |k: usize| {
            let (a, h) = (k as f32 * 2.4, (k % 97) as f32 / 97.0);
            let r = (1.0 - h * h).sqrt();
            let normal = V3::new(r * a.cos(), r * a.sin(), -h);
            let region = k % 3;
            let albedo = [0.6, 0.25, 0.05][region];
            // Every fifth is a fold or a print.
            let odd = if k.is_multiple_of(5) { 0.5 } else { 1.0 };
            let e = albedo * odd * (1.0 + slope.dot(&normal)).max(0.0);
            LitPatch {
                normal,
                color: [e, 0.8 * e, 0.6 * e],
                region,
            }
        };
        (0..900).map(patch).collect()
    }

    #[test]
    fn the_slope_of_a_known_light_is_found() {
        let settings = RoomLightSettings::default();
        for slope in [V3::new(0.5, -0.3, -0.2), V3::new(-0.4, -0.5, -0.1)] {
            let light = RoomLight::fit(&lit(slope), &settings).expect("a light");
            for found in light.slope.map(V3::from) {
                assert!(
                    found.angle(&slope).to_degrees() < 12.0,
                    "{found:?} {slope:?}"
                );
            }
        }
    }

    #[test]
    fn too_little_to_see_is_no_light_and_a_light_is_approached_in_time() {
        let settings = RoomLightSettings::default();
        assert_eq!(RoomLight::fit(&lit(V3::x())[..10], &settings), None);
        let [from, to] = [0.0, 0.5].map(|x| RoomLight {
            level: Some([x; 3]),
            slope: [[x, 0.0, 0.0]; 3],
        });
        let after = from.toward(&to, settings.memory, &settings);
        assert!((after.slope[0][0] - 0.5 * (1.0 - (-1f32).exp())).abs() < 1e-6);
        assert_eq!(after.level, Some([after.slope[0][0]; 3]));
        assert_eq!(from.toward(&to, 0.0, &settings), from);
        let unknown = RoomLight { level: None, ..to };
        assert_eq!(from.toward(&unknown, 9.0, &settings).level, from.level);
        assert_eq!(unknown.toward(&from, 9.0, &settings).level, from.level);
    }
}
