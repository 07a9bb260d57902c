//! Finite-difference check of an energy or a least-squares residual: value, gradient, Jacobian, Hessian and weight
//! scaling (after momentum's error-function checks).

use nalgebra::{DMatrix, DVector};

/// Value and derivatives of a term at one point. Unset parts are not checked.
#[derive(Clone, Debug, Default)]
pub struct Derivatives {
    /// Energy; with `rows`, ½ Σ wᵢ rᵢ².
    pub value: f64,
    /// Derivative of the energy, shape `[unknowns]`.
    pub gradient: DVector<f64>,
    /// Second derivative, shape `[unknowns × unknowns]`; with `rows`, its Gauss–Newton part Jᵀ W J.
    pub hessian: Option<DMatrix<f64>>,
    /// Residual rows of a least-squares term.
    pub rows: Option<Rows>,
}

/// Stacked residuals of a least-squares term.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// r, shape `[rows]`.
    pub residual: DVector<f64>,
    /// w, shape `[rows]`.
    pub weights: DVector<f64>,
    /// ∂r/∂x, shape `[rows × unknowns]`.
    pub jacobian: DMatrix<f64>,
}

impl Derivatives {
    /// An energy without second derivative.
    pub fn energy(value: f64, gradient: Vec<f64>) -> Self {
        Self {
            value,
            gradient: DVector::from_vec(gradient),
            ..Self::default()
        }
    }
    /// The same with its Hessian.
    pub fn with_hessian(mut self, hessian: DMatrix<f64>) -> Self {
        self.hessian = Some(hessian);
        self
    }
}

/// Step and tolerance of the comparison.
#[derive(Clone, Copy, Debug)]
pub struct DerivativeCheck {
    /// Half the distance between the two samples of a central difference, in units of the unknowns.
    pub step: f64,
    /// Largest error relative to the larger of the two compared arrays.
    pub tolerance: f64,
    /// Magnitude of an array below which its error counts as absolute.
    pub floor: f64,
}

impl Default for DerivativeCheck {
    /// Suits energies in f64 whose unknowns are of order one: h² and ε/h errors meet near 1e-5.
    fn default() -> Self {
        Self {
            step: 1e-5,
            tolerance: 1e-5,
            floor: 1e-9,
        }
    }
}

impl DerivativeCheck {
    /// Compares `evaluate(x, weight)` with finite differences at each of `points` and checks that weight 2 doubles it.
    ///
    /// # Panics
    /// On the first disagreement; the message names point and entry.
    pub fn run(&self, points: &[Vec<f64>], evaluate: impl Fn(&[f64], f64) -> Derivatives) {
        assert!(!points.is_empty(), "a check without points");
        for (number, x) in points.iter().enumerate() {
            let at = format!("point {number} {x:?}");
            let here = self.finite(x, &evaluate, &at);
            let double = evaluate(x, 2.0);
            self.agree(
                &format!("{at}: weighted value"),
                [double.value],
                [2.0 * here.value],
            );
            self.agree(
                &format!("{at}: weighted gradient"),
                double.gradient.iter().copied(),
                here.gradient.iter().map(|g| 2.0 * g),
            );
            self.differences(x, &here, &evaluate, &at);
            if let Some(rows) = &here.rows {
                self.least_squares(&here, rows, &at);
            }
        }
    }

    /// Checks only that value and derivatives are finite and of the right shape: for points where the term has a kink,
    /// a pole or nothing to differentiate.
    pub fn run_degenerate(
        &self,
        points: &[Vec<f64>],
        evaluate: impl Fn(&[f64], f64) -> Derivatives,
    ) {
        assert!(!points.is_empty(), "a check without points");
        for (number, x) in points.iter().enumerate() {
            self.finite(x, &evaluate, &format!("degenerate point {number} {x:?}"));
        }
    }

