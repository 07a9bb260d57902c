//! One frame of cloth: implicit steps whose length follows the error and the solver.

use super::checks::{check_frame, check_steps, check_vectors};
use super::contacts::{ContactReport, Contacts};
use super::error::{NewtonFault, OfflineError};
use super::integrator::{MotionState, OfflineState, StepCoefficients};
use super::linear_solver::DirectionSolver;
use super::model::OfflineCloth;
use super::newton::{NewtonReport, NewtonSystem, mean, minimise};
use super::potential::StepPotential;
use super::problem::StepProblem;
use super::sleep::Sleep;
use super::start::JoinedSurfaces;
use super::targets::{FrameScript, FrameTargets, StepTargets};
use crate::contact::ContactSurface;
use crate::settings::OfflineSettings;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::Face;
use tryon_geometry::par::Par;

impl OfflineSettings {
    /// Local error of a step of `h` (s) that is accepted (m, root mean square): no less than what the iteration leaves, which
    /// shorter steps do not lower.
    fn allowed_error(&self, h: f64) -> f64 {
        (self.error_rate * h).max(self.newton.tolerance)
    }
}

/// Work and quality of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OfflineFrameReport {
    /// Accepted steps.
    pub steps: usize,
    /// Steps repeated at half the length because their error was too large.
    pub inaccurate: usize,
    /// Steps repeated at half the length because they were not solved.
    pub unsolved: usize,
    /// Newton's work, that of repeated steps included.
    pub newton: NewtonReport,
    /// Work of contact.
    pub contact: ContactReport,
    /// Largest distance of an obstacle vertex from its target at the end of the frame (m).
    pub largest_give: f64,
    /// Largest estimated local error of an accepted step (m, root mean square).
    pub largest_error: f64,
    /// Vertices of the cloth that slept.
    pub asleep: usize,
}

/// Cloth in motion.
#[derive(Debug)]
pub struct OfflineSolver<'a> {
    pub(super) cloth: &'a OfflineCloth,
    pub(super) settings: OfflineSettings,
    par: Par,
    pub(super) state: OfflineState,
    pub(super) contacts: Option<Contacts>,
    pub(super) directions: DirectionSolver,
    pub(super) sleep: Sleep,
    /// Number of halvings of the longest step in use.
    pub(super) level: u32,
    /// Accepted steps since the last change of length.
    pub(super) calm_steps: u32,
}

impl<'a> OfflineSolver<'a> {
    /// Cloth at rest or in motion; `obstacle` has the triangles of the state's obstacle vertices.
    ///
    /// # Errors
    /// Positions or velocities that do not fit the cloth, or are not finite; steps that are no lengths; with contact, a
    /// start that passes through itself or the obstacle.
    pub fn new(
        cloth: &'a OfflineCloth,
        obstacle: &[Face],
        state: OfflineState,
        settings: OfflineSettings,
        par: Par,
    ) -> Result<Self, OfflineError> {
        check_steps(settings.longest_step, settings.halvings)?;
        let (n, m) = (cloth.len(), state.obstacle[0].len());
        check_vectors("positions", &state.now.x, n)?;
        check_vectors("velocities", &state.now.v, n)?;
        check_vectors("obstacle", &state.obstacle[0], m)?;
        check_vectors("obstacle targets", &state.obstacle[1], m)?;
        let mesh = cloth.contact_mesh(ContactSurface {
            vertices: m,
            faces: obstacle,
        })?;
        if settings.contact.is_some() {
            let (all, x) = (JoinedSurfaces(&mesh), state.unknowns());
            let crossings = all.crossings(par, &x);
            if !crossings.is_empty() {
                return Err(all.intersecting(crossings, &x));
            }
        }
        let places = state.now.x.iter().chain(&state.obstacle[1]);
        Ok(Self {
            sleep: Sleep {
                places: places.copied().collect(),
                still: vec![0.0; n + m],
                ..Sleep::default()
            },
            cloth,
            settings,
            par,
            state,
            contacts: settings
                .contact
                .map(|contact| Contacts::new(mesh, contact, par)),
            directions: DirectionSolver::new(par),
            level: 0,
            calm_steps: 0,
        })
    }

