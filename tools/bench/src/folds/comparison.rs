//! Drawn folds against those of the offline solver, cell by cell.

use super::band::{FoldCell, apart};
use crate::Row;
use tryon_geometry::math::order_statistics::median;

/// Deviation of normals (root mean square) from which folds have a direction: 3°, about what is seen.
const SEEN: f32 = 0.05;

/// Result of a comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FoldComparison {
    /// Energy of the drawn folds over that of the truth.
    pub energy: f64,
    /// Median angle between directions where both have folds (degrees).
    pub angle: f64,
    /// Share of the cells in which both have.
    pub both: f64,
    /// Correlation of the local root mean squares: folds are where the truth has them.
    pub placing: f64,
    /// Deviation of the truth's normals, root mean square.
    pub truth: f64,
}

/// Pearson's correlation; 0 where one is constant.
fn correlation(pairs: &[[f64; 2]]) -> f64 {
    let n = pairs.len().max(1) as f64;
    let mean = [0, 1].map(|k| pairs.iter().map(|p| p[k]).sum::<f64>() / n);
    let moment = |a: usize, b: usize| -> f64 {
        let both = pairs.iter().map(|p| (p[a] - mean[a]) * (p[b] - mean[b]));
        both.sum()
    };
    moment(0, 1) / (moment(0, 0) * moment(1, 1)).sqrt().max(f64::MIN_POSITIVE)
}

impl FoldComparison {
    /// Compares the cells of all panels; those that only one has are left out.
    pub fn of(drawn: &[Option<FoldCell>], truth: &[Option<FoldCell>]) -> Self {
        let pairs = drawn.iter().zip(truth);
        let pairs: Vec<(FoldCell, FoldCell)> =
            pairs.filter_map(|(a, b)| Some(((*a)?, (*b)?))).collect();
        let sum = |of: fn(&(FoldCell, FoldCell)) -> f32| -> f64 {
            pairs.iter().map(|p| f64::from(of(p))).sum()
        };
        let [drawn_energy, true_energy] = [sum(|p| p.0.energy), sum(|p| p.1.energy)];
        let is_seen = |c: &FoldCell| c.around > SEEN * SEEN;
        let folded = pairs.iter().filter(|(a, b)| is_seen(a) && is_seen(b));
        let mut angles: Vec<f32> = folded.map(|(a, b)| apart(a.across, b.across)).collect();
        let local = |c: &FoldCell| f64::from(c.around.max(0.0).sqrt());
        let places: Vec<[f64; 2]> = pairs.iter().map(|(a, b)| [local(a), local(b)]).collect();
        let count = pairs.len().max(1) as f64;
        Self {
            energy: drawn_energy / true_energy.max(f64::MIN_POSITIVE),
            angle: median(&mut angles).map_or(f64::NAN, |a| f64::from(a.to_degrees())),
            both: angles.len() as f64 / count,
            placing: correlation(&places),
            truth: (true_energy / count).sqrt(),
        }
    }

    /// Row with these errors.
    pub fn add_to(&self, row: Row) -> Row {
        row.error("truth_rms_percent", self.truth * 100.0)
            .error("energy_percent", self.energy * 100.0)
            .error("angle_deg", self.angle)
            .error("both_percent", self.both * 100.0)
            .error("placing", self.placing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_slope_is_a_quarter_of_the_energy() {
        let cell = |rms: f32, across: f32| {
            let energy = rms * rms;
            Some(FoldCell {
                energy,
                around: energy,
                across,
            })
        };
        let truth = [cell(0.2, 0.1), cell(0.1, 3.1), None, cell(0.01, 0.0)];
        let drawn = [
            cell(0.1, 0.3),
            cell(0.05001, 0.159),
            cell(1.0, 0.0),
            cell(0.005, 1.0),
        ];
        let result = FoldComparison::of(&drawn, &truth);
        assert!((result.energy - 0.25).abs() < 1e-3, "{result:?}");
        assert!((result.both - 2.0 / 3.0).abs() < 1e-6);
        assert!((result.angle - 11.46).abs() < 0.05, "{result:?}");
        assert!(result.placing > 0.999);
    }
}
