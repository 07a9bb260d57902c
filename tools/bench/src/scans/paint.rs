//! Colours of skin, hair and garments, with baked light.

use super::points::SKIN_LABEL;
use super::settings::ScanSettings;
use super::surface::SceneSurface;
use rand::{Rng, SeedableRng};
use tryon_body::{RestBody, Template};
use tryon_geometry::math::{P3, V3};

/// Relation of the garments' colours to each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ScanPalette {
    /// Hues apart, some garments with stripes, checks or spots.
    #[default]
    Distinct,
    /// One hue, plain; brightness of neighbouring garments differs by 6 %.
    LowContrast,
    /// One plain colour for all garments.
    Uniform,
}

/// Pattern of two colours on cloth; lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
enum FabricPrint {
    Plain,
    Stripes { period: f32 },
    Checks { period: f32 },
    Spots { period: f32 },
}

/// Colours of one garment, sRGB, 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq)]
struct GarmentPaint {
    base: [f32; 3],
    second: [f32; 3],
    print: FabricPrint,
}

/// Landmarks of the head of a rest body, frame of the body (m).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HeadFrame {
    /// Base of the skull.
    base: V3,
    /// Height of the crown over the base.
    height: f32,
    /// Front and back of the head.
    depth: [f32; 2],
}

/// Colours of a scene.
#[derive(Clone, Debug)]
pub(super) struct ScenePaint {
    skin: [f32; 3],
    hair: [f32; 3],
    garments: Vec<GarmentPaint>,
    head: HeadFrame,
}

/// Colours of skin and hair, sRGB.
const SKIN_COLORS: [[f32; 3]; 5] = [
    [232.0, 190.0, 165.0],
    [224.0, 172.0, 138.0],
    [190.0, 138.0, 104.0],
    [140.0, 94.0, 68.0],
    [96.0, 64.0, 48.0],
];
const HAIR_COLORS: [[f32; 3]; 5] = [
    [30.0, 26.0, 24.0],
    [62.0, 44.0, 32.0],
    [118.0, 84.0, 50.0],
    [190.0, 158.0, 104.0],
    [150.0, 148.0, 146.0],
];
/// Surface with the colours of its parts.
#[derive(Clone, Copy)]
pub(super) struct PaintedSurface<'a> {
    pub(super) surface: &'a SceneSurface,
    pub(super) paint: &'a ScenePaint,
}

impl ScenePaint {
    /// Colours of a subject with this head and `garments` garments.
    pub(super) fn new(
        head: HeadFrame,
        garments: usize,
        palette: ScanPalette,
        settings: &ScanSettings,
        seed: u64,
    ) -> Self {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let skin = SKIN_COLORS[rng.random_range(0..SKIN_COLORS.len())];
        let hair = HAIR_COLORS[rng.random_range(0..HAIR_COLORS.len())];
        let (hue, value) = (rng.random_range(0.0..1.0f32), rng.random_range(0.3..0.8f32));
        let saturation = rng.random_range(0.15..0.7f32);
        let garments = (0..garments).map(|k| match palette {
            ScanPalette::Distinct => {
                GarmentPaint::random(hue + settings.hue_step * k as f32, &mut rng)
            }
            ScanPalette::LowContrast => {
                let factor = if k % 2 == 0 { 1.0 } else { settings.contrast };
                GarmentPaint::plain(hsv(hue, saturation, value * factor))
            }
            ScanPalette::Uniform => GarmentPaint::plain(hsv(hue, saturation, value)),
        });
        Self {
            skin,
            hair,
            garments: garments.collect(),
            head,
        }
    }

    /// Colour of a place on the material without light, sRGB, 0 to 255.
    pub(super) fn color(&self, label: u8, material: &V3) -> [f32; 3] {
        match label {
            SKIN_LABEL if self.head.has_hair(material) => self.hair,
            SKIN_LABEL => self.skin,
            garment => {
                let paint = self.garments.get(usize::from(garment) - 1);
                paint.map_or(self.skin, |p| p.color(material))
            }
        }
    }
}