    /// Present state.
    pub fn state(&self) -> &OfflineState {
        &self.state
    }

    /// Advances by `duration` (s) while pins and obstacle move evenly to their targets.
    ///
    /// # Errors
    /// A step that is not solved at the smallest length; the state is then that before the step. A duration or targets that
    /// are none.
    pub fn advance(
        &mut self,
        duration: f64,
        targets: &FrameTargets<'_>,
    ) -> Result<OfflineFrameReport, OfflineError> {
        let vertices = [self.cloth.len(), self.state.obstacle[0].len()];
        check_frame(duration, targets, vertices)?;
        let mut report = OfflineFrameReport::default();
        report.newton.smallest_share = 1.0;
        self.fall_asleep(duration, targets);
        if self.is_asleep() {
            self.state.time += duration;
        } else {
            self.take_steps(duration, targets, &mut report)?;
        }
        self.note_motion(duration, &mut report);
        let apart = self.state.obstacle[0].iter().zip(&self.state.obstacle[1]);
        report.largest_give = apart.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        if let Some(contacts) = &mut self.contacts {
            report.contact = std::mem::take(&mut contacts.report);
        }
        Ok(report)
    }

    /// Steps of a frame of `duration` (s).
    fn take_steps(
        &mut self,
        duration: f64,
        targets: &FrameTargets<'_>,
        report: &mut OfflineFrameReport,
    ) -> Result<(), OfflineError> {
        let start = self.state.time;
        let script = FrameScript {
            targets,
            pins: targets
                .pins
                .iter()
                .map(|p| self.state.now.x[p.vertex as usize])
                .collect(),
            obstacle: self.state.obstacle[1].clone(),
        };
        let coarsest = (duration / self.settings.longest_step)
            .log2()
            .ceil()
            .max(0.0) as u32;
        let finest = coarsest + self.settings.halvings;
        let frame = 1u64 << finest;
        self.level = self.level.clamp(coarsest, finest);
        let (mut at, mut aside) = (0, None);
        while at < frame {
            let length = 1u64 << (finest - self.level);
            let h = duration * length as f64 / frame as f64;
            let share = (at + length) as f64 / frame as f64;
            let last = self.level == finest;
            match self.try_step(h, &script.at(share), &mut report.newton)? {
                Ok(solved) if last || solved.error <= self.settings.allowed_error(h) => {
                    at += length;
                    report.steps += 1;
                    report.largest_error = report.largest_error.max(solved.error);
                    let calm =
                        solved.error <= self.settings.growth_share * self.settings.allowed_error(h);
                    aside = None;
                    self.accept(solved, h, start + duration * share);
                    self.grow(calm, coarsest..=finest, at);
                    continue;
                }
                Ok(_) => report.inaccurate += 1,
                Err(why) if last => {
                    if aside.is_some() {
                        self.state.earlier = aside;
                    }
                    let (time, step) = (self.state.time, h);
                    return Err(OfflineError::Unsolved { time, step, why });
                }
                Err(_) => {
                    report.unsolved += 1;
                    aside = self.state.earlier.take().or(aside);
                }
            }
            self.level += 1;
            self.calm_steps = 0;
        }
        Ok(())
    }

