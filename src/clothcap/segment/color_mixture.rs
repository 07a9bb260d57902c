//! Appearance of a garment: a Gaussian mixture over colours in the cone of hue, saturation and value (eq. 13).

use crate::settings::MixtureSettings;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Colour as a point of the HSV cone: chroma along the hue's direction, and value. Hue of dark and grey colours is noise,
/// and here they lie together.
pub fn hsv_cone([r, g, b]: [u8; 3]) -> Vector3<f64> {
    let c = [r, g, b].map(|v| f64::from(v) / 255.0);
    let (high, low) = (c[0].max(c[1]).max(c[2]), c[0].min(c[1]).min(c[2]));
    let chroma = high - low;
    if chroma <= 0.0 {
        return Vector3::new(0.0, 0.0, high);
    }
    let sector = if high == c[0] {
        (c[1] - c[2]) / chroma
    } else if high == c[1] {
        2.0 + (c[2] - c[0]) / chroma
    } else {
        4.0 + (c[0] - c[1]) / chroma
    };
    let hue = sector * std::f64::consts::FRAC_PI_3;
    Vector3::new(chroma * hue.cos(), chroma * hue.sin(), high)
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct MixtureMode {
    weight: f64,
    mean: Vector3<f64>,
    precision: Matrix3<f64>,
    log_norm: f64,
}

impl MixtureMode {
    fn new(weight: f64, mean: Vector3<f64>, covariance: Matrix3<f64>, noise: f64) -> Self {
        let floor = Matrix3::identity() * (noise * noise);
        let covariance = covariance + floor;
        let precision = covariance.try_inverse();
        let determinant = covariance.determinant().max(f64::MIN_POSITIVE);
        Self {
            weight,
            mean,
            precision: precision.unwrap_or_else(|| Matrix3::identity() / (noise * noise)),
            log_norm: -0.5 * (determinant.ln() + 3.0 * std::f64::consts::TAU.ln()),
        }
    }

    fn density(&self, c: &Vector3<f64>) -> f64 {
        let d = c - self.mean;
        self.weight * (self.log_norm - 0.5 * d.dot(&(self.precision * d))).exp()
    }
}

/// Gaussian mixture of colours.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColorMixture {
    modes: Vec<MixtureMode>,
}

impl ColorMixture {
    /// Fits a mixture to colours of [`hsv_cone`]; `None` without any.
    pub fn fit(colors: &[Vector3<f64>], settings: &MixtureSettings) -> Option<Self> {
        let stride = colors.len().div_ceil(settings.samples).max(1);
        let some = colors.iter().step_by(stride).copied();
        let some: Vec<_> = some.filter(|c| c.iter().all(|v| v.is_finite())).collect();
        if some.is_empty() {
            return None;
        }
        let owners = k_means(&some, settings.modes, settings);
        let k = owners.iter().max().map_or(1, |m| m + 1);
        let mut shares = vec![vec![0.0; k]; some.len()];
        for (s, o) in shares.iter_mut().zip(&owners) {
            s[*o] = 1.0;
        }
        let mut out = Self {
            modes: maximise(&some, &shares, settings.noise),
        };
        for _ in 0..settings.maximising {
            for (s, c) in shares.iter_mut().zip(&some) {
                *s = out.modes.iter().map(|m| m.density(c)).collect();
                let sum: f64 = s.iter().sum();
                // A colour too far from all modes is nobody's.
                let scale = if sum > 1e-12 { 1.0 / sum } else { 0.0 };
                s.iter_mut().for_each(|v| *v *= scale);
            }
            out.modes = maximise(&some, &shares, settings.noise);
        }
        Some(out)
    }

    /// Negative logarithm of the density at a colour, bounded by the share of outliers.
    pub fn cost(&self, c: &Vector3<f64>, outliers: f64) -> f64 {
        let density: f64 = self.modes.iter().map(|m| m.density(c)).sum();
        -((1.0 - outliers) * density + outliers).ln()
    }
}

fn maximise(colors: &[Vector3<f64>], shares: &[Vec<f64>], noise: f64) -> Vec<MixtureMode> {
    let k = shares.first().map_or(0, Vec::len);
    let total: f64 = shares.iter().flatten().sum();
    let mode = |m: usize| {
        let weight: f64 = shares.iter().map(|s| s[m]).sum();
        if !(weight > 0.0) {
            return None;
        }
        let all = || colors.iter().zip(shares).map(|(c, s)| (c, s[m] / weight));
        let mean: Vector3<f64> = all().map(|(c, s)| c * s).sum();
        let scatter = all().map(|(c, s)| (c - mean) * (c - mean).transpose() * s);
        Some(MixtureMode::new(weight / total, mean, scatter.sum(), noise))
    };
    (0..k).filter_map(mode).collect()
}

