//! Light on cloth: sky and floor, one key lamp, folds, the inside.

use super::look::ToSrgb;
use super::surface::Surface;
use crate::camera::Intrinsics;
use crate::math::V3;
use serde::{Deserialize, Serialize};

/// Light in the room, in units in which a white wall facing the camera comes out as about 0.9.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lights {
    /// Direction of "up" in the camera's frame; the default suits a level camera.
    pub up: [f32; 3],
    /// Light from above (ceiling).
    pub sky: f32,
    /// Light from below (floor).
    pub ground: f32,
    /// Towards the key lamp, camera frame.
    pub key_direction: [f32; 3],
    /// Strength of the key lamp.
    pub key: f32,
    /// What is left of the light on the inner side (neck hole, sleeve ends).
    pub inside: f32,
    /// How dark a garment makes what lies right behind its edge, and an arm the cloth beside it; 0 = no shadows.
    pub contact: f32,
}

impl Default for Lights {
    fn default() -> Self {
        Self {
            up: [0.0, -1.0, 0.0],
            sky: 0.62,
            ground: 0.30,
            key_direction: [-0.45, -0.65, -0.62],
            key: 0.55,
            inside: 0.42,
            contact: 0.4,
        }
    }
}

/// Light still reaches this far around the terminator (cosine): cloth scatters it.
const WRAP: f32 = 0.25;
/// Exponent of the sheen of satin.
const SHEEN_POWER: i32 = 16;
/// Sheen of satin at its brightest.
const SHEEN: f32 = 0.25;

/// Everything shading reads.
pub(crate) struct Shader<'a> {
    pub(crate) surface: &'a Surface,
    pub(crate) camera: Intrinsics,
    pub(crate) to_srgb: &'a ToSrgb,
    lights: Lights,
    up: V3,
    key: V3,
    brightness: f32,
}

/// The last face, since neighbours mostly share it: corner weights are `ray · gradient`.
#[derive(Clone, Copy)]
pub(crate) struct Cache {
    face: u32,
    gradient: [V3; 3],
}

impl Default for Cache {
    fn default() -> Self {
        Self { face: u32::MAX, gradient: [V3::zeros(); 3] }
    }
}

impl<'a> Shader<'a> {
    pub(crate) fn new(
        surface: &'a Surface,
        camera: Intrinsics,
        to_srgb: &'a ToSrgb,
        lights: &Lights,
        brightness: f32,
    ) -> Self {
        let unit = |d: [f32; 3]| V3::from(d).try_normalize(0.0).unwrap_or_else(|| V3::new(0.0, -1.0, 0.0));
        Self {
            surface,
            camera,
            to_srgb,
            lights: *lights,
            up: unit(lights.up),
            key: unit(lights.key_direction),
            brightness,
        }
    }

    /// sRGB (0 to 255) of a face seen at picture position (u, v); `shadow` is the share of light taken away.
    #[inline]
    pub(crate) fn color(&self, cache: &mut Cache, face: u32, u: f32, v: f32, shadow: f32) -> [f32; 3] {
        let s = self.surface;
        let f = s.faces[face as usize].map(|i| i as usize);
        if cache.face != face {
            let [a, b, c] = f.map(|i| s.vertices[i].coords);
            *cache = Cache { face, gradient: [b.cross(&c), c.cross(&a), a.cross(&b)] };
        }
        let ray = self.camera.unproject(u, v, 1.0).coords;
        let w = cache.gradient.map(|g| g.dot(&ray));
        // Samples lie inside up to rounding; a pixel's centre may not, and then the nearest edge is meant.
        let sum = w[0] + w[1] + w[2];
        let w = w.map(|w| (w / sum).max(0.0));
        let sum = w[0] + w[1] + w[2];
        let w = if sum > 0.0 { w.map(|w| w / sum) } else { [1.0, 0.0, 0.0] };

        let blend = |k: fn(&Surface, usize) -> f32| (0..3).map(|c| w[c] * k(s, f[c])).sum::<f32>();
        let n = s.normals[f[0]] * w[0] + s.normals[f[1]] * w[1] + s.normals[f[2]] * w[2];
        let n = n.try_normalize(0.0).unwrap_or_else(|| -ray.normalize());
        let inner = s.inner[face as usize];
        let n = if inner { -n } else { n };
        let eye = -ray.normalize();
        let open = blend(|s, i| s.openness[i]);

        let z = blend(|s, i| s.vertices[i].z);
        let facing = n.dot(&eye).abs().max(0.2);
        let footprint = z / (self.camera.fx as f32 * facing);
        let fabric = &s.fabrics[usize::from(s.garment[face as usize])];
        let uv = [blend(|s, i| s.uv[i][0]), blend(|s, i| s.uv[i][1])];
        let albedo = fabric.albedo(uv, footprint);

        let l = &self.lights;
        let hemi = l.ground + (l.sky - l.ground) * 0.5 * (1.0 + n.dot(&self.up));
        let key = ((n.dot(&self.key) + WRAP) / (1.0 + WRAP)).max(0.0) * l.key;
        let half = (self.key + eye).normalize();
        let sheen = if fabric.gloss > 0.0 {
            fabric.gloss * SHEEN * n.dot(&half).max(0.0).powi(SHEEN_POWER) * l.key
        } else {
            0.0
        };
        let side = if inner { l.inside } else { 1.0 };
        let gain = self.brightness * side * (1.0 - shadow);
        let diffuse = (hemi * open + key * open.min(1.0)) * gain;
        albedo.map(|a| self.to_srgb.get(a * diffuse + sheen * gain))
    }
}