    /// Solves one step of `h` (s) without accepting it.
    pub(super) fn try_step(
        &mut self,
        h: f64,
        targets: &StepTargets,
        report: &mut NewtonReport,
    ) -> Result<Result<SolvedStep, NewtonFault>, OfflineError> {
        let (n, state) = (self.cloth.len(), &self.state);
        let coefficients = StepCoefficients::new(self.settings.scheme, state, h);
        let each = |f: &dyn Fn(usize) -> V3d| (0..n).map(f).collect::<Vec<V3d>>();
        let inertial = each(&|i| coefficients.inertial_position(state, i));
        let predicted = each(&|i| coefficients.prediction(state, i, h));
        let start = state.unknowns();
        if let Some(contacts) = &mut self.contacts {
            contacts.begin_step(&start, h);
        }
        let mut problem = StepProblem {
            potential: StepPotential {
                cloth: self.cloth,
                start: &state.now.x,
                inertial: &inertial,
                step: h,
                rate_squared: coefficients.span.powi(-2),
                pins: &targets.pins,
                pin_stiffness: self.settings.pin_stiffness,
                asleep: &self.sleep.asleep,
            },
            obstacle: &targets.obstacle,
            spring: self.settings.obstacle,
            contacts: self.contacts.as_mut(),
            par: self.par,
        };
        let mut x = start;
        let moves = |v: &V3d| *v != V3d::zeros();
        let rests = !state.now.v.iter().any(moves) && state.obstacle[1] == targets.obstacle;
        if problem.contacts.is_none() {
            x[..n].copy_from_slice(&predicted);
        } else if !rests {
            // From rest, the first iteration is such a guess already.
            problem.guess(&self.settings.newton, &mut self.directions, &mut x, report)?;
        }
        let settings = &self.settings.newton;
        let solved = minimise(&mut problem, settings, &mut self.directions, &mut x, report)?;
        let system = match solved {
            Ok(system) => system,
            Err(why) => return Ok(Err(why)),
        };
        let obstacle = x.split_off(n);
        let share = coefficients.error_share();
        let apart = each(&|i| (x[i] - predicted[i]) * share);
        let error = self.slow_part(system, coefficients.span, &apart, report)?;
        let v = each(&|i| coefficients.velocity(&self.state, i, &x[i]));
        Ok(Ok(SolvedStep {
            end: MotionState { v, x },
            obstacle: [obstacle, targets.obstacle.clone()],
            error,
        }))
    }

    /// Root mean square (m) of what inertia keeps of a difference between explicit and implicit motion, H⁻¹ M d / (γh)²:
    /// what stiffness and contact hold back within a step is no error of the solution (Shampine 1984; Hairer & Wanner,
    /// Solving ODEs II, IV.8).
    fn slow_part(
        &mut self,
        mut system: NewtonSystem,
        span: f64,
        apart: &[V3d],
        report: &mut NewtonReport,
    ) -> Result<f64, OfflineError> {
        if self.settings.error_rate.is_infinite() {
            return Ok(mean(apart));
        }
        let mass = &self.cloth.mass;
        for (i, g) in system.gradient.iter_mut().enumerate() {
            let inertia = |d: &V3d| d * (-mass[i] / (span * span));
            *g = apart.get(i).map_or_else(V3d::zeros, inertia);
        }
        let x = self.state.unknowns();
        let mut slow = vec![V3d::zeros(); x.len()];
        let linear = self.settings.newton.linear(self.par, 1.0);
        report.products += self
            .directions
            .solve(linear, &system.linear(&x), &mut slow)?;
        Ok(mean(&slow[..apart.len()]))
    }

    pub(super) fn accept(&mut self, solved: SolvedStep, h: f64, time: f64) {
        let before = std::mem::replace(&mut self.state.now, solved.end);
        self.state.earlier = Some((before, h));
        self.state.obstacle = solved.obstacle;
        self.state.time = time;
    }

    /// Doubles the step, whose halvings stay within `levels`, when it was accurate for a while and the frame's grid allows it.
    fn grow(&mut self, calm: bool, levels: RangeInclusive<u32>, at: u64) {
        self.calm_steps = if calm { self.calm_steps + 1 } else { 0 };
        if self.calm_steps < self.settings.steps_before_growth || self.level <= *levels.start() {
            return;
        }
        if at.is_multiple_of(1 << (levels.end() - self.level + 1)) {
            self.level -= 1;
            self.calm_steps = 0;
        }
    }
}

/// A solution that may still be refused for its error.
pub(super) struct SolvedStep {
    pub(super) end: MotionState,
    /// Obstacle and its targets (m).
    obstacle: [Vec<V3d>; 2],
    /// Estimated local error (m, root mean square).
    error: f64,
}
