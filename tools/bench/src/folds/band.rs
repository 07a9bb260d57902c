//! Folds of a surface in a band of wavelengths: normals over the pattern, filtered, and the direction across which they change.
//!
//! The deviation of a unit normal from the smooth surface's is the slope of its folds, for small slopes.

use super::pattern_grid::CELL;
use std::f32::consts::PI;
use tryon_geometry::math::V3;

/// Filter of wavelengths (m); at its ends half of the amplitude is left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoldBand {
    /// Shortest wavelength.
    pub short: f32,
    /// Longest wavelength.
    pub long: f32,
}

impl FoldBand {
    /// Folds finer than the simulation.
    pub const WRINKLES: Self = Self {
        short: 0.010,
        long: 0.060,
    };
}

/// Normals at the cells of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalField {
    /// Cells in a row.
    pub width: usize,
    /// Unit normals, shape `[height · width]`; `None` beside the panel.
    pub normals: Vec<Option<V3>>,
}

/// Folds in one cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FoldCell {
    /// Squared deviation of the normal.
    pub energy: f32,
    /// Mean of the energy around.
    pub around: f32,
    /// Direction across the folds around, in the pattern (rad, modulo π).
    pub across: f32,
}

/// Deviation of the Gaussian by which directions and energies around a cell are averaged (m).
const AROUND: f32 = 0.015;
/// Share of a Gaussian of the longest wavelength that lies on the panel, at cells that are judged: one deviation (15 mm for
/// 60 mm) from a straight edge. Nearer, the smooth surface isn't known.
const INSIDE: f32 = 0.84;
/// Deviation of a Gaussian over a wavelength λ at which a filter of two passes leaves half: exp(−2π²σ²/λ²) = 1 − √½.
const DEVIATION: f32 = 0.2494;
/// Radius of a kernel in deviations.
const REACH: f32 = 3.0;

/// Gaussian means over the cells of a panel.
struct PanelFilter<'a> {
    width: usize,
    inside: &'a [bool],
}

impl PanelFilter<'_> {
    /// Sum of values weighted by a Gaussian, cells beside the panel as 0.
    fn sum<const N: usize>(&self, values: &[[f32; N]], deviation: f32) -> Vec<[f32; N]> {
        let cells = deviation / CELL;
        let radius = (REACH * cells).ceil() as usize;
        let weight = |i: usize| (-0.5 * (i as f32 / cells).powi(2)).exp();
        let kernel: Vec<f32> = (0..=radius).map(weight).collect();
        let total = kernel[0] + 2.0 * kernel[1..].iter().sum::<f32>();
        let height = values.len() / self.width.max(1);
        let rows = convolved(values, &kernel, [self.width, height], [1, self.width]);
        let mut out = convolved(&rows, &kernel, [height, self.width], [self.width, 1]);
        for v in out.iter_mut().flatten() {
            *v /= total * total;
        }
        out
    }

    /// Share of a Gaussian around each cell that lies on the panel.
    fn coverage(&self, deviation: f32) -> Vec<f32> {
        let inside: Vec<[f32; 1]> = self
            .inside
            .iter()
            .map(|i| [f32::from(u8::from(*i))])
            .collect();
        let sums = self.sum(&inside, deviation);
        sums.into_iter().map(|[sum]| sum).collect()
    }

    /// Gaussian mean over the panel; 0 beside it.
    fn mean<const N: usize>(&self, values: &[[f32; N]], deviation: f32) -> Vec<[f32; N]> {
        let coverage = self.coverage(deviation);
        let mut out = self.sum(values, deviation);
        for ((v, share), inside) in out.iter_mut().zip(coverage).zip(self.inside) {
            *v = if *inside {
                v.map(|v| v / share)
            } else {
                [0.0; N]
            };
        }
        out
    }

    /// Values less their mean.
    fn residual(&self, values: &[[f32; 3]], deviation: f32) -> Vec<[f32; 3]> {
        let means = self.mean(values, deviation);
        let both = values.iter().zip(&means);
        both.map(|(v, m)| [0, 1, 2].map(|k| v[k] - m[k])).collect()
    }

    /// Two passes of a high-pass, then of a low-pass: (1 − G)², and 1 − (1 − G)².
    fn band(&self, values: &[[f32; 3]], band: FoldBand) -> Vec<[f32; 3]> {
        let [short, long] = [band.short, band.long].map(|wave| DEVIATION * wave);
        let high = self.residual(&self.residual(values, long), long);
        let lost = self.residual(&self.residual(&high, short), short);
        let both = high.iter().zip(&lost);
        both.map(|(h, l)| [0, 1, 2].map(|k| h[k] - l[k])).collect()
    }
}

/// Convolution along one axis; `count` and `stride` are those of the axis, then of the other one.
fn convolved<const N: usize>(
    values: &[[f32; N]],
    kernel: &[f32],
    count: [usize; 2],
    stride: [usize; 2],
) -> Vec<[f32; N]> {
    let mut out = vec![[0.0; N]; values.len()];
    for line in 0..count[1] {
        let first = line * stride[1];
        for i in 0..count[0] {
            let from = i.saturating_sub(kernel.len() - 1);
            let to = (i + kernel.len()).min(count[0]);
            let mut sum = [0.0; N];
            for j in from..to {
                let (value, weight) = (&values[first + j * stride[0]], kernel[i.abs_diff(j)]);
                for (s, v) in sum.iter_mut().zip(value) {
                    *s += weight * v;
                }
            }
            out[first + i * stride[0]] = sum;
        }
    }
    out
}

