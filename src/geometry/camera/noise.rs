//! Published noise models of depth cameras, applied to perfect depth.
//!
//! Random numbers come from a counter (seed, frame, pixel): a frame's noise depends on its number only.

use super::{DepthImage, Intrinsics};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

/// Noise model of a depth camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NoiseModel {
    /// Rounding to millimetres only.
    #[default]
    None,
    /// Structured light, Kinect v1: Nguyen, Izadi and Lovell, "Modeling Kinect sensor noise" (3DIMPVT 2012): axial
    /// and lateral noise; disparity in steps of 1/8 pixel; holes at depth edges; nothing below 0.4 m or above 8 m.
    KinectV1,
    /// Time of flight, Kinect v2: Fankhauser et al., "Kinect v2 for mobile robot navigation" (ICAR 2015): axial
    /// noise; mixed or lost pixels at depth edges and at grazing angles.
    TimeOfFlight,
}

/// Axial standard deviation of the Kinect v1 at depth `z` metres and angle `theta` between the surface normal and
/// the camera, radians: metres. Nguyen et al. 2012, eq. 3.
pub fn kinect_v1_axial_sigma(z: f32, theta: f32) -> f32 {
    let frontal = 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4);
    if theta <= 0.0 {
        return frontal;
    }
    let t = theta.min(MAX_ANGLE);
    frontal + 0.0001 / z.max(0.1).sqrt() * t * t / ((FRAC_PI_2 - t) * (FRAC_PI_2 - t))
}

/// Lateral standard deviation of the Kinect v1 seen frontally, pixels. Nguyen et al. 2012, eq. 1 (its dependence on
/// the angle stays below 0.15 pixel up to 80° and is left out).
pub const KINECT_V1_LATERAL_SIGMA: f32 = 0.8;

/// Axial standard deviation of the Kinect v2 at `z` metres and angle `theta`: metres. Fankhauser et al. 2015, eq. 6.
pub fn time_of_flight_axial_sigma(z: f32, theta: f32) -> f32 {
    let frontal = 1.5 - 0.5 * z + 0.3 * z * z;
    if theta <= 0.0 {
        return frontal * 1e-3;
    }
    let t = theta.min(MAX_ANGLE);
    (frontal + 0.1 * z * z.sqrt() * t * t / ((FRAC_PI_2 - t) * (FRAC_PI_2 - t))) * 1e-3
}

/// Both models go to infinity at 90°; the papers measured up to 80°.
const MAX_ANGLE: f32 = 80.0 * std::f32::consts::PI / 180.0;
/// Distance between projector and camera of the Kinect v1, metres (Nguyen et al. 2012, section 2).
const BASELINE: f32 = 0.075;
/// Steps of disparity in a pixel.
const DISPARITY_STEPS: f32 = 8.0;
/// Range of both cameras in which anything is reported, metres.
const RANGE: [f32; 2] = [0.4, 8.0];

crate::settings! {
    /// Settings of depth edges in noise models.
    pub struct NoiseSettings {
        /// A jump to a neighbour larger than this share of the depth is an edge: 75 mm at 1.5 m, several times the noise,
        /// less than an arm in front of a chest.
        pub edge: f32 = 0.05,
        /// Slope (27°) up to which both models' angle terms stay below 2 % of the frontal noise: not computed there.
        pub flat: f32 = 0.5,
        /// Share of edge pixels that are lost.
        pub edge_loss: f32 = 0.5,
    }
}

