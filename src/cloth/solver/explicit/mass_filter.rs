//! Smoothing of accelerations: fine waves get more inertia, everything else keeps what it has.
//!
//! Explicit steps are bound by the finest waves a mesh can hold, which nobody watches. Selective mass scaling (Olovsson,
//! Simonsson and Unosson 2005) gives them inertia; here its inverse is given, as Tkachuk and Bischoff 2015 do: a = W M⁻¹ f
//! with W = w(M⁻¹L), L the Laplacian of the sheet's edges and w a polynomial with w(0) = 1. W M⁻¹ is symmetric and
//! positive, so energy (with that inertia) and momentum are kept; W 1 = 1, so a sheet falls as it should; f = 0 rests
//! where it did, so stiffness is what it was. Costs one weighted sum over neighbours for each degree.

use nalgebra::Vector2;

/// W as weights of edges.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Filter {
    /// Ends of each edge.
    pub(super) ends: Vec<[u32; 2]>,
    /// Weight of each edge, kg, such that no eigenvalue of M⁻¹L is above 1.
    pub(super) weight: Vec<f64>,
    pub(super) inverse_mass: Vec<f64>,
    /// Coefficients of w, the lowest first; only 1 where nothing is smoothed.
    pub(super) w: Vec<f64>,
}

/// How far the argument of the Chebyshev polynomial starts beyond 1, times its degree squared: no wave keeps less than
/// a twentieth of its acceleration. Less, and such waves would be as good as free of forces; more shortens the step.
const DAMPING: f64 = 1.0;
/// Room for the estimate of the largest eigenvalue, which is one from below (ratio).
const ROOM: f64 = 1.03;
/// Share of the vertices that count as most.
const MOST: f64 = 0.9;
/// Products of the power iteration for it.
const PRODUCTS: usize = 60;

/// Coefficients of w(s) = (1 − Tₙ(u) / Tₙ(u₀)) / (c s) with n = degree + 1, u falling from u₀ at s = 0 to −1 at s = 1:
/// of all polynomials with w(0) = 1 the one with (nearly) the smallest s·w(s) on 0 to 1, about 1/n² (van der Houwen's
/// damped stability polynomials).
pub(super) fn coefficients(degree: usize) -> Vec<f64> {
    if degree == 0 {
        return vec![1.0];
    }
    let n = degree + 1;
    let u0 = 1.0 + DAMPING / (n * n) as f64;
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

impl Filter {
    /// `stiffness` of each edge says which neighbours it is coupled to, N/m. Places stiffer for their mass than most are
    /// normalised by themselves, so that one narrow triangle does not leave all others without a filter.
    pub(super) fn new(
        ends: Vec<[u32; 2]>,
        stiffness: &[f64],
        inverse_mass: Vec<f64>,
        degree: usize,
    ) -> Self {
        let mut around = vec![0.0; inverse_mass.len()];
        for (e, k) in ends.iter().zip(stiffness) {
            e.iter().for_each(|v| around[*v as usize] += k);
        }
        let rate = |v: u32| around[v as usize] * inverse_mass[v as usize];
        let mut all: Vec<f64> = (0..around.len() as u32).map(rate).collect();
        all.sort_unstable_by(f64::total_cmp);
        let usual = all
            .get((all.len() as f64 * MOST) as usize)
            .copied()
            .unwrap_or(0.0)
            .max(f64::MIN_POSITIVE);
        let of = |(e, k): (&[u32; 2], &f64)| k / rate(e[0]).max(rate(e[1])).max(usual);
        let weight = ends.iter().zip(stiffness).map(of).collect();
        let mut filter = Self {
            ends,
            weight,
            inverse_mass,
            w: coefficients(degree),
        };
        if degree > 0 {
            let scale = 1.0 / (ROOM * filter.largest()).max(f64::MIN_POSITIVE);
            filter.weight.iter_mut().for_each(|w| *w *= scale);
        }
        filter
    }
    /// The identity on the same sheet.
    pub(super) fn without(&self) -> Self {
        Self {
            w: vec![1.0],
            ..self.clone()
        }
    }
    /// Largest eigenvalue of M⁻¹L.
    fn largest(&self) -> f64 {
        let mut x = noise(self.inverse_mass.len());
        let mut value = 0.0;
        for _ in 0..PRODUCTS {
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
        let Some((last, lower)) = self.w.split_last() else {
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

/// A start for power iterations that has something of every wave.
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
    fn the_polynomial_starts_at_one_stays_positive_and_bounds_s_times_w() {
        for degree in 0..4 {
            let w = coefficients(degree);
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
