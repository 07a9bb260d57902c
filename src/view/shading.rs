//! Light on cloth: hemisphere light, one key lamp, openness of folds, the inner side.

use super::appearance::Fabric;
use super::cloth::{ClothSample, ShadedCloth};
use super::config::Lights;
use super::construction::EdgePlace;
use super::room_light::{RoomLight, lit};
use super::srgb::ToSrgb;
use super::surface::{Surface, VertexAttributes};
use tryon_geometry::camera::Intrinsics;
use tryon_geometry::math::V3;

/// Cosine past the terminator up to which the key lamp reaches: cloth scatters light.
const WRAP: f32 = 0.25;
/// Least cosine of the viewing angle in a pixel's footprint; smaller, and patterns would fade to nothing at edges.
const GRAZING: f32 = 0.2;
/// Slope of the room's light below which it has no direction.
const MIN_SLOPE: f32 = 0.05;
/// Exponent of the sheen of satin (Blinn–Phong).
const SHEEN_POWER: i32 = 16;
/// Sheen of satin at its brightest.
const SHEEN: f32 = 0.25;

/// Share of the cloth's own light that fibres standing off hide along the outline, and what they reflect there: some light
/// unchanged at their surface, half of the rest through their dye.
const FUZZ_HIDES: f32 = 0.5;
const FUZZ_WHITE: f32 = 0.15;
const FUZZ_DYED: f32 = 0.5;

/// Direction of a vector; zero for zero.
#[inline]
fn unit(v: V3) -> V3 {
    v * v.norm_squared().max(f32::MIN_POSITIVE).sqrt().recip()
}

/// Surface, camera and light of one picture.
pub(crate) struct Shader<'a> {
    pub(crate) surface: &'a Surface,
    pub(crate) camera: Intrinsics,
    pub(crate) to_srgb: &'a ToSrgb,
    pub(crate) lights: Lights,
    pub(crate) up: V3,
    pub(crate) key: V3,
    /// Strength of the lamp in highlights.
    pub(crate) lamp: f32,
    /// Mean light, and its change with the normal over the mean by channel, where the room's light is known.
    level: f32,
    room: Option<[V3; 3]>,
    /// Light of this picture over that of `lights`, by channel.
    pub(crate) brightness: [f32; 3],
}

/// The last shaded face, which neighbours mostly share; barycentric coordinates are `ray · gradient`.
#[derive(Clone, Copy)]
pub(crate) struct ShadedFace {
    face: u32,
    gradient: [V3; 3],
    corners: [VertexAttributes; 3],
    /// Gradients of both texture coordinates (metres), of the distance from a free edge and the length along it, and of the
    /// distance from a seam.
    along: [V3; 5],
    /// Trims near the face, as bits.
    trims: u32,
}

impl Default for ShadedFace {
    fn default() -> Self {
        Self {
            face: u32::MAX,
            gradient: [V3::zeros(); 3],
            corners: [VertexAttributes::default(); 3],
            along: [V3::zeros(); 5],
            trims: 0,
        }
    }
}

impl<'a> Shader<'a> {
    pub(crate) fn new(
        surface: &'a Surface,
        camera: Intrinsics,
        to_srgb: &'a ToSrgb,
        lights: &Lights,
        room: Option<&RoomLight>,
        brightness: f32,
    ) -> Self {
        let direction = |d: [f32; 3]| {
            V3::from(d)
                .try_normalize(0.0)
                .unwrap_or_else(|| V3::new(0.0, -1.0, 0.0))
        };
        let slopes = room.map(|r| r.slope.map(V3::from));
        let mean: Option<V3> = slopes.map(|s| (s[0] + s[1] + s[2]) / 3.0);
        let key = mean.and_then(|m| m.try_normalize(MIN_SLOPE));
        let level = 0.5 * (lights.sky + lights.ground) + lights.key * WRAP / (1.0 + WRAP);
        Self {
            surface,
            camera,
            to_srgb,
            lights: *lights,
            up: direction(lights.up),
            key: key.unwrap_or_else(|| direction(lights.key_direction)),
            lamp: mean.map_or(lights.key, |m| lights.key * m.norm().min(1.0)),
            level,
            room: slopes,
            brightness: match room.and_then(|r| r.level.zip(slopes)) {
                // The level is that of a surface towards the camera.
                Some((seen, slopes)) => {
                    [0, 1, 2].map(|c| seen[c] / (level * lit(1.0 - slopes[c].z)))
                }
                None => [brightness; 3],
            },
        }
    }