impl NormalField {
    /// Folds of each cell; `None` beside the panel and near its edge.
    pub fn folds(&self, band: FoldBand) -> Vec<Option<FoldCell>> {
        let inside: Vec<bool> = self.normals.iter().map(Option::is_some).collect();
        let filter = PanelFilter {
            width: self.width,
            inside: &inside,
        };
        let normals: Vec<[f32; 3]> = self
            .normals
            .iter()
            .map(|n| n.unwrap_or_default().into())
            .collect();
        let bent = filter.band(&normals, band);
        let energy = |i: usize| bent[i].iter().map(|b| b * b).sum::<f32>();
        let tensor = |i: usize| {
            let [xx, yy, xy] = self.structure(&bent, i);
            [xx, yy, xy, energy(i)]
        };
        let tensors: Vec<[f32; 4]> = (0..bent.len()).map(tensor).collect();
        let means = filter.mean(&tensors, AROUND);
        let coverage = filter.coverage(DEVIATION * band.long);
        let cell = |i: usize| {
            let [xx, yy, xy, around] = means[i];
            (inside[i] && coverage[i] > INSIDE).then(|| FoldCell {
                energy: energy(i),
                around,
                across: 0.5 * (2.0 * xy).atan2(xx - yy),
            })
        };
        (0..bent.len()).map(cell).collect()
    }

    /// Structure tensor (xx, yy, xy) of a field of vectors in a cell (Di Zenzo 1986), by central differences.
    fn structure(&self, bent: &[[f32; 3]], i: usize) -> [f32; 3] {
        let slope = |stride: usize| {
            let (a, b) = (i.checked_sub(stride), i + stride);
            let on_panel = |k: usize| self.normals.get(k).is_some_and(Option::is_some);
            match a.filter(|a| on_panel(*a) && on_panel(b)) {
                Some(a) => [0, 1, 2].map(|k| bent[b][k] - bent[a][k]),
                None => [0.0; 3],
            }
        };
        let [x, y] = [1, self.width].map(slope);
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        [dot(x, x), dot(y, y), dot(x, y)]
    }
}

/// Angle between two directions modulo π (rad), 0 to π/2.
pub fn apart(a: f32, b: f32) -> f32 {
    let d = (a - b).rem_euclid(PI);
    d.min(PI - d)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Wave of a height field: length (m), greatest slope, direction across it (rad).
    type Wave = (f32, f32, f32);

    /// Mean energy and median direction of waves on a panel of 30 by 36 cm.
    fn measured(waves: &[Wave]) -> (f32, f32) {
        let (width, height) = (100, 120);
        let normal = |i: usize| {
            let [x, y] = [i % width, i / width].map(|c| c as f32 * CELL);
            let mut slope = [0.0f32; 2];
            for (length, steep, across) in waves {
                let (s, c) = across.sin_cos();
                let g = steep * (2.0 * PI * (x * c + y * s) / length).cos();
                slope[0] += g * c;
                slope[1] += g * s;
            }
            Some(V3::new(-slope[0], -slope[1], 1.0).normalize())
        };
        let field = NormalField {
            width,
            normals: (0..width * height).map(normal).collect(),
        };
        let cells = field.folds(FoldBand::WRINKLES);
        let cells: Vec<FoldCell> = cells.into_iter().flatten().collect();
        let mean = cells.iter().map(|c| c.energy).sum::<f32>() / cells.len() as f32;
        let mut across: Vec<f32> = cells.iter().map(|c| c.across.rem_euclid(PI)).collect();
        across.sort_by(f32::total_cmp);
        (mean, across[across.len() / 2])
    }

    #[test]
    fn a_wave_in_the_band_has_its_energy_and_direction() {
        for across in [0.3, 1.2, 2.5] {
            let (energy, found) = measured(&[(0.030, 0.1, across)]);
            assert!((energy / 0.005 - 0.95).abs() < 0.05, "{energy}");
            assert!(apart(found, across) < 0.02, "{found} {across}");
        }
    }

    #[test]
    fn waves_outside_the_band_do_not_count() {
        let (long, _) = measured(&[(0.200, 0.3, 0.4)]);
        assert!(long < 0.03 * 0.045, "{long}");
        let (short, _) = measured(&[(0.0065, 0.1, 0.4)]);
        assert!(short < 0.1 * 0.005, "{short}");
    }

    #[test]
    fn a_wave_on_a_long_one_counts_as_itself() {
        let (alone, _) = measured(&[(0.030, 0.1, 1.0)]);
        let (both, across) = measured(&[(0.030, 0.1, 1.0), (0.200, 0.2, 0.2)]);
        assert!((both / alone - 1.0).abs() < 0.1, "{both} {alone}");
        assert!(apart(across, 1.0) < 0.03, "{across}");
    }
}
