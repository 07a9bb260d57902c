//! One shape of a subject from several scans, each with a pose of its own (section 5.4): the poses are eliminated from the
//! normal equations of each scan, and what is left is summed.

use super::jacobian::Match;
use super::model_fit::{AlignedBody, ModelFit, Prior, STAGE};
use super::unknowns::ShapeUnknowns;
use crate::CaptureError;
use crate::dense_equations::DenseEquations;
use crate::settings::{FitStage, ModelFitSettings};
use tryon_body::{Pose, Template};
use tryon_geometry::math::World;
use tryon_tracking::registration::GemanMcClure;

/// Fits one shape to several scans; `bodies` are start and result, their shapes equal in the end. Shapes `[scans]`.
pub(crate) fn fit_shared_shape(
    template: &Template,
    settings: &ModelFitSettings,
    fits: &mut [ModelFit<'_>],
    bodies: &mut [AlignedBody],
    stage: &FitStage,
) -> Result<(), CaptureError> {
    let Some(first) = bodies.first() else {
        return Ok(());
    };
    let mut shape = first.shape.clone();
    let unknowns = ShapeUnknowns::new(template, settings, &mut shape, true);
    bodies.iter_mut().for_each(|b| b.shape = shape.clone());
    let starts: Vec<Pose<World>> = bodies.iter().map(|b| b.pose.clone()).collect();
    let kernel = GemanMcClure { sigma: stage.sigma };
    for _ in 0..stage.iterations {
        let mut all: Vec<Vec<Match>> = Vec::new();
        for (fit, body) in fits.iter_mut().zip(&*bodies) {
            fit.place(body);
            all.push(fit.matches(&kernel));
        }
        let n = unknowns.all.len();
        let mut sum = DenseEquations::zeros(n);
        let mut updates = Vec::new();
        for (k, (fit, matches)) in fits.iter().zip(&all).enumerate() {
            let prior = Prior {
                start: &starts[k],
                unknowns: &unknowns,
                freedom: stage.freedom,
            };
            let system = fit.system(&bodies[k], &prior, matches);
            let (reduced, back) = system.eliminate(n, settings, STAGE)?;
            sum += &reduced;
            updates.push(back);
        }
        unknowns.add_prior(&mut sum, &bodies[0].shape);
        sum.damp(settings);
        let step = sum.solve(STAGE)?;
        let mut moved = 0.0f64;
        for ((fit, body), back) in fits.iter().zip(&mut *bodies).zip(&updates) {
            moved = moved.max(fit.update(body, &unknowns, &back.with(&step)));
        }
        if moved < settings.converged {
            break;
        }
    }
    Ok(())
}
