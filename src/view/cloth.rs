//! A fabric prepared for shading: yarns, uneven surface, and profiles of its sewn edges.

use super::cloth_tile::{ClothTexel, ClothTile};
use super::construction::EdgePlace;
use super::edge_profile::EdgeProfile;
use std::f32::consts::{FRAC_1_SQRT_2, TAU};
use std::sync::{Arc, OnceLock};
use tryon_garment::{FabricLook, FabricSample, Material};

/// Footprint of a pixel in pitches from which yarns are roughness alone.
const YARNS_SEEN: f32 = 2.0;
/// Footprint from which the uneven surface is roughness alone, metres: its longest wave.
const SURFACE_SEEN: f32 = 6e-3;
/// Distance of two ribs, metres, their slope at its steepest, and the light lost between them.
const RIB: f32 = 2.6e-3;
const RIB_SLOPE: f32 = 0.9;
const RIB_SHADE: f32 = 0.12;
/// Steepest slope of puckers along an edge, their reach on both sides of the stitches in waves, and the second wave over the
/// first: no simple ratio, so that no two puckers are alike.
const PUCKER: f32 = 0.09;
const PUCKER_REACH: f32 = 1.5;
const SECOND_WAVE: f32 = 1.7;

/// Cosine and sine of the directions across which the ridges of each field run.
const ACROSS: [[f32; 2]; 4] = [
    [1.0, 0.0],
    [FRAC_1_SQRT_2, FRAC_1_SQRT_2],
    [0.0, 1.0],
    [-FRAC_1_SQRT_2, FRAC_1_SQRT_2],
];
/// Slope below which ridges are not seen.
const LEAST_RIDGE: f32 = 8e-3;
/// Light lost in valleys of wrinkles, per slope.
const WRINKLE_SHADE: f32 = 0.12;

/// Look of a fabric, prepared once and shared.
#[derive(Clone, Debug)]
pub struct ShadedCloth {
    pub(crate) look: FabricLook,
    yarns: ClothTile,
    surface: ClothTile,
    wrinkles: ClothTile,
    seam: EdgeProfile,
    lower: EdgeProfile,
    upper: EdgeProfile,
}

impl PartialEq for ShadedCloth {
    fn eq(&self, other: &Self) -> bool {
        self.look == other.look
    }
}

/// Relief and tone of a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ClothSample {
    /// Slopes along u and v, across and along the nearest free edge, and across the nearest seam.
    pub(crate) slopes: [f32; 5],
    /// Factor on the albedo.
    pub(crate) tone: f32,
    /// Variance of a slope within the pixel.
    pub(crate) variance: f32,
}

impl ShadedCloth {
    /// Cloth of a preset ([`Material::PRESETS`]), prepared on first use and shared: 2 MB each. Another name is jersey's.
    ///
    /// # Panics
    /// Never in a build that passes its tests: the presets are part of the build.
    pub fn named(fabric: &str) -> Arc<Self> {
        const COUNT: usize = Material::PRESETS.len();
        static PREPARED: [OnceLock<Arc<ShadedCloth>>; COUNT] = [const { OnceLock::new() }; COUNT];
        let number = Material::PRESETS.iter().position(|name| *name == fabric);
        let number = number.unwrap_or(0);
        #[expect(
            clippy::expect_used,
            reason = "the presets are part of the build; a test reads them"
        )]
        let prepare = || {
            let fabric = FabricSample::named(Material::PRESETS[number]).expect("a preset");
            let wave = fabric.material.wrinkle_length() as f32;
            Arc::new(Self::new(fabric.look, wave))
        };
        Arc::clone(PREPARED[number].get_or_init(prepare))
    }

    /// Look it was prepared from.
    pub fn look(&self) -> &FabricLook {
        &self.look
    }

    /// Prepares a look whose wrinkles are `wave` metres long.
    pub fn new(look: FabricLook, wave: f32) -> Self {
        Self {
            yarns: ClothTile::yarns(&look),
            surface: ClothTile::surface(&look),
            wrinkles: ClothTile::wrinkles(wave),
            seam: EdgeProfile::seam(look.bulk),
            lower: EdgeProfile::free(look.lower, look.bulk),
            upper: EdgeProfile::free(look.upper, look.bulk),
            look,
        }
    }

    /// Mean over about `footprint` metres at a place of the pattern (metres).
    #[inline]
    pub(crate) fn sample(
        &self,
        uv: [f32; 2],
        place: &EdgePlace,
        ridges: [f32; 4],
        footprint: f32,
    ) -> ClothSample {
        let surface = if footprint < SURFACE_SEEN {
            self.surface.nearest_level(uv, footprint)
        } else {
            self.surface.mean()
        };
        let yarns = if footprint < YARNS_SEEN * self.look.pitch {
            self.yarns.sample(uv, footprint)
        } else {
            self.yarns.mean()
        };
        let variance = |t: &ClothTexel| (t[3] - 0.5 * (t[0] * t[0] + t[1] * t[1])).max(0.0);
        let mut out = ClothSample {
            slopes: [surface[0] + yarns[0], surface[1] + yarns[1], 0.0, 0.0, 0.0],
            tone: 1.0 + surface[2] + yarns[2],
            variance: variance(&surface) + variance(&yarns),
        };
        self.wrinkle(uv, ridges, footprint, &mut out);
        let reach = EdgeProfile::REACH + 0.5 * footprint;
        if place.free < reach {
            let profile = if place.is_upper {
                &self.upper
            } else {
                &self.lower
            };
            edge(profile, place, footprint, &mut out);
        }
        if place.seam < reach {
            let [slope, taken] = self.seam.mean(place.seam, footprint);
            out.slopes[4] += slope;
            out.tone *= 1.0 - taken;
        }
        out
    }

    /// Adds wrinkles of these slopes across each of [`ACROSS`].
    #[inline]
    fn wrinkle(&self, uv: [f32; 2], ridges: [f32; 4], footprint: f32, out: &mut ClothSample) {
        for (gain, [c, s]) in ridges.into_iter().zip(ACROSS) {
            if gain < LEAST_RIDGE {
                continue;
            }
            let turned = [uv[0] * c + uv[1] * s, uv[1] * c - uv[0] * s];
            let t = self.wrinkles.nearest_level(turned, footprint);
            out.slopes[0] += gain * (t[0] * c - t[1] * s);
            out.slopes[1] += gain * (t[0] * s + t[1] * c);
            out.tone *= 1.0 + WRINKLE_SHADE * gain * t[2];
        }
    }
}

