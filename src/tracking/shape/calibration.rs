//! Calibration: size, shape and pose in turns (Algorithm 1).

use super::size::SizeEstimate;
use crate::fit::{
    ANNEAL, FitContext, FitReport, FitScratch, START, Schedule, TRACK, evaluate, fit_pose,
};
use crate::model::{PersonalBody, TrackerModel};
use crate::registration::Observation;
use nalgebra::{Translation3, Vector3};
use tryon_body::{BodyShape, Pose};
use tryon_geometry::math::{Camera, Rigid};

/// Most rounds of pose and size in the first frame.
const ROUNDS: usize = 8;
/// Rounds and fit of a trial at another height: shifted from a fitted pose, eight iterations rank it as twenty do.
const TRIAL_ROUNDS: usize = 2;
/// See [`TRIAL_ROUNDS`].
const TRIAL: Schedule = Schedule {
    iterations: 8,
    ..START
};
/// Change of a coefficient, or of ten times a scale, below which size has settled.
const SETTLED: f64 = 0.05;
/// Residual of a first fit above which other heights are tried, metres. Along an upright body the surface hardly changes,
/// so that a fit 10 cm too high settles there (6.6 mm against 2.1; sensor noise lies between).
const WELL_FITTED: f64 = 4e-3;
/// Displacement of the trials along the upright, metres.
const SHIFT: f64 = 0.15;

/// Size, shape and pose of one start.
#[derive(Clone)]
struct SizedPose {
    size: SizeEstimate,
    shape: BodyShape,
    pose: Pose<Camera>,
}

/// A settled start with its fit, and the cost by which starts compare.
struct SettledStart {
    sized: SizedPose,
    fit: FitReport,
    cost: f64,
}

/// Body, readings and scratch of one calibration.
pub(crate) struct SizeCalibration<'a> {
    pub model: &'a TrackerModel,
    pub observation: &'a Observation<'a>,
    pub body: &'a mut PersonalBody,
    pub scratch: &'a mut FitScratch,
    /// Unit vector against gravity, camera frame.
    pub up: Vector3<f64>,
    /// Part of the subject lies below the image.
    pub cut_below: bool,
}

impl SizeCalibration<'_> {
    /// Adapts size, shape and pose to one frame; returns the new fit where the pose was fitted again.
    pub(crate) fn adapt(
        &mut self,
        size: &mut SizeEstimate,
        shape: &mut BodyShape,
        pose: &mut Pose<Camera>,
        schedule: &Schedule,
    ) -> Option<FitReport> {
        let mut fit = None;
        if size.frames == 0 {
            let start = SizedPose {
                size: size.clone(),
                shape: shape.clone(),
                pose: pose.clone(),
            };
            let best = self.settle_first(start, schedule);
            (*size, *shape, *pose) = (best.sized.size, best.sized.shape, best.sized.pose);
            fit = Some(best.fit);
            self.body.update(self.model, shape);
        }
        let context = FitContext {
            model: self.model,
            body: self.body,
            observation: self.observation,
        };
        let frames = size.frames;
        size.observe(&context, pose, shape, self.scratch, true);
        self.body.update(self.model, shape);
        if size.frames > frames {
            size.check_settled(&self.model.template, &self.body.rest);
        }
        fit
    }

    /// Settles from `start`, and from higher and lower where that fits badly.
    fn settle_first(&mut self, start: SizedPose, schedule: &Schedule) -> SettledStart {
        let cut_below = self.cut_below;
        let best = self.settle(start.clone(), schedule, ROUNDS, cut_below);
        if best.fit.residual <= WELL_FITTED {
            return best;
        }
        let trials = [-SHIFT, SHIFT].map(|shift| {
            let mut other = start.clone();
            let shift = Translation3::from(self.up * shift);
            other.pose.root = Rigid::new(shift * other.pose.root.iso());
            self.settle(other, &TRIAL, TRIAL_ROUNDS, cut_below)
        });
        let better = trials
            .into_iter()
            .filter(|t| t.cost < best.cost)
            .min_by(|a, b| a.cost.total_cmp(&b.cost));
        match better {
            Some(trial) => self.settle(trial.sized, schedule, ROUNDS, false),
            None => best,
        }
    }

    /// Alternates pose and size until both have settled. Kernel and reach shrink once only, unless the body is `cut`: half
    /// a body informs size so little that its pose must stay free (5 mm on waist-up scenes).
    fn settle(
        &mut self,
        mut sized: SizedPose,
        schedule: &Schedule,
        rounds: usize,
        cut: bool,
    ) -> SettledStart {
        self.body.update(self.model, &sized.shape);
        let near = Schedule {
            ahead: if cut { schedule.ahead } else { ANNEAL },
            ..*schedule
        };
        let mut fit = self.fit(&mut sized.pose, schedule);
        for _ in 0..rounds {
            let context = FitContext {
                model: self.model,
                body: self.body,
                observation: self.observation,
            };
            let SizedPose { size, shape, pose } = &mut sized;
            let change = size.observe(&context, pose, shape, self.scratch, false);
            self.body.sketch(self.model, shape);
            fit = self.fit(&mut sized.pose, &near);
            if change < SETTLED {
                break;
            }
        }
        self.body.update(self.model, &sized.shape);
        let context = FitContext {
            model: self.model,
            body: self.body,
            observation: self.observation,
        };
        let cost = evaluate(&context, &sized.pose, TRACK.distance[0], self.scratch).cost;
        SettledStart { sized, fit, cost }
    }

    fn fit(&mut self, pose: &mut Pose<Camera>, schedule: &Schedule) -> FitReport {
        let context = FitContext {
            model: self.model,
            body: self.body,
            observation: self.observation,
        };
        fit_pose(&context, pose, schedule, self.scratch)
    }
}
