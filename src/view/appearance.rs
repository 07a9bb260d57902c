//! Colour and pattern of fabrics, in sRGB and linear light.

use super::cloth::ShadedCloth;
use super::image_pyramid::ImagePyramid;
use super::srgb::linear;
use super::trims::DrawnTrims;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Colour and surface of a garment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Appearance {
    /// Base colour, 8-bit sRGB.
    pub base: [u8; 3],
    /// Printed, woven or knitted pattern.
    pub pattern: Print,
    /// 0 = satin, 1 = felt.
    pub roughness: f32,
    /// Metres on the cloth per unit of texture coordinate; 1 when UVs are metres on the flat panel.
    pub metres_per_uv: f32,
    /// Yarns, uneven surface and sewn edges; `None` for a smooth sheet.
    #[serde(skip)]
    pub cloth: Option<Arc<ShadedCloth>>,
    /// Pockets, buttons and the like on it; drawn on cloth only.
    #[serde(skip)]
    pub trims: Option<Arc<DrawnTrims>>,
}

/// A fabric's pattern over its texture coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Print {
    /// One colour.
    Solid,
    /// Bands across v (around the body where v runs along it).
    Stripes {
        /// Second colour, sRGB.
        color: [u8; 3],
        /// Length of one pair of bands, metres.
        period: f32,
    },
    /// Bands both ways, darker where they cross.
    Check {
        /// Second colour, sRGB.
        color: [u8; 3],
        /// Side of a repeat, metres.
        period: f32,
    },
    /// Columns of V-shaped stitches; drawn only where a stitch spans two pixels.
    Knit {
        /// Width of a stitch, metres.
        period: f32,
    },
    /// A value instead of a fabric: u goes from −1 (`low`) over 0 (the base colour) to 1 (`high`).
    Scale {
        /// Colour at −1, sRGB.
        low: [u8; 3],
        /// Colour at 1, sRGB.
        high: [u8; 3],
    },
    /// An image in place of the base colour. Texture coordinates are metres from its upper left corner, v down.
    #[serde(skip)]
    Image(Arc<ImagePyramid>),
}

impl Print {
    /// Lengths after which it repeats along u and v, metres; 0 along an axis without a repeat.
    pub fn period(&self) -> [f32; 2] {
        match self {
            Self::Stripes { period, .. } => [0.0, *period],
            Self::Check { period, .. } => [*period; 2],
            Self::Solid | Self::Knit { .. } | Self::Scale { .. } | Self::Image(_) => [0.0; 2],
        }
    }
}

impl Default for Appearance {
    fn default() -> Self {
        Self {
            base: [52, 92, 150],
            pattern: Print::Solid,
            roughness: 0.8,
            metres_per_uv: 1.0,
            cloth: None,
            trims: None,
        }
    }
}

/// An appearance in linear light, for the inner loop.
#[derive(Clone, Debug)]
pub(crate) struct Fabric {
    pub(crate) base: [f32; 3],
    pub(crate) other: [f32; 3],
    /// The third colour, where there is one.
    pub(crate) low: [f32; 3],
    pub(crate) print: Print,
    pub(crate) gloss: f32,
    pub(crate) metres_per_uv: f32,
    pub(crate) cloth: Option<Arc<ShadedCloth>>,
    pub(crate) trims: Option<Arc<DrawnTrims>>,
}

/// Mean of a square wave (half on) over a pixel of `width` periods centred at `x` periods.
fn square_wave(x: f32, width: f32) -> f32 {
    // Integral of the wave from 0: on during the first half of each period.
    let integral = |x: f32| x.floor() * 0.5 + (x - x.floor()).min(0.5);
    let w = width.max(1e-3);
    (integral(x + 0.5 * w) - integral(x - 0.5 * w)) / w
}

/// Height of a stitch over its width.
const STITCH_HEIGHT: f32 = 0.7;
/// Light lost between the ridges of stitches, and along the wale between their columns.
const GROOVE: [f32; 2] = [0.35, 0.2];

