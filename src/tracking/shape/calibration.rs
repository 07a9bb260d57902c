//! Calibration: size, shape and pose in turns (Algorithm 1).

use super::size::SizeEstimate;
use crate::fit::{FitContext, FitReport, FitScratch, evaluate, fit_pose};
use crate::model::{PersonalBody, TrackerModel};
use crate::registration::Observation;
use crate::settings::Schedule;
use nalgebra::{Translation3, Vector3};
use tryon_body::{BodyShape, Pose};
use tryon_geometry::math::{Camera, Rigid};

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
            size.check_settled(self.model, &self.body.rest);
        }
        fit
    }

    /// Settles from `start`, and from higher and lower where that fits badly.
    fn settle_first(&mut self, start: SizedPose, schedule: &Schedule) -> SettledStart {
        let settings = &self.model.config.shape;
        let cut_below = self.cut_below;
        let best = self.settle(start.clone(), schedule, settings.rounds, cut_below);
        if best.fit.residual <= settings.well_fitted {
            return best;
        }
        let trial = Schedule {
            iterations: settings.trial_iterations,
            ..self.model.config.fit.start
        };
        let trials = [-settings.shift, settings.shift].map(|shift| {
            let mut other = start.clone();
            let shift = Translation3::from(self.up * shift);
            other.pose.root = Rigid::new(shift * other.pose.root.iso());
            self.settle(other, &trial, settings.trial_rounds, cut_below)
        });
        let better = trials
            .into_iter()
            .filter(|t| t.cost < best.cost)
            .min_by(|a, b| a.cost.total_cmp(&b.cost));
        match better {
            Some(trial) => self.settle(trial.sized, schedule, settings.rounds, false),
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
        let config = &self.model.config;
        self.body.update(self.model, &sized.shape);
        let near = Schedule {
            ahead: if cut {
                schedule.ahead
            } else {
                config.fit.anneal
            },
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
            if change < config.shape.settled {
                break;
            }
        }
        self.body.update(self.model, &sized.shape);
        let context = FitContext {
            model: self.model,
            body: self.body,
            observation: self.observation,
        };
        let cost = evaluate(
            &context,
            &sized.pose,
            config.fit.track.distance[0],
            self.scratch,
        )
        .cost;
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