    fn finite(
        &self,
        x: &[f64],
        evaluate: &impl Fn(&[f64], f64) -> Derivatives,
        at: &str,
    ) -> Derivatives {
        let here = evaluate(x, 1.0);
        assert!(here.value.is_finite(), "{at}: value {}", here.value);
        assert_eq!(here.gradient.len(), x.len(), "{at}: length of the gradient");
        let finite = |m: &[f64]| m.iter().all(|v| v.is_finite());
        assert!(
            finite(here.gradient.as_slice()),
            "{at}: gradient {}",
            here.gradient
        );
        if let Some(h) = &here.hessian {
            assert_eq!(h.shape(), (x.len(), x.len()), "{at}: shape of the Hessian");
            assert!(finite(h.as_slice()), "{at}: Hessian {h}");
            let transposed = h.transpose();
            self.agree(
                &format!("{at}: symmetry of the Hessian"),
                h.iter().copied(),
                transposed.iter().copied(),
            );
        }
        if let Some(rows) = &here.rows {
            let shape = (rows.residual.len(), x.len());
            assert_eq!(rows.jacobian.shape(), shape, "{at}: shape of the Jacobian");
            assert!(
                finite(rows.residual.as_slice()) && finite(rows.jacobian.as_slice()),
                "{at}: rows {rows:?}"
            );
        }
        here
    }

    /// Central differences of the value; of the gradient too when there is a Hessian of no least-squares term; of the
    /// residual when there are rows.
    fn differences(
        &self,
        x: &[f64],
        here: &Derivatives,
        evaluate: &impl Fn(&[f64], f64) -> Derivatives,
        at: &str,
    ) {
        let sides = |k: usize| {
            [self.step, -self.step].map(|h| {
                let mut moved = x.to_vec();
                moved[k] += h;
                evaluate(&moved, 1.0)
            })
        };
        let span = 2.0 * self.step;
        let mut slopes = Vec::with_capacity(x.len());
        for k in 0..x.len() {
            let [ahead, behind] = sides(k);
            slopes.push((ahead.value - behind.value) / span);
            if let (Some(here), Some(ahead), Some(behind)) = (&here.rows, &ahead.rows, &behind.rows)
            {
                self.agree(
                    &format!("{at}: column {k} of the Jacobian"),
                    here.jacobian.column(k).iter().copied(),
                    ((&ahead.residual - &behind.residual) / span)
                        .iter()
                        .copied(),
                );
            } else if let Some(hessian) = &here.hessian {
                self.agree(
                    &format!("{at}: column {k} of the Hessian"),
                    hessian.column(k).iter().copied(),
                    ((&ahead.gradient - &behind.gradient) / span)
                        .iter()
                        .copied(),
                );
            }
        }
        let gradient = here.gradient.iter().copied();
        self.agree(&format!("{at}: gradient"), gradient, slopes);
    }

    /// value = ½ rᵀ W r, gradient = Jᵀ W r, Hessian = Jᵀ W J.
    fn least_squares(&self, here: &Derivatives, rows: &Rows, at: &str) {
        let weighted = rows.residual.component_mul(&rows.weights);
        let value = 0.5 * rows.residual.dot(&weighted);
        self.agree(&format!("{at}: ½ rᵀ W r"), [here.value], [value]);
        let gradient = rows.jacobian.transpose() * &weighted;
        self.agree(
            &format!("{at}: Jᵀ W r"),
            here.gradient.iter().copied(),
            gradient.iter().copied(),
        );
        if let Some(hessian) = &here.hessian {
            let squared =
                rows.jacobian.transpose() * DMatrix::from_diagonal(&rows.weights) * &rows.jacobian;
            self.agree(
                &format!("{at}: Jᵀ W J"),
                hessian.iter().copied(),
                squared.iter().copied(),
            );
        }
    }

