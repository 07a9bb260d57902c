//! Quantisation of vertex colours to bytes.

/// Largest float of a colour whose white is 1; a larger one in a scan sets white to 255.
/// Above 1, so that rounding and overexposure do not darken a scan by a factor of 255.
const UNIT_RANGE: f32 = 2.0;

/// Value of white among float colours: 255 if a component exceeds the range of unit colours, else 1.
pub(super) fn white(colors: &[[f32; 3]]) -> f32 {
    let mut finite = colors.iter().flatten().filter(|c| c.is_finite());
    if finite.any(|c| *c > UNIT_RANGE) {
        255.0
    } else {
        1.0
    }
}

/// Bytes of colours whose white is `white`; empty if no colour is finite.
///
/// Colours that are not finite get the mean of those that are.
pub(super) fn quantized(colors: &[[f32; 3]], white: f32) -> Vec<[u8; 3]> {
    let (mut sum, mut count) = ([0.0f64; 3], 0usize);
    for color in colors.iter().filter(|c| is_finite(c)) {
        count += 1;
        for (s, c) in sum.iter_mut().zip(color) {
            *s += f64::from(*c);
        }
    }
    if count == 0 {
        return Vec::new();
    }
    let mean = sum.map(|s| (s / count as f64) as f32);
    let byte = |c: f32| (c * (255.0 / white)).round().clamp(0.0, 255.0) as u8;
    colors
        .iter()
        .map(|c| if is_finite(c) { *c } else { mean }.map(byte))
        .collect()
}

/// True for a colour with three finite components.
pub(super) fn is_finite(color: &[f32; 3]) -> bool {
    color.iter().all(|c| c.is_finite())
}
