//! Static drape: pseudo-transient continuation, implicit Euler steps from rest that grow as the cloth settles.

use super::error::{NewtonFault, OfflineError};
use super::integrator::TimeScheme;
use super::newton::{NewtonReport, largest};
use super::step::OfflineSolver;
use super::targets::{FrameScript, FrameTargets};
use crate::math::V3d;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// End of a static drape.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DrapeSettings {
    /// Largest motion of a vertex in a step of the longest length that counts as settled (m).
    pub tolerance: f64,
    /// First and longest step (s). A longer one nears the quasi-static limit, and its systems are harder to solve.
    pub steps: [f64; 2],
    /// Most steps.
    pub most_steps: usize,
    /// The last steps are solved to the solver's tolerance. False: to what counts as settled, for a finer mesh to go on.
    pub is_final: bool,
}

impl Default for DrapeSettings {
    fn default() -> Self {
        Self {
            tolerance: 5e-4,
            steps: [1.0 / 60.0, 0.25],
            most_steps: 60,
            is_final: true,
        }
    }
}

/// Largest motion of one vertex in the last iteration of a loosely solved step by the motion that counts as settled. The
/// defaults of Newton's method have a ratio of 20 between the two; other values were not compared.
const LARGEST_SHARE: f64 = 10.0;

/// Work and end of a static drape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DrapeReport {
    /// Steps taken.
    pub steps: usize,
    /// Steps repeated at half the length.
    pub unsolved: usize,
    /// Largest motion of a vertex in the last step (m).
    pub motion: f64,
    /// True if the last step was of the longest length and within the tolerance.
    pub settled: bool,
    /// Newton's work.
    pub newton: NewtonReport,
}

impl OfflineSolver<'_> {
    /// Moves cloth without pins to rest where the obstacle is, as [`Self::drape_to`].
    ///
    /// # Errors
    /// A step that is not solved at a thousandth of the first length.
    pub fn drape(
        &mut self,
        drape: &DrapeSettings,
        progress: impl FnMut(&DrapeReport) -> ControlFlow<()>,
    ) -> Result<DrapeReport, OfflineError> {
        self.drape_to(drape, &FrameTargets::default(), progress)
    }

    /// Moves the cloth to rest with pins and obstacle at their targets from the first step on. `progress` receives each
    /// step and may break off.
    ///
    /// # Errors
    /// A step that is not solved at a thousandth of the first length.
    pub fn drape_to(
        &mut self,
        drape: &DrapeSettings,
        targets: &FrameTargets<'_>,
        mut progress: impl FnMut(&DrapeReport) -> ControlFlow<()>,
    ) -> Result<DrapeReport, OfflineError> {
        let mut report = DrapeReport::default();
        report.newton.smallest_share = 1.0;
        let x = &self.state.now.x;
        let held = FrameScript {
            targets,
            pins: targets.pins.iter().map(|p| x[p.vertex as usize]).collect(),
            obstacle: self.state.obstacle[1].clone(),
        };
        let settings = self.settings;
        self.settings.scheme = TimeScheme::ImplicitEuler;
        self.settings.error_rate = f64::INFINITY;
        // The way to rest is of no interest: only the last steps are solved better than what counts as settled.
        let newton = &mut self.settings.newton;
        newton.tolerance = newton.tolerance.max(drape.tolerance);
        newton.largest = newton.largest.max(drape.tolerance * LARGEST_SHARE);
        let mut h = drape.steps[0];
        let mut end = Ok(());
        while report.steps < drape.most_steps && !report.settled {
            self.rest();
            match self.try_step(h, &held.at(1.0), &mut report.newton) {
                Ok(Ok(solved)) => {
                    let before = self.state.now.x.clone();
                    self.accept(solved, h, self.state.time);
                    report.steps += 1;
                    report.motion = self.motion_since(&before);
                    report.settled = report.motion <= drape.tolerance && h >= drape.steps[1];
                    h = (2.0 * h).min(drape.steps[1]);
                    if report.settled && drape.is_final && self.settings.newton != settings.newton {
                        self.settings.newton = settings.newton;
                        report.settled = false;
                    }
                }
                Ok(Err(why)) if h > drape.steps[0] * 1e-3 => {
                    report.unsolved += 1;
                    h *= 0.5;
                    let _: NewtonFault = why;
                }
                Ok(Err(why)) => {
                    let (time, step) = (self.state.time, h);
                    end = Err(OfflineError::Unsolved { time, step, why });
                }
                Err(fault) => end = Err(fault),
            }
            if end.is_err() || progress(&report).is_break() {
                break;
            }
        }
        self.rest();
        self.settings = settings;
        end.map(|()| report)
    }

    /// Forgets velocities.
    fn rest(&mut self) {
        self.state.now.v.fill(V3d::zeros());
        self.state.earlier = None;
    }

    fn motion_since(&self, before: &[V3d]) -> f64 {
        let moved: Vec<V3d> = self
            .state
            .now
            .x
            .iter()
            .zip(before)
            .map(|(a, b)| a - b)
            .collect();
        largest(&moved).1
    }
}