    /// Slope of the room's light by channel; beside them the mean light, 1 with a known room, and the lamp of highlights.
    #[cfg(feature = "gpu")]
    pub(crate) fn room_rows(&self) -> [[f32; 4]; 3] {
        let slopes = self.room.unwrap_or_default();
        let beside = [
            self.level,
            f32::from(u8::from(self.room.is_some())),
            self.lamp,
        ];
        [0, 1, 2].map(|c| [slopes[c].x, slopes[c].y, slopes[c].z, beside[c]])
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
        let fabric = &s.fabrics[usize::from(s.garment[face as usize])];
        if cache.face != face {
            let f = s.faces[face as usize].map(|i| i as usize);
            *cache = ShadedFace::new(
                face,
                f.map(|i| s.vertices[i].coords),
                f.map(|i| s.attributes[i]),
                fabric,
            );
        }
        let ray = self.camera.unproject(u, v, 1.0).coords;
        let attributes = cache.interpolate(cache.weights(&ray));
        let [nx, ny, nz, open, tu, tv, z, ..] = attributes;
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
        let albedo = fabric.albedo([tu, tv], footprint);

        let side = if is_inner { self.lights.inside } else { 1.0 };
        let gain = self.brightness.map(|b| b * side * (1.0 - shadow));
        let Some(cloth) = &fabric.cloth else {
            let diffuse = self.diffuse(&n, open);
            let sheen = self.sheen(&n, &eye, fabric.gloss);
            return [0, 1, 2].map(|c| self.to_srgb.get((albedo[c] * diffuse + sheen) * gain[c]));
        };
        let mut relief = relief(cloth, &attributes, fabric.metres_per_uv, footprint);
        if let Some(trims) = fabric.trims.as_ref().filter(|_| cache.trims != 0) {
            let place = [tu, tv].map(|t| t * fabric.metres_per_uv);
            trims.add(cache.trims, place, footprint, &mut relief);
        }
        let tilt = cache.tilt(&relief);
        let n = unit(n - if is_inner { -tilt } else { tilt });
        let albedo = albedo.map(|a| a * relief.tone);
        let light = ClothLight {
            shader: self,
            normal: n,
            eye,
            open,
        };
        let reflected = light.reflected(cloth, relief.variance, albedo);
        [0, 1, 2].map(|c| self.to_srgb.get(reflected[c] * gain[c]))
    }

    /// Light on a surface by channel; `open` is the share of it that reaches the surface.
    #[inline]
    fn irradiance(&self, n: &V3, open: f32) -> [f32; 3] {
        let Some(room) = &self.room else {
            return [self.diffuse(n, open); 3];
        };
        room.map(|slope| self.level * lit(1.0 + slope.dot(n)) * open)
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
        let half = unit(self.key + eye);
        gloss * SHEEN * n.dot(&half).max(0.0).powi(SHEEN_POWER) * self.lights.key
    }
}

/// Light that a piece of cloth reflects.
struct ClothLight<'a> {
    shader: &'a Shader<'a>,
    normal: V3,
    /// Towards the camera.
    eye: V3,
    open: f32,
}

impl ClothLight<'_> {
    /// Diffuse light, a microfacet highlight (GGX) of the lamp, and the sheen of fibres that stand off (after Estevez & Kulla
    /// 2017: strongest along the surface).
    #[inline]
    fn reflected(&self, cloth: &ShadedCloth, variance: f32, albedo: [f32; 3]) -> [f32; 3] {
        let (n, look) = (&self.normal, &cloth.look);
        let light = self.shader.irradiance(n, self.open);
        let facing = n.dot(&self.eye).clamp(0.0, 1.0);
        let grazing = (1.0 - facing).powi(3);
        let fuzz = look.fuzz * grazing;
        let key = self.shader.key;
        let towards = n.dot(&key).max(0.0);
        // Slopes within the pixel widen the highlight.
        let alpha = (look.roughness.powi(2) + 2.0 * variance).min(1.0);
        let half = unit(key + self.eye);
        let h = n.dot(&half).max(0.0);
        let a2 = alpha * alpha;
        let spread = h * h * (a2 - 1.0) + 1.0;
        let lobe = a2 / (4.0 * spread * spread);
        let edge = (1.0 - half.dot(&self.eye).clamp(0.0, 1.0)).powi(5);
        let fresnel = look.specular + (1.0 - look.specular) * edge;
        let shine = fresnel * lobe * towards * self.shader.lamp * self.open.min(1.0);
        std::array::from_fn(|c| {
            let body = albedo[c] * (1.0 - FUZZ_HIDES * fuzz);
            (body + fuzz * (FUZZ_WHITE + FUZZ_DYED * albedo[c])) * light[c] + shine
        })
    }
}

