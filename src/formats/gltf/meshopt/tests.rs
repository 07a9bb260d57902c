//! Tests of the filters; `tryon-garment` has streams of meshoptimizer's own encoder.

use super::*;

#[test]
fn shared_exponents_become_floats() {
    let word =
        |exponent: i32, mantissa: i32| (exponent << 24 | (mantissa & 0xff_ffff)).to_le_bytes();
    let mut data = [word(-2, 5), word(0, -7), word(3, 1)].concat();
    filters::exponential(&mut data);
    let floats: Vec<f32> = data
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect();
    assert_eq!(floats, [1.25, -7.0, 8.0]);
}
