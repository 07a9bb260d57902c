//! Classifier of skin against clothes by colour.
//!
//! Skin is one normal distribution of brightness and chroma, clothes a mixture of [`KINDS`] (shirt, trousers, their
//! shadows).

use super::settings::SkinSettings;
use tryon_geometry::math::order_statistics::medians;

/// Least number of tones of a class.
pub(super) const MIN_TONES: usize = 12;

/// Brightness and the two chroma differences of an sRGB colour (ITU-R BT.601), each 0 to 255 wide.
#[inline]
pub(super) fn tone(rgb: [u8; 3]) -> [f32; 3] {
    let [r, g, b] = rgb.map(f32::from);
    let y = 0.299 * r + 0.587 * g + 0.114 * b;
    [y, 0.564 * (b - y), 0.713 * (r - y)]
}

/// Normal distribution of tones, up to a constant factor.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Gaussian {
    mean: [f32; 3],
    /// Inverse of the lower triangular factor of the covariance: 00, 10, 11, 20, 21, 22.
    factor: [f32; 6],
    /// Logarithm of weight over root of determinant.
    log: f32,
}

/// Mixture components of clothes; two miss the shadows of a bright shirt.
const KINDS: usize = 4;
/// Iterations of Lloyd's algorithm.
const ITERATIONS: usize = 6;

impl Gaussian {
    /// Maximum likelihood with `min_sigma` added to the covariance; `weight` is the component's share.
    fn of(tones: &[[f32; 3]], weight: f32, min_sigma: &[f32; 3]) -> Self {
        let n = tones.len().max(1) as f32;
        let mean = tones
            .iter()
            .fold([0.0; 3], |s, c| [s[0] + c[0], s[1] + c[1], s[2] + c[2]])
            .map(|s| s / n);
        let mut s = [0.0f32; 6];
        for c in tones {
            let d = [c[0] - mean[0], c[1] - mean[1], c[2] - mean[2]];
            let mut k = 0;
            for i in 0..3 {
                for j in 0..=i {
                    s[k] += d[i] * d[j] / n;
                    k += 1;
                }
            }
        }
        (s[0], s[2], s[5]) = (
            s[0] + min_sigma[0].powi(2),
            s[2] + min_sigma[1].powi(2),
            s[5] + min_sigma[2].powi(2),
        );
        // Cholesky; the least deviations keep the pivots positive.
        let l00 = s[0].sqrt();
        let (l10, l20) = (s[1] / l00, s[3] / l00);
        let l11 = (s[2] - l10 * l10).max(1.0).sqrt();
        let l21 = (s[4] - l20 * l10) / l11;
        let l22 = (s[5] - l20 * l20 - l21 * l21).max(1.0).sqrt();
        let (i0, i1, i2) = (1.0 / l00, 1.0 / l11, 1.0 / l22);
        let i10 = -l10 * i0 * i1;
        let factor = [
            i0,
            i10,
            i1,
            -(l20 * i0 + l21 * i10) * i2,
            -l21 * i1 * i2,
            i2,
        ];
        Self {
            mean,
            factor,
            log: (weight * i0 * i1 * i2).ln(),
        }
    }

    /// Logarithm of the density.
    #[inline]
    fn log_density(&self, c: &[f32; 3]) -> f32 {
        let d = [
            c[0] - self.mean[0],
            c[1] - self.mean[1],
            c[2] - self.mean[2],
        ];
        let f = &self.factor;
        let a = f[0] * d[0];
        let b = f[1] * d[0] + f[2] * d[1];
        let c = f[3] * d[0] + f[4] * d[1] + f[5] * d[2];
        self.log - 0.5 * (a * a + b * b + c * c)
    }
}

/// Share of skin tones nearest to the median chroma that are fitted, as a fraction.
const KEPT: [usize; 2] = [9, 10];

/// Classifier of skin against clothes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SkinClassifier {
    skin: Gaussian,
    clothes: Vec<Gaussian>,
    /// Logarithm of the density of clothes of an unknown colour.
    unknown_clothes: f32,
}

impl SkinClassifier {
    /// Fits tones of skin and of everything else; `None` when there are too few.
    pub(super) fn fit(
        skin: &[[f32; 3]],
        clothes: &[[f32; 3]],
        settings: &SkinSettings,
    ) -> Option<Self> {
        if skin.len() < MIN_TONES || clothes.len() < MIN_TONES {
            return None;
        }
        // Trims tones beside a limb that is tracked a little off: farther from the median than most.
        let middle: [f32; 3] = medians(skin)?;
        let off = |c: &[f32; 3]| (c[1] - middle[1]).abs() + (c[2] - middle[2]).abs();
        let mut kept = skin.to_vec();
        kept.sort_by(|a, b| off(a).total_cmp(&off(b)));
        kept.truncate(skin.len() * KEPT[0] / KEPT[1]);
        Some(Self {
            skin: Gaussian::of(&kept, 1.0, &settings.min_sigma),
            clothes: cluster(clothes, settings),
            unknown_clothes: settings.unknown_clothes,
        })
    }

