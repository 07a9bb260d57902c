//! Filters of decompressed elements.

/// Numbers of a shared form: 8 bits of exponent over 24 bits of mantissa, both two's complement, into 32-bit floats.
pub(super) fn exponential(data: &mut [u8]) {
    for word in data.chunks_exact_mut(4) {
        let bits = i32::from_le_bytes([word[0], word[1], word[2], word[3]]);
        let (exponent, mantissa) = (bits >> 24, bits << 8 >> 8);
        let value = f64::from(mantissa) * 2f64.powi(exponent);
        word.copy_from_slice(&(value as f32).to_le_bytes());
    }
}

/// Unit quaternions of three components and the place of the largest, into four normalised 16-bit integers.
pub(super) fn quaternion(data: &mut [u8]) {
    for row in data.chunks_exact_mut(8) {
        let at = |k: usize| i16::from_le_bytes([row[2 * k], row[2 * k + 1]]);
        let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(at(3) | 3);
        let [x, y, z] = [0, 1, 2].map(|k| f32::from(at(k)) * scale);
        let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
        let largest = (at(3) & 3) as usize;
        for (k, value) in [w, x, y, z].into_iter().enumerate() {
            let place = (largest + k) % 4;
            let rounded = (value * 32_767.0).round() as i16;
            row[2 * place..2 * place + 2].copy_from_slice(&rounded.to_le_bytes());
        }
    }
}
