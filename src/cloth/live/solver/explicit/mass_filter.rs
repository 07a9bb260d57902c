//! Selective mass scaling (Olovsson, Simonsson and Unosson 2005) by its inverse (Tkachuk and Bischoff 2015).
//!
//! The finest waves of a mesh bound explicit steps; more inertia allows longer ones. Here a = W M⁻¹ f with W = w(M⁻¹L),
//! L the Laplacian of the sheet's edges and w a polynomial with w(0) = 1. W M⁻¹ is symmetric and positive, so momentum
//! and energy (with that inertia) are conserved. W 1 = 1, so free fall is exact; f = 0 implies a = 0, so equilibria stay.
//! The cost is one weighted sum over neighbours for each degree.

use super::edge_stiffness::TriangleSprings;
use crate::live::Sheet;
use crate::settings::SolverSettings;
use nalgebra::Vector2;

/// MassFilter W, as weights of edges.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MassFilter {
    /// Ends of each edge.
    pub(super) ends: Vec<[u32; 2]>,
    /// Weight of each edge, kg, such that no eigenvalue of M⁻¹L is above 1.
    pub(super) weight: Vec<f64>,
    pub(super) inverse_mass: Vec<f64>,
    /// Coefficients of w, the lowest (1) first; of degree 0 where nothing is filtered.
    pub(super) coefficients: Vec<f64>,
}

/// Iterations of the power method. Fewer underestimate the eigenvalue by more than its margin.
const POWER_ITERATIONS: usize = 60;

/// Coefficients of w(s) = (1 − Tₙ(u) / Tₙ(u₀)) / (c s) with n = degree + 1, u falling from u₀ at s = 0 to −1 at s = 1:
/// the polynomial with w(0) = 1 and (nearly) the smallest s·w(s) on 0 to 1, about 1/n² (van der Houwen's damped stability
/// polynomials).
pub(super) fn coefficients(degree: usize, damping: f64) -> Vec<f64> {
    if degree == 0 {
        return vec![1.0];
    }
    let n = degree + 1;
    let u0 = 1.0 + damping / (n * n) as f64;
    // Tₖ(u₀ − (1 + u₀) s) as polynomials in s, by Tₖ₊₁ = 2u Tₖ − Tₖ₋₁.
    let (mut before, mut now) = (vec![1.0], vec![u0, -(1.0 + u0)]);
    for _ in 1..n {
        let mut next = vec![0.0; now.len() + 1];
        for (k, c) in now.iter().enumerate() {
            next[k] += 2.0 * u0 * c;
            next[k + 1] -= 2.0 * (1.0 + u0) * c;
        }
        for (k, c) in before.iter().enumerate() {
            next[k] -= c;
        }
        before = std::mem::replace(&mut now, next);
    }
    (1..=n).map(|k| now[k] / now[1]).collect()
}

