//! sRGB and linear light, both ways by table or formula.

/// sRGB byte to linear light (IEC 61966-2-1).
pub(crate) fn linear(c: u8) -> f32 {
    let c = f32::from(c) / 255.0;
    if c <= 0.040_45 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

/// Steps of the sRGB table: leave less than half a byte of error above black.
const SRGB_STEPS: usize = 4096;

/// Linear light to sRGB, 0 to 255, by table.
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
            (0..=SRGB_STEPS)
                .map(|i| encode((i as f32 / SRGB_STEPS as f32).powi(2)))
                .collect(),
        )
    }
}

impl ToSrgb {
    pub(crate) fn get(&self, light: f32) -> f32 {
        self.0[(light.clamp(0.0, 1.0).sqrt() * SRGB_STEPS as f32 + 0.5) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_table_inverts_linear() {
        let table = ToSrgb::default();
        for c in 0..=255u8 {
            assert!((table.get(linear(c)) - f32::from(c)).abs() < 0.5, "{c}");
        }
    }
}
