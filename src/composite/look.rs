//! What a fabric looks like.

use serde::{Deserialize, Serialize};

/// Colour and surface of a garment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Look {
    /// Base colour, 8-bit sRGB.
    pub base: [u8; 3],
    /// What is printed, woven or knitted into it.
    pub pattern: Print,
    /// 0 = satin, 1 = felt.
    pub roughness: f32,
    /// Metres on the cloth per unit of texture coordinate; 1 when UVs are metres on the flat panel.
    pub metres_per_uv: f32,
}

/// A fabric's pattern over its texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    /// Columns of V-shaped stitches; visible only as near as stitches can be seen.
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
}

impl Default for Look {
    fn default() -> Self {
        Self {
            base: [52, 92, 150],
            pattern: Print::Solid,
            roughness: 0.8,
            metres_per_uv: 1.0,
        }
    }
}

/// sRGB byte to linear light (IEC 61966-2-1).
pub(crate) fn linear(c: u8) -> f32 {
    let c = f32::from(c) / 255.0;
    if c <= 0.040_45 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

/// Linear light to sRGB, 0 to 255, by table: 4096 steps leave less than half a byte of error above black.
#[derive(Clone, Debug)]
pub(crate) struct ToSrgb(Vec<f32>);

impl Default for ToSrgb {
    fn default() -> Self {
        let encode = |l: f32| {
            255.0
                * if l <= 0.003_130_8 {
                    12.92 * l
                } else {
                    1.055 * l.powf(1.0 / 2.4) - 0.055
                }
        };
        // Indexed by the square root of the light, so that dark tones get as many steps as bright ones.
        Self(
            (0..=4096)
                .map(|i| encode((i as f32 / 4096.0).powi(2)))
                .collect(),
        )
    }
}

impl ToSrgb {
    pub(crate) fn get(&self, light: f32) -> f32 {
        self.0[(light.clamp(0.0, 1.0).sqrt() * 4096.0 + 0.5) as usize]
    }
}

/// A look ready for the inner loop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fabric {
    pub(crate) base: [f32; 3],
    pub(crate) other: [f32; 3],
    /// The third colour, where there is one.
    pub(crate) low: [f32; 3],
    pub(crate) print: Print,
    pub(crate) gloss: f32,
    pub(crate) metres_per_uv: f32,
}

/// Share of a square wave (half on) seen by a pixel of `width` periods centred at `x` periods.
fn square_wave(x: f32, width: f32) -> f32 {
    // Integral of the wave from 0: on during the first half of each period.
    let integral = |x: f32| x.floor() * 0.5 + (x - x.floor()).min(0.5);
    let w = width.max(1e-3);
    (integral(x + 0.5 * w) - integral(x - 0.5 * w)) / w
}

impl Fabric {
    pub(crate) fn new(look: &Look) -> Self {
        let (other, low) = match look.pattern {
            Print::Stripes { color, .. } | Print::Check { color, .. } => (color, look.base),
            Print::Scale { low, high } => (high, low),
            Print::Solid | Print::Knit { .. } => (look.base, look.base),
        };
        Self {
            base: look.base.map(linear),
            other: other.map(linear),
            low: low.map(linear),
            print: look.pattern,
            gloss: (1.0 - look.roughness).clamp(0.0, 1.0),
            metres_per_uv: look.metres_per_uv,
        }
    }
    /// Linear reflectance at a texture coordinate seen by a pixel that spans `footprint` metres: patterns are
    /// averaged over the pixel, so they fade instead of shimmering.
    #[inline]
    pub(crate) fn albedo(&self, uv: [f32; 2], footprint: f32) -> [f32; 3] {
        let mix = |t: f32| -> [f32; 3] {
            std::array::from_fn(|k| self.base[k] + (self.other[k] - self.base[k]) * t)
        };
        let at = |k: usize, period: f32| uv[k] * self.metres_per_uv / period;
        match self.print {
            Print::Solid => self.base,
            Print::Stripes { period, .. } => mix(square_wave(at(1, period), footprint / period)),
            Print::Check { period, .. } => {
                let w = footprint / period;
                mix(0.5 * (square_wave(at(0, period), w) + square_wave(at(1, period), w)))
            }
            Print::Knit { period } => {
                // A stitch must span two pixels to be drawn at all.
                let visible = (1.0 - 2.0 * footprint / period).clamp(0.0, 1.0);
                if visible == 0.0 {
                    return self.base;
                }
                let (x, y) = (at(0, period), at(1, period * 0.7));
                let slant = ((x - x.floor()) - 0.5).abs();
                let s = y + slant;
                let ridge = 1.0 - 2.0 * ((s - s.floor()) - 0.5).abs();
                let groove =
                    1.0 - 0.35 * visible * (1.0 - ridge) - 0.2 * visible * (2.0 * slant).powi(4);
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
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_round_trips_through_srgb() {
        let table = ToSrgb::default();
        for c in 0..=255u8 {
            assert!((table.get(linear(c)) - f32::from(c)).abs() < 0.5, "{c}");
        }
    }

    #[test]
    fn a_scale_goes_from_low_over_the_base_to_high() {
        let (low, high) = ([0, 0, 255], [255, 0, 0]);
        let look = Look {
            pattern: Print::Scale { low, high },
            base: [0, 255, 0],
            ..Look::default()
        };
        let fabric = Fabric::new(&look);
        let at = |u: f32| fabric.albedo([u, 0.3], 0.01);
        assert_eq!(
            (at(-1.0), at(0.0), at(1.0)),
            ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
        );
        assert_eq!((at(-7.0), at(0.5)), ([0.0, 0.0, 1.0], [0.5, 0.5, 0.0]));
    }

    #[test]
    fn a_pattern_averages_instead_of_shimmering() {
        let look = Look {
            pattern: Print::Stripes {
                color: [255, 255, 255],
                period: 0.02,
            },
            ..Look::default()
        };
        let fabric = Fabric::new(&look);
        let near = |v: f32| fabric.albedo([0.0, v], 1e-5);
        for k in 0..3 {
            assert!((near(0.005)[k] - 1.0).abs() < 1e-3);
            assert!((near(0.015)[k] - linear(look.base[k])).abs() < 1e-3);
        }
        // A pixel of many stripes sees the mean wherever it is.
        for v in [0.0, 0.0031, 0.0177] {
            let far = fabric.albedo([0.0, v], 0.4);
            for k in 0..3 {
                let mean = 0.5 * (1.0 + linear(look.base[k]));
                assert!((far[k] - mean).abs() < 0.03, "{far:?}");
            }
        }
    }
}