/// A well-mixed number from a counter (splitmix64, Steele et al. 2014).
fn hash(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Nearly normal with mean 0 and variance 1: the sum of four uniform numbers of 12 bits (Irwin–Hall); its tails end
/// at 3.46.
fn normal(bits: u64) -> f32 {
    let u = |s: u32| ((bits >> s) & 0xfff) as f32;
    // Mean 2·4095, variance 4·(4096² − 1)/12.
    (u(0) + u(12) + u(24) + u(36) - 8190.0) * (1.0 / 2364.8)
}

/// Whole-pixel offset for each byte: a normal of standard deviation 0.8 rounded to pixels.
fn lateral_table() -> [i8; 256] {
    // Φ(−1.5/0.8) = 0.0304, Φ(−0.5/0.8) = 0.2660.
    std::array::from_fn(|i| {
        let p = (i as f32 + 0.5) / 256.0;
        if p < 0.0304 {
            -2
        } else if p < 0.2660 {
            -1
        } else if p < 0.7340 {
            0
        } else if p < 0.9696 {
            1
        } else {
            2
        }
    })
}

impl NoiseModel {
    /// Reading of perfect depth `clean` (metres, row-major, infinity for no surface); deterministic in `seed` and `frame`.
    ///
    /// # Panics
    /// When `clean` has fewer values than the camera has pixels.
    pub fn apply(self, camera: &Intrinsics, clean: &[f32], seed: u64, frame: u64) -> DepthImage {
        let mut out = DepthImage::empty(camera.width, camera.height);
        let (w, h) = (camera.width as usize, camera.height as usize);
        let stream = hash(hash(seed) ^ frame);
        let table = lateral_table();
        let NoiseSettings {
            edge: edge_share,
            flat,
            edge_loss,
        } = NoiseSettings::default();
        let (f, half_f) = (camera.fx as f32, 0.5 * camera.fx as f32);
        // Disparity in steps: both directions cost one division.
        let steps = DISPARITY_STEPS * BASELINE * f;
        for (v, row) in out.data_mut().chunks_exact_mut(w).enumerate() {
            let (up, down) = (v.saturating_sub(1) * w, (v + 1).min(h - 1) * w);
            for (u, px) in row.iter_mut().enumerate() {
                let i = v * w + u;
                if self == Self::None {
                    *px = millimetres(clean[i]);
                    continue;
                }
                let bits = hash(stream.wrapping_add(i as u64));
                let mut at = i;
                if self == Self::KinectV1 {
                    let du = i64::from(table[(bits & 0xff) as usize]);
                    let dv = i64::from(table[(bits >> 8 & 0xff) as usize]);
                    let (x, y) = (
                        (u as i64 + du).clamp(0, w as i64 - 1),
                        (v as i64 + dv).clamp(0, h as i64 - 1),
                    );
                    at = y as usize * w + x as usize;
                }
                let z = clean[at];
                if !(z > RANGE[0] && z < RANGE[1]) {
                    continue;
                }
                let (left, right) = (
                    clean[v * w + u.saturating_sub(1)],
                    clean[v * w + (u + 1).min(w - 1)],
                );
                let (above, below) = (clean[up + u], clean[down + u]);
                let lo = left.min(right).min(above).min(below);
                let hi = left.max(right).max(above).max(below);
                let edge = hi - lo > edge_share * z;
                // Slope of depth over metres on the surface; at an edge it means nothing.
                let (gx, gy) = (right - left, below - above);
                let slope2 = (gx * gx + gy * gy) * (half_f * half_f) / (z * z);
                let theta = if edge || slope2 < flat * flat {
                    0.0
                } else {
                    small_atan(slope2.sqrt())
                };
                let n = normal(bits >> 16);
                *px = match self {
                    Self::None => millimetres(z),
                    Self::KinectV1 => {
                        if edge && uniform(bits) < edge_loss {
                            continue;
                        }
                        let z = z + kinect_v1_axial_sigma(z, theta) * n;
                        // Positive, so that truncation rounds; `round` is a call.
                        millimetres(steps / ((steps / z + 0.5) as u32 as f32))
                    }
                    Self::TimeOfFlight => {
                        if edge {
                            let r = uniform(bits);
                            if r < edge_loss || hi >= RANGE[1] {
                                continue;
                            }
                            // Light from both sides of the edge arrives in one pixel.
                            let mix = (r - edge_loss) / (1.0 - edge_loss);
                            millimetres(z + (hi - z) * mix * mix)
                        } else {
                            millimetres(z + time_of_flight_axial_sigma(z, theta) * n)
                        }
                    }
                };
            }
        }
        out
    }
}

/// A uniform number in [0, 1) from a pixel's bits.
fn uniform(bits: u64) -> f32 {
    (hash(bits) >> 40) as f32 / (1u64 << 24) as f32
}

/// Arctangent for x ≥ 0 within 0.005 rad (Rajan et al. 2006): the models need no more.
fn small_atan(x: f32) -> f32 {
    let poly = |t: f32| FRAC_PI_4 * t + 0.273 * t * (1.0 - t);
    if x <= 1.0 {
        poly(x)
    } else {
        FRAC_PI_2 - poly(1.0 / x)
    }
}

/// Metres to whole millimetres; 0 (no reading) beyond 16 bits.
fn millimetres(z: f32) -> u16 {
    let mm = z * 1000.0 + 0.5;
    if (1.0..65_536.0).contains(&mm) {
        mm as u16
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const K: Intrinsics = Intrinsics::KINECT_V1;

    /// Mean and standard deviation of the readings of a frontal wall, metres.
    fn wall(model: NoiseModel, z: f32) -> (f64, f64) {
        let clean = vec![z; K.pixels()];
        let image = model.apply(&K, &clean, 7, 3);
        let values: Vec<f64> = image.data().iter().map(|d| f64::from(*d) * 1e-3).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let var = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / values.len() as f64;
        (mean, var.sqrt())
    }

    #[test]
    fn walls_show_the_published_axial_noise() {
        for z in [0.8f32, 1.5, 2.5, 4.0] {
            let (mean, sigma) = wall(NoiseModel::KinectV1, z);
            // Oracle: the published normal distribution, pushed through disparity steps and millimetres on a fine grid.
            let steps = f64::from(BASELINE) * 525.0 * 8.0;
            let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
            for i in -4000..=4000 {
                let x = f64::from(i) * 1e-3;
                let weight = (-0.5 * x * x).exp();
                let far = f64::from(z) + f64::from(kinect_v1_axial_sigma(z, 0.0)) * x;
                let mm = (1000.0 * steps / (steps / far).round()).round() * 1e-3;
                n += weight;
                sum += weight * mm;
                squares += weight * mm * mm;
            }
            let want = (squares / n - (sum / n).powi(2)).sqrt();
            assert!(
                (sigma / want - 1.0).abs() < 0.03,
                "{z} m: {sigma} against {want}"
            );
            assert!(
                (mean - sum / n).abs() < 0.1 * want,
                "{z} m: mean {mean} against {}",
                sum / n
            );
            let (_, sigma) = wall(NoiseModel::TimeOfFlight, z);
            let want = (f64::from(time_of_flight_axial_sigma(z, 0.0)).powi(2) + 1e-6 / 12.0).sqrt();
            assert!(
                (sigma / want - 1.0).abs() < 0.03,
                "{z} m: {sigma} against {want}"
            );
        }
        // Table of the paper's formula, by hand: 0.0012 + 0.0019·2.6² = 0.014044 at 3 m.
        assert!((kinect_v1_axial_sigma(3.0, 0.0) - 0.014_044).abs() < 1e-6);
    }

    #[test]
    fn disparity_comes_in_eighths() {
        let clean = vec![2.0; K.pixels()];
        let image = NoiseModel::KinectV1.apply(&K, &clean, 1, 0);
        let mut levels: Vec<u16> = image.data().to_vec();
        levels.sort_unstable();
        levels.dedup();
        // 2 m is 157.5 eighths; its neighbours are 12.8 mm apart.
        assert!(
            levels.len() < 8
                && levels
                    .windows(2)
                    .all(|w| (11..=15).contains(&(w[1] - w[0]))),
            "{levels:?}"
        );
    }

    #[test]
    fn lateral_noise_has_its_width() {
        let t = lateral_table();
        let var = t.iter().map(|d| f64::from(*d).powi(2)).sum::<f64>() / 256.0;
        // Rounding to pixels adds 1/12; the tails beyond 2.5 pixels are cut.
        let want = f64::from(KINECT_V1_LATERAL_SIGMA).powi(2) + 1.0 / 12.0;
        assert!((var / want - 1.0).abs() < 0.05, "{var} against {want}");
    }

    #[test]
    fn edges_lose_pixels_and_frames_repeat() {
        let clean: Vec<f32> = (0..K.pixels())
            .map(|i| if i % 640 < 320 { 1.5 } else { 3.0 })
            .collect();
        for model in [NoiseModel::KinectV1, NoiseModel::TimeOfFlight] {
            let image = model.apply(&K, &clean, 5, 9);
            assert_eq!(image, model.apply(&K, &clean, 5, 9));
            assert_ne!(image, model.apply(&K, &clean, 5, 10));
            assert_ne!(image, model.apply(&K, &clean, 6, 9));
            let lost = |c: i32| (0..480).filter(|&v| image.at(c, v) == 0).count();
            assert!((150..330).contains(&lost(319)), "{model:?}: {}", lost(319));
            assert_eq!(lost(100), 0);
        }
    }

    #[test]
    fn nothing_out_of_range_and_exact_without_noise() {
        let mut clean = vec![f32::INFINITY; K.pixels()];
        clean[0] = f32::NAN;
        clean[1] = 0.1;
        clean[2] = -3.0;
        for model in [NoiseModel::KinectV1, NoiseModel::TimeOfFlight] {
            assert!(
                model.apply(&K, &clean, 0, 0).data().iter().all(|d| *d == 0),
                "{model:?}"
            );
        }
        let exact = NoiseModel::None.apply(&K, &clean, 0, 0);
        assert_eq!(&exact.data()[..4], [0, 100, 0, 0]);
    }
}
