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
            sky: 0.66,
            ground: 0.36,
            key_direction: [-0.35, -0.62, -0.70],
            key: 0.52,
            inside: 0.42,
            contact: 0.4,
        }
    }
}

/// Light still reaches this far around the terminator (cosine): cloth scatters it.
const WRAP: f32 = 0.25;
/// A surface is taken to be seen at no flatter angle than this (cosine), or patterns would fade to nothing at edges.
const GRAZING: f32 = 0.2;
/// Exponent of the sheen of satin.
const SHEEN_POWER: i32 = 16;
/// Sheen of satin at its brightest.
const SHEEN: f32 = 0.25;

/// Everything shading reads.
pub(crate) struct Shader<'a> {
    pub(crate) surface: &'a Surface,
    pub(crate) camera: Intrinsics,
    pub(crate) to_srgb: &'a ToSrgb,
    pub(crate) lights: Lights,
    pub(crate) up: V3,
    pub(crate) key: V3,
    pub(crate) brightness: f32,
}

/// The last face, since neighbours mostly share it: corner weights are `ray · gradient`.
#[derive(Clone, Copy)]
pub(crate) struct Cache {
    face: u32,
    gradient: [V3; 3],
    corners: [[f32; 8]; 3],
}

impl Default for Cache {
    fn default() -> Self {
        Self {
            face: u32::MAX,
            gradient: [V3::zeros(); 3],
            corners: [[0.0; 8]; 3],
        }
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
        let unit = |d: [f32; 3]| {
            V3::from(d)
                .try_normalize(0.0)
                .unwrap_or_else(|| V3::new(0.0, -1.0, 0.0))
        };
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
    pub(crate) fn color(
        &self,
        cache: &mut Cache,
        face: u32,
        u: f32,
        v: f32,
        shadow: f32,
    ) -> [f32; 3] {
        let s = self.surface;
        if cache.face != face {
            let f = s.faces[face as usize].map(|i| i as usize);
            let [a, b, c] = f.map(|i| s.vertices[i].coords);
            *cache = Cache {
                face,
                gradient: [b.cross(&c), c.cross(&a), a.cross(&b)],
                corners: f.map(|i| s.attributes[i]),
            };
        }
        let ray = self.camera.unproject(u, v, 1.0).coords;
        let w = cache.gradient.map(|g| g.dot(&ray));
        // Samples lie inside up to rounding; a pixel's centre may not, and then the nearest edge is meant.
        let sum = w[0] + w[1] + w[2];
        let w = w.map(|w| (w / sum).max(0.0));
        let sum = w[0] + w[1] + w[2];
        let w = if sum > 0.0 {
            w.map(|w| w / sum)
        } else {
            [1.0, 0.0, 0.0]
        };

        let k = &cache.corners;
        let mixed: [f32; 8] =
            std::array::from_fn(|i| k[0][i] * w[0] + k[1][i] * w[1] + k[2][i] * w[2]);
        let [nx, ny, nz, open, tu, tv, z, _] = mixed;
        let eye = ray * -ray.norm_squared().sqrt().recip();
        let n = V3::new(nx, ny, nz);
        let length = n.norm_squared().sqrt();
        let n = if length > 0.0 {
            n * length.recip()
        } else {
            eye
        };
        let inner = s.inner[face as usize];
        let n = if inner { -n } else { n };

        let facing = n.dot(&eye).abs().max(GRAZING);
        let footprint = z / (self.camera.fx as f32 * facing);
        let fabric = &s.fabrics[usize::from(s.garment[face as usize])];
        let albedo = fabric.albedo([tu, tv], footprint);

        let l = &self.lights;
        let hemi = l.ground + (l.sky - l.ground) * 0.5 * (1.0 + n.dot(&self.up));
        let key = ((n.dot(&self.key) + WRAP) / (1.0 + WRAP)).max(0.0) * l.key;
        let sheen = if fabric.gloss > 0.0 {
            let half = self.key + eye;
            let half = half * half.norm_squared().max(f32::MIN_POSITIVE).sqrt().recip();
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
