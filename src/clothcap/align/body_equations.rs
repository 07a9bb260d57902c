//! Normal equations of pose and shape: damped, with priors, and with the pose eliminated.

use super::shape_unknowns::ShapeUnknowns;
use crate::CaptureError;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use tryon_body::BodyShape;

/// Share of its diagonal added to the normal matrix.
const DAMPING: f64 = 1e-3;
/// Added beside it, for unknowns that no point determines.
const LEAST: f64 = 1e-6;

/// Jᵀ W J and Jᵀ W r: six unknowns of the root, joint angles, shape.
#[derive(Clone, Debug)]
pub(super) struct BodyEquations {
    pub(super) h: DMatrix<f64>,
    pub(super) g: DVector<f64>,
}

impl BodyEquations {
    /// Adds the prior of the shape, whose unknowns are the last ones.
    pub(super) fn add_shape_prior(&mut self, shape: &BodyShape, unknowns: &ShapeUnknowns) {
        let first = self.g.len() - unknowns.len();
        for (k, u) in unknowns.all.iter().enumerate() {
            let (value, mean, deviation) = u.prior(shape);
            let w = 1.0 / (deviation * deviation);
            self.h[(first + k, first + k)] += w;
            self.g[first + k] += w * (mean - value);
        }
    }

    /// Solution of the damped equations.
    ///
    /// # Errors
    /// [`CaptureError::Solve`] for a singular matrix or values that are not finite.
    pub(super) fn solve(mut self) -> Result<DVector<f64>, CaptureError> {
        self.damp();
        let x = factor(self.h)?.solve(&self.g);
        finite(x)
    }

    /// The equations of the shape with the pose eliminated, and the way back to the pose; the shape is the last `shape`
    /// unknowns.
    ///
    /// # Errors
    /// As [`BodyEquations::solve`].
    pub(super) fn eliminate_pose(self, shape: usize) -> Result<(Self, PoseUpdate), CaptureError> {
        let pose = self.g.len() - shape;
        let mut own = self.h.view((0, 0), (pose, pose)).into_owned();
        damp(&mut own);
        let factor = factor(own)?;
        let mixed = self.h.view((0, pose), (pose, shape)).into_owned();
        let back = PoseUpdate {
            at_same_shape: factor.solve(&self.g.rows(0, pose).into_owned()),
            per_shape: factor.solve(&mixed),
        };
        let reduced = Self {
            h: self.h.view((pose, pose), (shape, shape)) - mixed.tr_mul(&back.per_shape),
            g: self.g.rows(pose, shape) - mixed.tr_mul(&back.at_same_shape),
        };
        Ok((reduced, back))
    }

    fn damp(&mut self) {
        damp(&mut self.h);
    }
}

/// Update of a pose by that of the shape.
#[derive(Clone, Debug)]
pub(super) struct PoseUpdate {
    at_same_shape: DVector<f64>,
    per_shape: DMatrix<f64>,
}

impl PoseUpdate {
    /// Update of all unknowns, those of the pose first.
    pub(super) fn with(&self, shape: &DVector<f64>) -> DVector<f64> {
        let pose = &self.at_same_shape - &self.per_shape * shape;
        DVector::from_iterator(pose.len() + shape.len(), pose.iter().chain(shape).copied())
    }
}

fn damp(h: &mut DMatrix<f64>) {
    for i in 0..h.nrows() {
        h[(i, i)] += DAMPING * h[(i, i)] + LEAST;
    }
}

fn factor(h: DMatrix<f64>) -> Result<Cholesky<f64, Dyn>, CaptureError> {
    h.cholesky().ok_or_else(|| fault("singular normal matrix"))
}

fn finite(x: DVector<f64>) -> Result<DVector<f64>, CaptureError> {
    if x.iter().all(|v| v.is_finite()) {
        Ok(x)
    } else {
        Err(fault("the update is not finite"))
    }
}

fn fault(why: &str) -> CaptureError {
    CaptureError::Solve {
        stage: "body model",
        why: why.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eliminating the pose and going back solves the same equations, but for damping of the shape's diagonal.
    #[test]
    fn elimination_agrees_with_the_whole_system() {
        let n = 9;
        let rows = DMatrix::from_fn(20, n, |i, j| ((3 * i + 7 * j * j) as f64).sin());
        let h = rows.tr_mul(&rows);
        let g = DVector::from_fn(n, |i, _| (i as f64).cos());
        let system = BodyEquations { h, g };
        let whole = system.clone().solve().expect("definite");
        let mut damped = system;
        for i in 6..n {
            damped.h[(i, i)] += DAMPING * damped.h[(i, i)] + LEAST;
        }
        let (reduced, back) = damped.eliminate_pose(3).expect("definite");
        let shape = reduced.h.cholesky().expect("definite").solve(&reduced.g);
        assert!((back.with(&shape) - whole).amax() < 1e-9);
    }

    #[test]
    fn singular_and_infinite_systems_are_errors() {
        let zero = BodyEquations {
            h: DMatrix::from_element(2, 2, f64::NAN),
            g: DVector::zeros(2),
        };
        assert!(matches!(zero.solve(), Err(CaptureError::Solve { .. })));
    }
}