/// Brightness of red, green and blue at a normal, for the share of cameras that see the place; `tint` is the share by which the light is warmer and the weaker one colder.
pub(super) fn tinted_shade(settings: &ScanSettings, normal: &V3, openness: f32, tint: f32) -> V3 {
    let toward = |d: [f32; 3]| normal.dot(&V3::from(d).normalize()).max(0.0);
    let ([key, weak], [ambient, ..]) = (settings.lights, settings.shade);
    let (light, fill) = (
        settings.shade[1] * toward(key),
        settings.shade[2] * toward(weak),
    );
    let open = settings.occluded + (1.0 - settings.occluded) * openness;
    let lit = |w: f32| (ambient + light * (1.0 + tint * w) + fill * (1.0 - tint * w)) * open;
    V3::from(settings.warmth).map(lit)
}

impl GarmentPaint {
    fn plain(color: [f32; 3]) -> Self {
        Self {
            base: color,
            second: color,
            print: FabricPrint::Plain,
        }
    }

    fn random(hue: f32, rng: &mut impl Rng) -> Self {
        let mut tone = |hue: f32| {
            let (saturation, value) = (rng.random_range(0.2..0.8), rng.random_range(0.25..0.9));
            hsv(hue, saturation, value)
        };
        let (base, second) = (tone(hue), tone(hue + 0.35));
        let period = rng.random_range(0.03..0.08);
        let print = match rng.random_range(0..6) {
            0 => FabricPrint::Stripes { period },
            1 => FabricPrint::Checks { period },
            2 => FabricPrint::Spots { period },
            _ => FabricPrint::Plain,
        };
        Self {
            base,
            second,
            print,
        }
    }

    fn color(&self, material: &V3) -> [f32; 3] {
        let odd = |x: f32, period: f32| (x / period).rem_euclid(1.0) < 0.5;
        let is_second = match self.print {
            FabricPrint::Plain => false,
            FabricPrint::Stripes { period } => odd(material.y, period),
            FabricPrint::Checks { period } => odd(material.x, period) != odd(material.y, period),
            FabricPrint::Spots { period } => {
                let off = |x: f32| (x / period).rem_euclid(1.0) - 0.5;
                off(material.x).hypot(off(material.y)) < 0.25
            }
        };
        if is_second { self.second } else { self.base }
    }
}

impl HeadFrame {
    pub(super) fn new(template: &Template, rest: &RestBody) -> Self {
        let Some(joint) = template.skeleton().index("head") else {
            return Self::default();
        };
        let base = rest.joints[joint].coords.cast::<f32>();
        let of_head = |p: &&P3| p.y > base.y && (p.x - base.x).abs() < 0.15;
        let head = || rest.vertices.iter().filter(of_head);
        let crown = head().map(|p| p.y).fold(base.y, f32::max);
        let front = head().map(|p| p.z).fold(base.z, f32::max);
        let back = head().map(|p| p.z).fold(base.z, f32::min);
        Self {
            base,
            height: crown - base.y,
            depth: [front, back],
        }
    }

    /// True for a rest position under hair: above a line that falls from the forehead to the nape.
    fn has_hair(&self, p: &V3) -> bool {
        if self.height <= 0.0 || (p.x - self.base.x).abs() > 0.15 {
            return false;
        }
        let [front, back] = self.depth;
        let behind = ((front - p.z) / (front - back) - 0.15) / 0.45;
        let behind = behind.clamp(0.0, 1.0);
        let line = 0.72 + (0.05 - 0.72) * behind * behind * (3.0 - 2.0 * behind);
        p.y > self.base.y + line * self.height
    }
}

/// Colour of a hue (turns), saturation and value, sRGB, 0 to 255.
fn hsv(hue: f32, saturation: f32, value: f32) -> [f32; 3] {
    [5.0, 3.0, 1.0].map(|n: f32| {
        let k = (n + 6.0 * hue.rem_euclid(1.0)) % 6.0;
        let dip = k.min(4.0 - k).clamp(0.0, 1.0);
        255.0 * value.min(1.0) * (1.0 - saturation * dip)
    })
}
