//! Light on cloth: hemisphere light, one key lamp, openness of folds, the inner side.

use super::config::Lights;
use super::srgb::ToSrgb;
use super::surface::Surface;
use tryon_geometry::camera::Intrinsics;
use tryon_geometry::math::V3;

/// Cosine past the terminator up to which the key lamp reaches: cloth scatters light.
const WRAP: f32 = 0.25;
/// Least cosine of the viewing angle in a pixel's footprint; smaller, and patterns would fade to nothing at edges.
const GRAZING: f32 = 0.2;
/// Exponent of the sheen of satin (Blinn–Phong).
const SHEEN_POWER: i32 = 16;
/// Sheen of satin at its brightest.
const SHEEN: f32 = 0.25;

/// Surface, camera and light of one picture.
pub(crate) struct Shader<'a> {
    pub(crate) surface: &'a Surface,
    pub(crate) camera: Intrinsics,
    pub(crate) to_srgb: &'a ToSrgb,
    pub(crate) lights: Lights,
    pub(crate) up: V3,
    pub(crate) key: V3,
    pub(crate) brightness: f32,
}

/// The last shaded face, which neighbours mostly share; barycentric coordinates are `ray · gradient`.
#[derive(Clone, Copy)]
pub(crate) struct ShadedFace {
    face: u32,
    gradient: [V3; 3],
    corners: [[f32; 8]; 3],
}

impl Default for ShadedFace {
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

    /// sRGB (0 to 255) of a face at picture position (u, v); `shadow` is the share of light taken away.
    #[inline]
    pub(crate) fn color(
        &self,
        cache: &mut ShadedFace,
        face: u32,
        [u, v]: [f32; 2],
        shadow: f32,
    ) -> [f32; 3] {
        let s = self.surface;
        if cache.face != face {
            let f = s.faces[face as usize].map(|i| i as usize);
            let [a, b, c] = f.map(|i| s.vertices[i].coords);
            *cache = ShadedFace {
                face,
                gradient: [b.cross(&c), c.cross(&a), a.cross(&b)],
                corners: f.map(|i| s.attributes[i]),
            };
        }
        let ray = self.camera.unproject(u, v, 1.0).coords;
        let [nx, ny, nz, open, tu, tv, z, _] = cache.interpolate(&ray);
        let eye = ray * -ray.norm_squared().sqrt().recip();
        let n = V3::new(nx, ny, nz);
        let length = n.norm_squared().sqrt();
        let n = if length > 0.0 {
            n * length.recip()
        } else {
            eye
        };
        let is_inner = s.inner[face as usize];
        let n = if is_inner { -n } else { n };

        let facing = n.dot(&eye).abs().max(GRAZING);
        let footprint = z / (self.camera.fx as f32 * facing);
        let fabric = &s.fabrics[usize::from(s.garment[face as usize])];
        let albedo = fabric.albedo([tu, tv], footprint);

        let side = if is_inner { self.lights.inside } else { 1.0 };
        let gain = self.brightness * side * (1.0 - shadow);
        let diffuse = self.diffuse(&n, open) * gain;
        let sheen = self.sheen(&n, &eye, fabric.gloss) * gain;
        albedo.map(|a| self.to_srgb.get(a * diffuse + sheen))
    }

    /// Hemisphere light and wrapped key light; `open` is the share of ambient light that reaches the surface.
    #[inline]
    fn diffuse(&self, n: &V3, open: f32) -> f32 {
        let l = &self.lights;
        let hemisphere = l.ground + (l.sky - l.ground) * 0.5 * (1.0 + n.dot(&self.up));
        let key = ((n.dot(&self.key) + WRAP) / (1.0 + WRAP)).max(0.0) * l.key;
        hemisphere * open + key * open.min(1.0)
    }

    #[inline]
    fn sheen(&self, n: &V3, eye: &V3, gloss: f32) -> f32 {
        if !(gloss > 0.0) {
            return 0.0;
        }
        let half = self.key + eye;
        let half = half * half.norm_squared().max(f32::MIN_POSITIVE).sqrt().recip();
        gloss * SHEEN * n.dot(&half).max(0.0).powi(SHEEN_POWER) * self.lights.key
    }
}

impl ShadedFace {
    /// Attributes along `ray`; outside the face, which a pixel's centre may be, those of the nearest edge.
    #[inline]
    fn interpolate(&self, ray: &V3) -> [f32; 8] {
        let w = self.gradient.map(|g| g.dot(ray));
        let sum = w[0] + w[1] + w[2];
        let w = w.map(|w| (w / sum).max(0.0));
        let sum = w[0] + w[1] + w[2];
        let w = if sum > 0.0 {
            w.map(|w| w / sum)
        } else {
            [1.0, 0.0, 0.0]
        };
        let k = &self.corners;
        std::array::from_fn(|i| k[0][i] * w[0] + k[1][i] * w[1] + k[2][i] * w[2])
    }
}