/// Clusters of colours: seeds as far apart as possible, then Lloyd's iterations. Cluster of each colour.
pub fn k_means(colors: &[Vector3<f64>], k: usize, settings: &MixtureSettings) -> Vec<usize> {
    let n = colors.len();
    if n == 0 {
        return Vec::new();
    }
    let mean = colors.iter().sum::<Vector3<f64>>() / n as f64;
    // The seeds are means of what lies nearest to far points, so that single outliers do not stay seeds.
    let mut centres = vec![mean];
    let mut near: Vec<f64> = vec![f64::INFINITY; n];
    while centres.len() < k.max(1) {
        let last = centres[centres.len() - 1];
        for (d, c) in near.iter_mut().zip(colors) {
            *d = d.min((c - last).norm_squared());
        }
        let far = (0..n).max_by(|a, b| near[*a].total_cmp(&near[*b]));
        let far = far.unwrap_or(0);
        if near[far] < settings.noise * settings.noise {
            break;
        }
        centres.push(colors[far]);
    }
    let mut owner = vec![0; n];
    for _ in 0..settings.clustering {
        for (o, c) in owner.iter_mut().zip(colors) {
            let square = |i: &usize| (centres[*i] - c).norm_squared();
            let nearest = (0..centres.len()).min_by(|a, b| square(a).total_cmp(&square(b)));
            *o = nearest.unwrap_or(0);
        }
        let mut sums = vec![(Vector3::zeros(), 0.0); centres.len()];
        for (o, c) in owner.iter().zip(colors) {
            sums[*o].0 += c;
            sums[*o].1 += 1.0;
        }
        for (centre, (sum, count)) in centres.iter_mut().zip(&sums) {
            if *count > 0.0 {
                *centre = sum / *count;
            }
        }
    }
    owner
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    fn around(mean: [f64; 3], n: usize, rng: &mut impl Rng) -> Vec<Vector3<f64>> {
        let mut noise = || Vector3::from_fn(|_, _| 0.06 * (rng.random::<f64>() - 0.5));
        (0..n).map(|_| Vector3::from(mean) + noise()).collect()
    }

    #[test]
    fn cone_is_continuous_where_hue_is_not() {
        let near = |a: [u8; 3], b: [u8; 3]| (hsv_cone(a) - hsv_cone(b)).norm();
        assert!(near([40, 40, 40], [41, 40, 40]) < 0.01);
        assert!(near([200, 10, 10], [200, 10, 11]) < 0.01 && near([255, 0, 0], [255, 0, 3]) < 0.02);
        assert!(near([200, 0, 0], [0, 200, 0]) > 1.0);
        assert_eq!(hsv_cone([0; 3]), Vector3::zeros());
    }

    #[test]
    fn mixture_tells_its_modes_from_the_rest() {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(3);
        let mut colors = around([0.5, 0.1, 0.8], 300, &mut rng);
        colors.extend(around([0.0, 0.0, 0.1], 100, &mut rng));
        colors.push(Vector3::repeat(f64::NAN));
        let settings = MixtureSettings::default();
        let fit = |colors: &[Vector3<f64>]| ColorMixture::fit(colors, &settings);
        let some = fit(&colors).expect("colours");
        let cost = |c: [f64; 3]| some.cost(&Vector3::from(c), settings.outliers);
        assert!(cost([0.5, 0.1, 0.8]) < cost([0.0, 0.0, 0.1]));
        assert!(cost([0.0, 0.0, 0.1]) + 3.0 < cost([0.25, 0.05, 0.45]));
        assert!(cost([-0.5, 0.5, 0.9]).is_finite());
        assert!(fit(&[]).is_none());
        let one = fit(&[Vector3::repeat(0.3); 5]).expect("colours");
        let cost = |v: f64| one.cost(&Vector3::repeat(v), settings.outliers);
        assert!(cost(0.3) < cost(0.5));
    }

    #[test]
    fn clusters_are_those_of_the_data() {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(5);
        let mut colors = around([0.5, 0.1, 0.8], 50, &mut rng);
        colors.extend(around([0.0, 0.0, 0.1], 50, &mut rng));
        let clusters = |all: &[_], k| k_means(all, k, &MixtureSettings::default());
        let owner = clusters(&colors, 2);
        assert!(owner[..50].iter().all(|o| *o == owner[0]));
        assert!(owner[50..].iter().all(|o| *o != owner[0]));
        assert!(clusters(&[Vector3::zeros(); 9], 4).iter().all(|o| *o == 0));
        assert!(clusters(&[], 3).is_empty());
    }
}