    /// Skin is the most likely class of this tone.
    #[inline]
    pub(super) fn is_skin(&self, c: &[f32; 3]) -> bool {
        let skin = self.skin.log_density(c);
        skin > self.unknown_clothes && self.clothes.iter().all(|k| k.log_density(c) < skin)
    }
}

impl SkinClassifier {
    /// A kind of the clothes is the most likely class of this tone.
    #[inline]
    pub(super) fn is_clothes(&self, c: &[f32; 3]) -> bool {
        let other = self.skin.log_density(c).max(self.unknown_clothes);
        self.clothes.iter().any(|k| k.log_density(c) > other)
    }
}

/// Tones of a component below which it is a speck, or a finger in an unexpected place.
const SPECK: usize = 8;

/// Squared distance of two tones in clustering.
fn squared_distance(a: &[f32; 3], b: &[f32; 3], brightness: f32) -> f32 {
    (brightness * (a[0] - b[0])).powi(2) + (a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)
}

/// Mixture components of the tones of clothes: farthest-point seeds, then k-means.
fn cluster(tones: &[[f32; 3]], settings: &SkinSettings) -> Vec<Gaussian> {
    let mut centres = farthest_points(tones, settings.brightness);
    let mut members = vec![Vec::new(); centres.len()];
    for _ in 0..ITERATIONS {
        members.iter_mut().for_each(Vec::clear);
        for c in tones {
            let distance = |k: &usize| squared_distance(c, &centres[*k], settings.brightness);
            let best = (0..centres.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
            members[best.unwrap_or(0)].push(*c);
        }
        for (centre, of) in centres.iter_mut().zip(&members) {
            if !of.is_empty() {
                *centre = Gaussian::of(of, 1.0, &settings.min_sigma).mean;
            }
        }
    }
    let share = |of: &Vec<[f32; 3]>| of.len() as f32 / tones.len() as f32;
    members
        .iter()
        .filter(|of| of.len() >= SPECK)
        .map(|of| Gaussian::of(of, share(of), &settings.min_sigma))
        .collect()
}

/// Up to [`KINDS`] tones, each the farthest from those before it.
fn farthest_points(tones: &[[f32; 3]], brightness: f32) -> Vec<[f32; 3]> {
    let mut centres = vec![tones[0]];
    let mut nearest = vec![f32::INFINITY; tones.len()];
    while centres.len() < KINDS {
        let last = centres[centres.len() - 1];
        for (n, c) in nearest.iter_mut().zip(tones) {
            *n = n.min(squared_distance(c, &last, brightness));
        }
        let farthest = (0..tones.len()).max_by(|&a, &b| nearest[a].total_cmp(&nearest[b]));
        let Some(k) = farthest else { break };
        centres.push(tones[k]);
    }
    centres
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `n` tones spread a few grey levels about one.
    fn spread(rgb: [u8; 3], n: usize) -> Vec<[f32; 3]> {
        let [y, b, r] = tone(rgb);
        (0..n)
            .map(|i| {
                let t = |k: usize| (i * k % 7) as f32 - 3.0;
                [y + 3.0 * t(1), b + t(2), r + t(3)]
            })
            .collect()
    }

    const SKIN: [u8; 3] = [205, 160, 135];
    const SHIRT: [u8; 3] = [40, 60, 120];
    const TROUSERS: [u8; 3] = [30, 30, 34];

    #[test]
    fn skin_is_separated_from_two_clothes() {
        let settings = SkinSettings::default();
        let mut clothes = spread(SHIRT, 40);
        clothes.extend(spread(TROUSERS, 40));
        let c = SkinClassifier::fit(&spread(SKIN, 40), &clothes, &settings).expect("enough tones");
        assert!(c.is_skin(&tone(SKIN)));
        assert!(!c.is_skin(&tone(SHIRT)) && !c.is_skin(&tone(TROUSERS)));
        assert!(
            !c.is_skin(&tone([0, 255, 0])),
            "an unknown colour is clothes"
        );
    }

    #[test]
    fn few_or_equal_tones_are_degenerate_but_finite() {
        let settings = SkinSettings::default();
        let fit =
            |skin: &[[f32; 3]], clothes: &[[f32; 3]]| SkinClassifier::fit(skin, clothes, &settings);
        assert_eq!(fit(&spread(SKIN, 11), &spread(SHIRT, 40)), None);
        assert_eq!(fit(&spread(SKIN, 40), &[]), None);
        let one = Gaussian::of(&[tone(SKIN); 20], 1.0, &settings.min_sigma);
        assert!(one.log_density(&tone(SKIN)).is_finite());
        assert_eq!(cluster(&[tone(SHIRT); 20], &settings).len(), 1);
    }
}
