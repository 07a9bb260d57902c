//! Static drape: pseudo-transient continuation, implicit Euler steps from rest that grow as the cloth settles.

use super::error::OfflineError;
use super::newton::{NewtonReport, largest, mean};
use super::step::OfflineSolver;
use super::targets::{FrameScript, FrameTargets, StepTargets};
use crate::settings::DrapeSettings;
use crate::settings::TimeScheme;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::ControlFlow;
use tryon_geometry::math::V3d;

/// Work and end of a static drape.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DrapeReport {
    /// Steps taken.
    pub steps: usize,
    /// Steps repeated at half the length.
    pub unsolved: usize,
    /// Largest motion of a vertex in the last step (m).
    pub motion: f64,
    /// That vertex.
    pub vertex: usize,
    /// Its mean speed in that step (m/s).
    pub speed: f64,
    /// True if the last step was of the longest length and within the tolerance.
    pub settled: bool,
    /// Newton's work.
    pub newton: NewtonReport,
}

impl fmt::Display for DrapeReport {
    /// Rest, or the vertex that moves most.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.settled {
            return write!(f, "at rest after {} steps", self.steps);
        }
        write!(
            f,
            "not at rest after {} steps: vertex {} moves at {:.1} mm/s",
            self.steps,
            self.vertex,
            self.speed * 1e3
        )
    }
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
        self.wake_up();
        let x = &self.state.now.x;
        let held = FrameScript {
            targets,
            pins: targets.pins.iter().map(|p| x[p.vertex as usize]).collect(),
            obstacle: self.state.obstacle[1].clone(),
        }
        .at(1.0);
        let settings = self.settings;
        self.settings.scheme = TimeScheme::ImplicitEuler;
        self.settings.error_rate = f64::INFINITY;
        let newton = &mut self.settings.newton;
        let loose = drape.looseness * drape.tolerance;
        newton.tolerance = newton.tolerance.max(loose);
        newton.largest = newton.largest.max(drape.largest * loose);
        let mut h = drape.steps[0];
        let mut end = Ok(ControlFlow::Continue(()));
        for (newton, most) in [
            (self.settings.newton, drape.most_steps),
            (settings.newton, drape.final_steps),
        ] {
            let last = report.steps + most;
            self.settings.newton = newton;
            report.settled &= most == 0;
            while matches!(end, Ok(ControlFlow::Continue(())))
                && report.steps < last
                && !report.settled
            {
                end = self
                    .drape_step(drape, &held, &mut h, &mut report)
                    .map(|()| progress(&report));
            }
        }
        self.rest();
        self.settings = settings;
        end.map(|_| report)
    }

    /// One step from rest of length `h` (s), which it changes; a step that is not solved is a shorter one next time.
    fn drape_step(
        &mut self,
        drape: &DrapeSettings,
        held: &StepTargets,
        h: &mut f64,
        report: &mut DrapeReport,
    ) -> Result<(), OfflineError> {
        self.rest();
        match self.try_step(*h, held, &mut report.newton)? {
            Ok(solved) => {
                let before = self.state.now.x.clone();
                self.accept(solved, *h, self.state.time);
                report.steps += 1;
                let moved = self.motion_since(&before);
                (report.vertex, report.motion) = largest(&moved);
                report.speed = report.motion / *h;
                let is_calm = mean(&moved) <= drape.tolerance
                    && report.motion <= drape.largest * drape.tolerance;
                report.settled = is_calm && *h >= drape.steps[1];
                *h = (2.0 * *h).min(drape.steps[1]);
                Ok(())
            }
            Err(_) if *h > drape.steps[0] * 1e-3 => {
                report.unsolved += 1;
                *h *= 0.5;
                Ok(())
            }
            Err(why) => {
                let (time, step) = (self.state.time, *h);
                Err(OfflineError::Unsolved { time, step, why })
            }
        }
    }

    /// Forgets velocities.
    fn rest(&mut self) {
        self.state.now.v.fill(V3d::zeros());
        self.state.earlier = None;
    }

    fn motion_since(&self, before: &[V3d]) -> Vec<V3d> {
        let now = self.state.now.x.iter();
        now.zip(before).map(|(a, b)| a - b).collect()
    }
}
