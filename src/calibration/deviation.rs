//! Standard deviations of the estimate, and unknowns that the motion does not determine.

use super::axis::ExtrinsicAxis;
use super::evidence::WalkEvidence;
use super::residual::{TIME, UNKNOWNS};
use super::settings::ExtrinsicsSettings;
use super::solve::{NormalMatrix, Solution};
use tryon_geometry::math::P3d;

/// Standard deviations of an estimate, in axes of the colour camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviations {
    /// To the right, down and ahead (m).
    pub translation: [f64; 3],
    /// Tilt, pan, roll (rad).
    pub rotation: [f64; 3],
    /// Time offset (s).
    pub time: f64,
}

impl Deviations {
    /// Deviations of a solution. Residuals of neighbouring points and of a person at the same place agree, so that an
    /// outline counts as a few pieces, and once for every new place.
    pub(crate) fn new(
        solution: &Solution,
        evidence: &WalkEvidence,
        settings: &ExtrinsicsSettings,
    ) -> Self {
        let independent = settings.outline_pieces * places(evidence, settings.new_place);
        let repeats = (solution.weight / independent.max(1.0)).max(1.0);
        let variances = diagonal_of_inverse(&solution.normal);
        let deviation = |k: usize| solution.scale * (variances[k] * repeats).sqrt();
        Self {
            translation: [0, 1, 2].map(deviation),
            rotation: [3, 4, 5].map(deviation),
            time: deviation(TIME),
        }
    }

    /// The axis that is known least against the limits, with its deviation and limit in its unit; `None` if all are
    /// known well enough.
    pub(crate) fn unobservable(&self, most: [f64; 3]) -> Option<(ExtrinsicAxis, f64, f64)> {
        let [x, y, z] = self.translation;
        let [tilt, pan, roll] = self.rotation;
        let deviations = [x, y, z, tilt, pan, roll, self.time];
        let limits = [0, 0, 0, 1, 1, 1, 2].map(|kind| most[kind]);
        let axes = ExtrinsicAxis::ALL.into_iter().zip(deviations).zip(limits);
        let worst = axes.max_by(|((_, a), la), ((_, b), lb)| (a / la).total_cmp(&(b / lb)))?;
        let ((axis, deviation), limit) = worst;
        (!(deviation <= limit)).then(|| (axis, axis.in_unit(deviation), axis.in_unit(limit)))
    }
}

/// Times that the person came to a new place.
fn places(evidence: &WalkEvidence, displacement: f64) -> f64 {
    let mut last: Option<P3d> = None;
    let mut count = 0.0;
    for (_, outline) in &evidence.outlines {
        if last.is_none_or(|last| (outline.centre - last).norm() > displacement) {
            last = Some(outline.centre);
            count += 1.0;
        }
    }
    count
}

/// Diagonal of the inverse; infinite where the matrix is singular.
fn diagonal_of_inverse(normal: &NormalMatrix) -> [f64; UNKNOWNS] {
    // Unit diagonal, so that metres and pixels compare.
    let size: [f64; UNKNOWNS] = std::array::from_fn(|k| normal[(k, k)].sqrt());
    let scaled = NormalMatrix::from_fn(|i, j| normal[(i, j)] / (size[i] * size[j]));
    match scaled.cholesky() {
        Some(factor) => {
            let inverse = factor.inverse();
            std::array::from_fn(|k| inverse[(k, k)] / (size[k] * size[k]))
        }
        None => [f64::INFINITY; UNKNOWNS],
    }
}
