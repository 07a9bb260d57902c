//! Surface of a person and its light.

use super::settings::LightSettings;
use tryon_geometry::math::{Camera, Rigid, V3, V3d, World};

/// Material of a point of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SurfaceMaterial {
    /// Colour in full light, sRGB, 0 to 255.
    pub(super) albedo: [f32; 3],
    /// Share of light that is scattered into shadow, red to blue.
    pub(super) scatter: [f32; 3],
    /// Brightness of the highlight, share of white.
    pub(super) gloss: f32,
}

impl From<[u8; 3]> for SurfaceMaterial {
    /// A matte surface.
    fn from(color: [u8; 3]) -> Self {
        Self {
            albedo: color.map(f32::from),
            scatter: [0.0; 3],
            gloss: 0.0,
        }
    }
}

impl SurfaceMaterial {
    /// This material and `share` of another.
    pub(super) fn mixed(&self, other: &Self, share: f32) -> Self {
        if share <= 0.0 {
            return *self;
        }
        if share >= 1.0 {
            return *other;
        }
        let mix = |a: f32, b: f32| a + (b - a) * share;
        Self {
            albedo: std::array::from_fn(|c| mix(self.albedo[c], other.albedo[c])),
            scatter: std::array::from_fn(|c| mix(self.scatter[c], other.scatter[c])),
            gloss: mix(self.gloss, other.gloss),
        }
    }
}

/// Light that the surroundings let through to a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Exposure {
    /// Share of ambient light past folds of the body.
    pub(super) open: f32,
    /// Share of the key light past the body.
    pub(super) key: f32,
}

impl Exposure {
    /// In the open.
    pub(super) const FULL: Self = Self {
        open: 1.0,
        key: 1.0,
    };
}

/// Exponent of the highlight: skin and hair without oil.
const HIGHLIGHT: i32 = 12;

/// Lights in the frame of a camera, unit vectors.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraLights {
    pub(super) key: V3,
    fill: V3,
    up: V3,
    settings: LightSettings,
}

impl CameraLights {
    pub(super) fn new(settings: &LightSettings, world_from_camera: &Rigid<World, Camera>) -> Self {
        let camera_from_world = world_from_camera.inverse();
        let light = |d: [f64; 3]| {
            camera_from_world
                .vector(&V3d::from(d))
                .normalize()
                .cast::<f32>()
        };
        Self {
            key: light(settings.key),
            fill: light(settings.fill),
            up: light([0.0, 1.0, 0.0]),
            settings: *settings,
        }
    }

    /// Brightness of a surface with a unit normal.
    fn shade(&self, n: &V3, exposure: Exposure) -> f32 {
        let [ambient, sky, key, fill] = self.settings.shade;
        let [key_width, fill_width] = self.settings.width;
        let broad = |cosine: f32, width: f32| ((cosine + width) / (1.0 + width)).max(0.0);
        let light = ambient
            + sky * n.dot(&self.up)
            + key * broad(n.dot(&self.key), key_width) * exposure.key
            + fill * broad(n.dot(&self.fill), fill_width);
        light * exposure.open
    }

    /// Colour of a surface with unit normal `n`, seen along the unit vector `ray`: sRGB, 0 to 255.
    pub(super) fn color(
        &self,
        m: &SurfaceMaterial,
        n: &V3,
        ray: &V3,
        exposure: Exposure,
    ) -> [f32; 3] {
        let shade = self.shade(n, exposure);
        let highlight = if m.gloss > 0.0 {
            let half = (self.key - ray).normalize();
            255.0 * m.gloss * n.dot(&half).max(0.0).powi(HIGHLIGHT) * exposure.key
        } else {
            0.0
        };
        let dark = (1.0 - shade).max(0.0);
        std::array::from_fn(|c| {
            (m.albedo[c] * (shade + m.scatter[c] * dark) + highlight).min(255.0)
        })
    }
}
