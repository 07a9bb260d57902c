//! sRGB transfer function (IEC 61966-2-1), values 0 to 1.

/// sRGB to linear.
pub(super) fn linear(s: f32) -> f32 {
    if s <= 0.040_45 {
        s / 12.92
    } else {
        ((s + 0.055) / 1.055).powf(2.4)
    }
}

/// Linear to sRGB.
pub(super) fn encoded(l: f32) -> f32 {
    if l <= 0.003_130_8 {
        l * 12.92
    } else {
        1.055 * l.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_linear_light() {
        for byte in 0..=255u8 {
            let back = encoded(linear(f32::from(byte) / 255.0)) * 255.0;
            assert_eq!(back.round() as u8, byte);
        }
    }
}
