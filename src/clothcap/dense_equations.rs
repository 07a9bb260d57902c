//! Normal equations of a few hundred unknowns: sums of rows, damped, solved, or with their first unknowns eliminated.

use crate::CaptureError;
use crate::settings::ModelFitSettings;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Normal equations `h x = g` of residuals r with Jacobian J and weights W.
#[derive(Clone, Debug)]
pub(crate) struct DenseEquations {
    /// Jᵀ W J, shape `[n][n]`.
    pub(crate) h: DMatrix<f64>,
    /// −Jᵀ W r, shape `[n]`.
    pub(crate) g: DVector<f64>,
}

impl std::ops::AddAssign<&Self> for DenseEquations {
    fn add_assign(&mut self, other: &Self) {
        self.h += &other.h;
        self.g += &other.g;
    }
}

impl DenseEquations {
    pub(crate) fn zeros(n: usize) -> Self {
        Self {
            h: DMatrix::zeros(n, n),
            g: DVector::zeros(n),
        }
    }

    /// Adds `weight` (slopes · x + `residual`)²; `row` has unknowns and slopes.
    pub(crate) fn add_row(&mut self, row: &[(usize, f64)], residual: f64, weight: f64) {
        for (i, a) in row {
            self.g[*i] -= weight * a * residual;
            for (j, b) in row {
                self.h[(*i, *j)] += weight * a * b;
            }
        }
    }

    /// Solution of the equations of `stage`.
    pub(crate) fn solve(self, stage: &'static str) -> Result<DVector<f64>, CaptureError> {
        let x = factor(self.h, stage)?.solve(&self.g);
        match x.iter().all(|v| v.is_finite()) {
            true => Ok(x),
            false => Err(CaptureError::solve(stage, "the update is not finite")),
        }
    }

    /// The equations of the last `kept` unknowns, with the first ones damped and eliminated, and the way back to these.
    pub(crate) fn eliminate(
        self,
        kept: usize,
        settings: &ModelFitSettings,
        stage: &'static str,
    ) -> Result<(Self, Elimination), CaptureError> {
        let first = self.g.len() - kept;
        let mut own = self.h.view((0, 0), (first, first)).into_owned();
        damp(&mut own, settings);
        let factor = factor(own, stage)?;
        let mixed = self.h.view((0, first), (first, kept)).into_owned();
        let back = Elimination {
            alone: factor.solve(&self.g.rows(0, first).into_owned()),
            per_kept: factor.solve(&mixed),
        };
        let reduced = Self {
            h: self.h.view((first, first), (kept, kept)) - mixed.tr_mul(&back.per_kept),
            g: self.g.rows(first, kept) - mixed.tr_mul(&back.alone),
        };
        Ok((reduced, back))
    }

    /// Adds a share of its diagonal to the matrix.
    pub(crate) fn damp(&mut self, settings: &ModelFitSettings) {
        damp(&mut self.h, settings);
    }
}

/// Eliminated unknowns by those that were kept.
#[derive(Clone, Debug)]
pub(crate) struct Elimination {
    alone: DVector<f64>,
    per_kept: DMatrix<f64>,
}

impl Elimination {
    /// All unknowns, the eliminated ones first.
    pub(crate) fn with(&self, kept: &DVector<f64>) -> DVector<f64> {
        let first = &self.alone - &self.per_kept * kept;
        DVector::from_iterator(first.len() + kept.len(), first.iter().chain(kept).copied())
    }
}

fn damp(h: &mut DMatrix<f64>, settings: &ModelFitSettings) {
    for i in 0..h.nrows() {
        h[(i, i)] += settings.damping * h[(i, i)] + settings.least_damping;
    }
}

fn factor(h: DMatrix<f64>, stage: &'static str) -> Result<Cholesky<f64, Dyn>, CaptureError> {
    let factor = h.cholesky();
    factor.ok_or_else(|| CaptureError::solve(stage, "singular normal matrix"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eliminating unknowns and going back solves the same equations, but for damping of the kept diagonal.
    #[test]
    fn elimination_agrees_with_the_whole_system() {
        let (n, settings) = (9, ModelFitSettings::default());
        let rows = DMatrix::from_fn(20, n, |i, j| ((3 * i + 7 * j * j) as f64).sin());
        let h = rows.tr_mul(&rows);
        let g = DVector::from_fn(n, |i, _| (i as f64).cos());
        let system = DenseEquations { h, g };
        let mut damped = system.clone();
        damped.damp(&settings);
        let mut kept = system;
        let diagonal = damped.h.diagonal();
        (6..n).for_each(|i| kept.h[(i, i)] = diagonal[i]);
        let whole = damped.solve("test").expect("definite");
        let (reduced, back) = kept.eliminate(3, &settings, "test").expect("definite");
        let shape = reduced.solve("test").expect("definite");
        assert!((back.with(&shape) - whole).amax() < 1e-9);
    }

    #[test]
    fn singular_and_infinite_systems_are_errors() {
        let mut zero = DenseEquations::zeros(2);
        zero.h.fill(f64::NAN);
        let fault = zero.solve("test");
        assert!(matches!(fault, Err(CaptureError::Solve { .. })));
    }
}