/// Relief of a cloth at interpolated attributes, mean over about `footprint` metres.
#[inline]
pub(crate) fn relief(
    cloth: &ShadedCloth,
    attributes: &VertexAttributes,
    metres_per_uv: f32,
    footprint: f32,
) -> ClothSample {
    let [
        _,
        _,
        _,
        _,
        tu,
        tv,
        _,
        free,
        along,
        seam,
        upper,
        _,
        ridges @ ..,
    ] = *attributes;
    let place = EdgePlace {
        free,
        along,
        seam,
        is_upper: upper > 0.5,
    };
    let uv = [tu, tv].map(|t| t * metres_per_uv);
    cloth.sample(uv, &place, ridges, footprint)
}

/// Steepest gradient of a coordinate along the surface that is believed: beyond it, an edge's length jumps within a face.
const STEEPEST: f32 = 2.5;

impl ShadedFace {
    pub(crate) fn new(
        face: u32,
        [a, b, c]: [V3; 3],
        corners: [VertexAttributes; 3],
        fabric: &Fabric,
    ) -> Self {
        let mut along = [V3::zeros(); 5];
        if fabric.cloth.is_some() {
            let n = (b - a).cross(&(c - a));
            let scale = n.norm_squared().max(f32::MIN_POSITIVE).recip();
            // Gradients of the barycentric coordinates.
            let g = [n.cross(&(c - b)), n.cross(&(a - c)), n.cross(&(b - a))].map(|g| g * scale);
            let metres = fabric.metres_per_uv;
            let of = |k: usize, unit: f32| -> V3 {
                let sum: V3 = (0..3).map(|i| g[i] * corners[i][k]).sum();
                let sum = sum * unit;
                if sum.norm_squared() > STEEPEST * STEEPEST {
                    V3::zeros()
                } else {
                    sum
                }
            };
            along = [
                of(4, metres),
                of(5, metres),
                of(7, 1.0),
                of(8, 1.0),
                of(9, 1.0),
            ];
        }
        Self {
            face,
            gradient: [b.cross(&c), c.cross(&a), a.cross(&b)],
            trims: fabric.trims.as_ref().map_or(0, |trims| {
                trims.near(corners.map(|c| [c[4], c[5]].map(|t| t * fabric.metres_per_uv)))
            }),
            corners,
            along,
        }
    }

    /// Gradient along the surface of a relief's height.
    #[inline]
    pub(crate) fn tilt(&self, relief: &ClothSample) -> V3 {
        let slopes = self.along.iter().zip(relief.slopes);
        slopes.map(|(g, s)| g * s).sum()
    }

    /// Barycentric coordinates of `ray`; outside the face, which a pixel's centre may be, those of the nearest edge.
    #[inline]
    fn weights(&self, ray: &V3) -> [f32; 3] {
        let w = self.gradient.map(|g| g.dot(ray));
        let sum = w[0] + w[1] + w[2];
        let w = w.map(|w| (w / sum).max(0.0));
        let sum = w[0] + w[1] + w[2];
        if sum > 0.0 {
            w.map(|w| w / sum)
        } else {
            [1.0, 0.0, 0.0]
        }
    }

    /// Attributes at barycentric coordinates.
    #[inline]
    pub(crate) fn interpolate(&self, w: [f32; 3]) -> VertexAttributes {
        let k = &self.corners;
        std::array::from_fn(|i| k[0][i] * w[0] + k[1][i] * w[1] + k[2][i] * w[2])
    }
}