impl MassFilter {
    /// Filter of a sheet, with the edges' own stiffness as weights. `ends` of its edges, the lower vertex first.
    pub(super) fn of_sheet(
        sheet: &Sheet,
        ends: Vec<[u32; 2]>,
        degree: usize,
        settings: &SolverSettings,
    ) -> Self {
        let mut order: Vec<([u32; 2], usize)> =
            ends.iter().enumerate().map(|(i, e)| (*e, i)).collect();
        order.sort_unstable();
        let mut own = vec![0.0; ends.len()];
        for t in sheet
            .elements
            .iter()
            .filter_map(|e| TriangleSprings::new(sheet, e))
        {
            for i in 0..3 {
                let (a, b) = (t.v[(i + 1) % 3], t.v[(i + 2) % 3]);
                if let Ok(at) = order.binary_search_by_key(&[a.min(b), a.max(b)], |o| o.0) {
                    own[order[at].1] += t.stiffness[(i, i)];
                }
            }
        }
        let inverse_mass = sheet.mass.iter().map(|m| 1.0 / m).collect();
        Self::new(ends, &own, inverse_mass, degree, settings)
    }
    /// Filter with weights in proportion to the `stiffness` of each edge (N/m). Regions stiffer for their mass than most
    /// are normalised by themselves, so that one sliver does not weaken the filter elsewhere.
    fn new(
        ends: Vec<[u32; 2]>,
        stiffness: &[f64],
        inverse_mass: Vec<f64>,
        degree: usize,
        settings: &SolverSettings,
    ) -> Self {
        let mut around = vec![0.0; inverse_mass.len()];
        for (e, k) in ends.iter().zip(stiffness) {
            e.iter().for_each(|v| around[*v as usize] += k);
        }
        let rate = |v: u32| around[v as usize] * inverse_mass[v as usize];
        let mut all: Vec<f64> = (0..around.len() as u32).map(rate).collect();
        all.sort_unstable_by(f64::total_cmp);
        let usual = all
            .get((all.len() as f64 * settings.usual_quantile) as usize)
            .copied()
            .unwrap_or(0.0)
            .max(f64::MIN_POSITIVE);
        let of = |(e, k): (&[u32; 2], &f64)| k / rate(e[0]).max(rate(e[1])).max(usual);
        let weight = ends.iter().zip(stiffness).map(of).collect();
        let mut filter = Self {
            ends,
            weight,
            inverse_mass,
            coefficients: coefficients(degree, settings.filter_damping),
        };
        if degree > 0 {
            let largest = settings.eigenvalue_margin * filter.largest_eigenvalue();
            let scale = 1.0 / largest.max(f64::MIN_POSITIVE);
            filter.weight.iter_mut().for_each(|w| *w *= scale);
        }
        filter
    }
    /// Identity on the same sheet.
    pub(super) fn identity(&self) -> Self {
        Self {
            coefficients: vec![1.0],
            ..self.clone()
        }
    }
    /// Largest eigenvalue of M⁻¹L.
    fn largest_eigenvalue(&self) -> f64 {
        let mut x = noise(self.inverse_mass.len());
        let mut value = 0.0;
        for _ in 0..POWER_ITERATIONS {
            let y = self.laplacian(&x);
            let (mut along, mut whole, mut norm) = (0.0, 0.0, 0.0);
            for ((x, y), m) in x.iter().zip(&y).zip(&self.inverse_mass) {
                along += x.dot(y) / m;
                whole += x.norm_squared() / m;
                norm += y.norm_squared() / m;
            }
            value = along / whole.max(f64::MIN_POSITIVE);
            let scale = 1.0 / norm.sqrt().max(f64::MIN_POSITIVE);
            x.iter_mut().zip(&y).for_each(|(x, y)| *x = y * scale);
        }
        value
    }
    fn laplacian(&self, x: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
        let mut y = vec![Vector2::zeros(); x.len()];
        for (e, w) in self.ends.iter().zip(&self.weight) {
            let [a, b] = e.map(|v| v as usize);
            let d = (x[a] - x[b]) * *w;
            y[a] += d * self.inverse_mass[a];
            y[b] -= d * self.inverse_mass[b];
        }
        y
    }
    /// W x.
    pub(super) fn apply(&self, x: &mut [Vector2<f64>]) {
        let Some((last, lower)) = self.coefficients.split_last() else {
            return;
        };
        if lower.is_empty() {
            return;
        }
        let mut y: Vec<Vector2<f64>> = x.iter().map(|x| x * *last).collect();
        for c in lower.iter().rev() {
            y = self.laplacian(&y);
            y.iter_mut().zip(&*x).for_each(|(y, x)| *y += x * *c);
        }
        x.copy_from_slice(&y);
    }
}

/// Initial vector of power iterations, with a component along every mode.
pub(super) fn noise(n: usize) -> Vec<Vector2<f64>> {
    let of = |i: usize| {
        let r = (i as u32).wrapping_mul(2_654_435_761);
        Vector2::new(
            f64::from(r & 0xffff) - 32_767.5,
            f64::from(r >> 16) - 32_767.5,
        )
    };
    (0..n).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomial_starts_at_one_stays_positive_and_bounds_s_times_w() {
        for degree in 0..4 {
            let w = coefficients(degree, SolverSettings::default().filter_damping);
            assert_eq!(w.len(), degree + 1);
            assert!((w[0] - 1.0).abs() < 1e-12);
            let at = |s: f64| w.iter().rev().fold(0.0, |a, c| a * s + c);
            let all = (0..=1000).map(|k| f64::from(k) / 1000.0);
            assert!(all.clone().all(|s| at(s) > 0.02), "degree {degree}");
            let most = all.map(|s| s * at(s)).fold(0.0, f64::max);
            let n = (degree + 1) as f64;
            assert!(
                degree == 0 || most < 1.25 / (n * n),
                "degree {degree}: {most}"
            );
        }
    }
}