/// Brightness of knitwear at (`x`, `y`) stitches; fades to 1 as a stitch gets smaller than two pixels.
fn knit_groove(x: f32, y: f32, stitches_per_pixel: f32) -> f32 {
    let visible = (1.0 - 2.0 * stitches_per_pixel).clamp(0.0, 1.0);
    let slant = ((x - x.floor()) - 0.5).abs();
    let s = y + slant;
    let ridge = 1.0 - 2.0 * ((s - s.floor()) - 0.5).abs();
    1.0 - GROOVE[0] * visible * (1.0 - ridge) - GROOVE[1] * visible * (2.0 * slant).powi(4)
}

impl Fabric {
    pub(crate) fn new(appearance: &Appearance) -> Self {
        let (other, low) = match appearance.pattern {
            Print::Stripes { color, .. } | Print::Check { color, .. } => (color, appearance.base),
            Print::Scale { low, high } => (high, low),
            Print::Solid | Print::Knit { .. } | Print::Image(_) => {
                (appearance.base, appearance.base)
            }
        };
        Self {
            base: appearance.base.map(linear),
            other: other.map(linear),
            low: low.map(linear),
            print: appearance.pattern.clone(),
            gloss: (1.0 - appearance.roughness).clamp(0.0, 1.0),
            metres_per_uv: appearance.metres_per_uv,
            cloth: appearance.cloth.clone(),
            trims: appearance.trims.clone(),
        }
    }
    /// Linear reflectance at a texture coordinate, averaged over a pixel that spans `footprint` metres.
    /// The average makes fine patterns fade instead of shimmering.
    #[inline]
    pub(crate) fn albedo(&self, uv: [f32; 2], footprint: f32) -> [f32; 3] {
        let mix = |t: f32| -> [f32; 3] {
            std::array::from_fn(|k| self.base[k] + (self.other[k] - self.base[k]) * t)
        };
        let at = |k: usize, period: f32| uv[k] * self.metres_per_uv / period;
        match &self.print {
            Print::Solid => self.base,
            &Print::Stripes { period, .. } => mix(square_wave(at(1, period), footprint / period)),
            &Print::Check { period, .. } => {
                let w = footprint / period;
                mix(0.5 * (square_wave(at(0, period), w) + square_wave(at(1, period), w)))
            }
            &Print::Knit { period } => {
                let groove = knit_groove(
                    at(0, period),
                    at(1, STITCH_HEIGHT * period),
                    footprint / period,
                );
                self.base.map(|c| c * groove)
            }
            Print::Scale { .. } => {
                let (to, t) = if uv[0] < 0.0 {
                    (&self.low, -uv[0])
                } else {
                    (&self.other, uv[0])
                };
                std::array::from_fn(|k| self.base[k] + (to[k] - self.base[k]) * t.min(1.0))
            }
            Print::Image(image) => image.sample(uv.map(|t| t * self.metres_per_uv), footprint),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_interpolates_low_base_high_and_clamps() {
        let (low, high) = ([0, 0, 255], [255, 0, 0]);
        let appearance = Appearance {
            pattern: Print::Scale { low, high },
            base: [0, 255, 0],
            ..Appearance::default()
        };
        let fabric = Fabric::new(&appearance);
        let at = |u: f32| fabric.albedo([u, 0.3], 0.01);
        assert_eq!(
            (at(-1.0), at(0.0), at(1.0)),
            ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
        );
        assert_eq!((at(-7.0), at(0.5)), ([0.0, 0.0, 1.0], [0.5, 0.5, 0.0]));
    }

    #[test]
    fn fine_stripes_average_to_their_mean() {
        let appearance = Appearance {
            pattern: Print::Stripes {
                color: [255, 255, 255],
                period: 0.02,
            },
            ..Appearance::default()
        };
        let fabric = Fabric::new(&appearance);
        let near = |v: f32| fabric.albedo([0.0, v], 1e-5);
        for k in 0..3 {
            assert!((near(0.005)[k] - 1.0).abs() < 1e-3);
            assert!((near(0.015)[k] - linear(appearance.base[k])).abs() < 1e-3);
        }
        // A pixel of many stripes shows their mean at any position.
        for v in [0.0, 0.0031, 0.0177] {
            let far = fabric.albedo([0.0, v], 0.4);
            for k in 0..3 {
                let mean = 0.5 * (1.0 + linear(appearance.base[k]));
                assert!((far[k] - mean).abs() < 0.03, "{far:?}");
            }
        }
    }
}