    /// Panics unless both arrays agree within the tolerance of the larger one's largest entry.
    fn agree(
        &self,
        label: &str,
        ours: impl IntoIterator<Item = f64>,
        reference: impl IntoIterator<Item = f64>,
    ) {
        let (ours, reference): (Vec<f64>, Vec<f64>) =
            (ours.into_iter().collect(), reference.into_iter().collect());
        assert_eq!(ours.len(), reference.len(), "{label}: lengths");
        let largest = |v: &[f64]| v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let scale = largest(&ours).max(largest(&reference)).max(self.floor);
        for (i, (a, b)) in ours.iter().zip(&reference).enumerate() {
            let error = (a - b).abs();
            assert!(
                error <= self.tolerance * scale,
                "{label}, entry {i}: {a} against {b}, error {error:.3e} at scale {scale:.3e}"
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// E = w (x⁴ + 3 x y²).
    fn quartic(x: &[f64], w: f64) -> Derivatives {
        let (x, y) = (x[0], x[1]);
        let gradient = vec![w * (4.0 * x.powi(3) + 3.0 * y * y), w * 6.0 * x * y];
        let hessian = [12.0 * x * x, 6.0 * y, 6.0 * y, 6.0 * x].map(|h| w * h);
        Derivatives::energy(w * (x.powi(4) + 3.0 * x * y * y), gradient)
            .with_hessian(DMatrix::from_row_slice(2, 2, &hessian))
    }

    /// r = (x², x y), weights 2 w and w.
    fn products(x: &[f64], w: f64) -> Derivatives {
        let (x, y) = (x[0], x[1]);
        let residual = DVector::from_vec(vec![x * x, x * y]);
        let weights = DVector::from_vec(vec![2.0 * w, w]);
        let jacobian = DMatrix::from_row_slice(2, 2, &[2.0 * x, 0.0, y, x]);
        let weighted = residual.component_mul(&weights);
        Derivatives {
            value: 0.5 * residual.dot(&weighted),
            gradient: jacobian.transpose() * weighted,
            hessian: Some(jacobian.transpose() * DMatrix::from_diagonal(&weights) * &jacobian),
            rows: Some(Rows {
                residual,
                weights,
                jacobian,
            }),
        }
    }

    /// The floor covers the h² error of a fourth power at the origin.
    const CHECK: DerivativeCheck = DerivativeCheck {
        step: 1e-5,
        tolerance: 1e-5,
        floor: 1e-3,
    };
    const POINTS: [[f64; 2]; 3] = [[0.0, 0.0], [0.7, -1.3], [-0.2, 2.0]];

    fn points() -> Vec<Vec<f64>> {
        POINTS.map(|p| p.to_vec()).to_vec()
    }

    fn rejects(evaluate: impl Fn(&[f64], f64) -> Derivatives + std::panic::UnwindSafe) -> bool {
        std::panic::catch_unwind(move || CHECK.run(&points(), evaluate)).is_err()
    }

    #[test]
    fn correct_derivatives_pass() {
        CHECK.run(&points(), quartic);
        CHECK.run(&points(), products);
    }

    type Evaluate = fn(&[f64], f64) -> Derivatives;

    #[test]
    fn every_kind_of_error_is_found() {
        let mut faults: Vec<(&str, Evaluate)> = Vec::new();
        faults.push(("gradient", |x, w| {
            let mut d = quartic(x, w);
            d.gradient[1] *= 1.001;
            d
        }));
        faults.push(("Hessian", |x, w| {
            let mut d = quartic(x, w);
            d.hessian.as_mut().expect("a Hessian")[(1, 1)] += 1e-3 * w;
            d
        }));
        faults.push(("symmetry", |x, w| {
            let mut d = quartic(x, w);
            d.hessian.as_mut().expect("a Hessian")[(0, 1)] += 1e-3 * w;
            d
        }));
        faults.push(("weight", |x, _| quartic(x, 1.0)));
        faults.push(("Jacobian", |x, w| {
            let mut d = products(x, w);
            d.rows.as_mut().expect("rows").jacobian[(1, 0)] += 1e-3;
            d
        }));
        faults.push(("value", |x, w| {
            let mut d = products(x, w);
            d.value += 1e-3 * w;
            d
        }));
        faults.push(("finite", |_, _| Derivatives::energy(f64::NAN, vec![0.0; 2])));
        for (name, fault) in faults {
            assert!(rejects(fault), "{name}");
        }
    }
}