/// Numbers of a cloth for the graphics card; the layout is that of `garments.wgsl`.
#[cfg(feature = "gpu")]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ClothNumbers {
    /// First texel of its relief, levels of yarns, of the surface and of wrinkles; no levels without a cloth.
    pub(crate) counts: [u32; 4],
    /// Sides of yarns and surface, pitch, band of ribs at lower edges, metres.
    pub(crate) sizes: [f32; 4],
    /// Roughness, reflectance, fuzz, band of ribs at upper edges.
    pub(crate) look: [f32; 4],
    /// Wave and place of the puckers at lower and at upper edges, metres.
    pub(crate) pucker: [f32; 4],
    /// Side of the wrinkles, metres; first relief of the trims and their number; unused.
    pub(crate) wrinkle: [f32; 4],
}

#[cfg(feature = "gpu")]
impl ShadedCloth {
    pub(crate) fn numbers(&self) -> ClothNumbers {
        let look = &self.look;
        let [lower, upper] = [&self.lower, &self.upper];
        ClothNumbers {
            counts: [
                0,
                self.yarns.levels() as u32,
                self.surface.levels() as u32,
                self.wrinkles.levels() as u32,
            ],
            sizes: [
                self.yarns.side(),
                self.surface.side(),
                look.pitch,
                lower.ribs,
            ],
            look: [look.roughness, look.specular, look.fuzz, upper.ribs],
            pucker: [
                lower.pucker[0],
                lower.pucker[1],
                upper.pucker[0],
                upper.pucker[1],
            ],
            wrinkle: [self.wrinkles.side(), 0.0, 0.0, 0.0],
        }
    }

    /// Yarns, surface and wrinkles, level by level, then relief and light taken of lower and upper edges, then of seams.
    pub(crate) fn texels(&self) -> impl Iterator<Item = ClothTexel> + '_ {
        let edges = self.lower.rows().zip(self.upper.rows());
        let edges = edges.map(|([a, b], [c, d])| [a, b, c, d]);
        let seams = self.seam.rows().map(|[a, b]| [a, b, 0.0, 0.0]);
        (self.yarns.texels().chain(self.surface.texels()))
            .chain(self.wrinkles.texels())
            .copied()
            .chain(edges)
            .chain(seams)
    }
}

/// Adds a free edge: its profile, ribs across a band, puckers beside stitches.
fn edge(profile: &EdgeProfile, place: &EdgePlace, footprint: f32, out: &mut ClothSample) {
    let distance = place.free;
    let [slope, taken] = profile.mean(distance, footprint);
    out.slopes[2] += slope;
    out.tone *= 1.0 - taken;
    let seen = |wave: f32| (1.0 - footprint / (0.5 * wave)).clamp(0.0, 1.0);
    let turn = |wave: f32| TAU * (place.along / wave).fract();
    if distance < profile.ribs {
        let (s, c) = turn(RIB).sin_cos();
        out.slopes[3] += RIB_SLOPE * seen(RIB) * c;
        out.tone *= 1.0 - RIB_SHADE * (1.0 - seen(RIB) * s);
        out.variance += 0.5 * RIB_SLOPE * RIB_SLOPE * (1.0 - seen(RIB));
    }
    let [wave, at] = profile.pucker;
    if wave > 0.0 {
        let near = (1.0 - (distance - at).abs() / (PUCKER_REACH * wave)).max(0.0);
        let uneven = turn(wave).cos() + turn(SECOND_WAVE * wave).sin();
        out.slopes[3] += PUCKER * near * seen(wave) * uneven;
    }
}
