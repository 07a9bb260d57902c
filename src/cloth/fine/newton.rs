//! Newton's method with an inexact linear solve and a backtracking line search whose longest step contact limits.

use super::error::{NewtonFault, OfflineError};
use super::linear_solver::{DirectionSolver, LinearSystem};
use crate::settings::NewtonSettings;
use serde::{Deserialize, Serialize};
use tryon_geometry::linear::{BlockMatrix, CgAccuracy, CgSettings, LinearError};
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Motion of all vertices below which nothing moves (m): rounding alone.
const RESTING: f64 = 1e-12;
/// Decrease relative to the energy below which rounding decides, so that a full step is taken.
const ROUNDING: f64 = 1e-13;

impl NewtonSettings {
    /// End of a linear solve, so many times as loose.
    pub(super) fn linear(&self, par: Par, looseness: f64) -> CgSettings {
        CgSettings {
            accuracy: CgAccuracy::Decrease(looseness * self.linear_share),
            iterations: self.linear_iterations,
            par,
        }
    }

    /// True for a share of a direction so small that the iteration ends.
    fn is_settled(&self, direction: &[V3d], share: f64) -> bool {
        let (longest, mean) = (largest(direction).1, mean(direction));
        longest * share <= self.largest && mean * share <= self.tolerance
    }
}

/// Work of one or several minimisations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NewtonReport {
    /// Newton iterations.
    pub iterations: usize,
    /// Products of conjugate gradients.
    pub products: usize,
    /// Evaluations of the energy in line searches.
    pub evaluations: usize,
    /// Iterations whose step contact shortened.
    pub limited: usize,
    /// Smallest share of a step that contact left.
    pub smallest_share: f64,
}

impl NewtonReport {
    /// Adds the work of another minimisation.
    pub fn add(&mut self, other: &Self) {
        self.iterations += other.iterations;
        self.products += other.products;
        self.evaluations += other.evaluations;
        self.limited += other.limited;
        self.smallest_share = self.smallest_share.min(other.smallest_share);
    }
}

/// Energy with its second-order expansion at one point.
#[derive(Debug, Default)]
pub(super) struct NewtonSystem {
    /// Energy (J).
    pub(super) value: f64,
    /// Gradient (N), shape `[unknown vertices]`.
    pub(super) gradient: Vec<V3d>,
    /// Hessian of shape, inertia, pins and obstacle (N/m).
    pub(super) shape: BlockMatrix,
    /// Hessian of contact and friction (N/m); of size zero without contact.
    pub(super) contact: BlockMatrix,
}

impl NewtonSystem {
    /// The linear system of its minimum, expanded at `x`.
    pub(super) fn linear<'a>(&'a self, x: &'a [V3d]) -> LinearSystem<'a> {
        LinearSystem {
            x,
            gradient: &self.gradient,
            shape: &self.shape,
            contact: &self.contact,
        }
    }

    /// Derivative of the energy along a direction (J).
    fn slope(&self, direction: &[V3d]) -> f64 {
        let pairs = self.gradient.iter().zip(direction);
        pairs.map(|(g, p)| g.dot(p)).sum()
    }
}

/// Energy to minimise.
pub(super) trait Minimised {
    /// Empty expansion with the pattern of its blocks.
    fn new_system(&self) -> NewtonSystem;
    /// Energy at `x` (J).
    fn value(&mut self, x: &[V3d]) -> f64;
    /// Expansion at `x`, replacing the one in `out`.
    fn assemble(&mut self, x: &[V3d], out: &mut NewtonSystem) -> Result<(), LinearError>;
    /// Largest share of `direction`, at most 1, that passes through nothing; prepares contact for that segment.
    fn free_share(&mut self, x: &[V3d], direction: &[V3d]) -> f64;
}

/// Largest norm and its index.
pub(super) fn largest(vectors: &[V3d]) -> (usize, f64) {
    let mut found = (0, 0.0);
    for (i, v) in vectors.iter().enumerate() {
        let norm = v.norm();
        if !(norm <= found.1) {
            found = (i, norm);
        }
    }
    found
}

/// Root mean square norm.
pub(super) fn mean(vectors: &[V3d]) -> f64 {
    let sum: f64 = vectors.iter().map(V3d::norm_squared).sum();
    (sum / vectors.len().max(1) as f64).sqrt()
}

/// Moves `x` to the minimum; returns the expansion at the last iterate.
///
/// # Errors
/// The reason why it was not reached, and linear systems that cannot be solved; `x` is then the best point so far, which is
/// free of intersections if the start was.
pub(super) fn minimise(
    problem: &mut impl Minimised,
    settings: &NewtonSettings,
    solver: &mut DirectionSolver,
    x: &mut [V3d],
    report: &mut NewtonReport,
) -> Result<Result<NewtonSystem, NewtonFault>, OfflineError> {
    let mut system = problem.new_system();
    let mut direction = vec![V3d::zeros(); x.len()];
    let mut trial = x.to_vec();
    let mut last_motion = (0, f64::INFINITY);
    for _ in 0..settings.iterations {
        problem.assemble(x, &mut system)?;
        if let Some(vertex) = first_not_finite(&system.gradient) {
            return Ok(Err(NewtonFault::NotFinite { vertex }));
        }
        let par = solver.par;
        let linear = settings.linear(par, 1.0);
        report.products += solver.solve(linear, &system.linear(x), &mut direction)?;
        report.iterations += 1;
        if settings.is_settled(&direction, 1.0) {
            // A small step may be one of which a loose solution has hidden the rest: rigid motion comes last.
            let tight = settings.linear(par, settings.last_accuracy);
            report.products += solver.improve(tight, &system.linear(x), &mut direction)?;
        }
        last_motion = largest(&direction);
        if !last_motion.1.is_finite() {
            let vertex = last_motion.0;
            return Ok(Err(NewtonFault::NotFinite { vertex }));
        }
        if last_motion.1 < RESTING {
            return Ok(Ok(system));
        }
        shorten(&mut direction, last_motion.1, settings.longest);
        let free = problem.free_share(x, &direction);
        if free < 1.0 {
            report.limited += 1;
            report.smallest_share = report.smallest_share.min(free);
        }
        let line = SearchLine {
            start: x,
            direction: &direction,
            free,
            settings,
        };
        let (found, evaluations) = line.search(problem, &system, &mut trial);
        report.evaluations += evaluations;
        if found.is_none() {
            let (vertex, motion) = last_motion;
            let share = free;
            return Ok(Err(NewtonFault::Stuck {
                vertex,
                motion,
                share,
            }));
        }
        x.copy_from_slice(&trial);
        // Halved once, it went too far at a few vertices, not astray; less than that says nothing about what is left.
        let accepted = found.filter(|share| *share >= 0.5 && free >= 1.0);
        if accepted.is_some_and(|share| settings.is_settled(&direction, share)) {
            return Ok(Ok(system));
        }
    }
    let (vertex, motion) = last_motion;
    Ok(Err(NewtonFault::Iterations {
        vertex,
        motion,
        iterations: settings.iterations,
    }))
}

/// Scales a direction of this `length` down to `most` (m).
fn shorten(direction: &mut [V3d], length: f64, most: f64) {
    if length > most {
        direction.iter_mut().for_each(|d| *d *= most / length);
    }
}

fn first_not_finite(gradient: &[V3d]) -> Option<usize> {
    gradient
        .iter()
        .position(|g| !g.iter().all(|c| c.is_finite()))
}

/// Segment along which the energy is searched.
struct SearchLine<'a> {
    start: &'a [V3d],
    direction: &'a [V3d],
    /// Share of the direction that passes through nothing.
    free: f64,
    settings: &'a NewtonSettings,
}

impl SearchLine<'_> {
    /// Longest of the halved steps that lowers the energy enough; fills `trial`. Returns its share of the direction and the
    /// evaluations of the energy.
    fn search(
        &self,
        problem: &mut impl Minimised,
        system: &NewtonSystem,
        trial: &mut [V3d],
    ) -> (Option<f64>, usize) {
        let slope = system.slope(self.direction);
        let noise = ROUNDING * system.value.abs();
        let mut share = self.free;
        let NewtonSettings {
            sufficient_decrease,
            max_halvings,
            ..
        } = *self.settings;
        for halvings in 0..max_halvings {
            for (t, (x, p)) in trial.iter_mut().zip(self.start.iter().zip(self.direction)) {
                *t = x + p * share;
            }
            let value = problem.value(trial);
            if value <= system.value + sufficient_decrease * share * slope + noise {
                return (Some(share), halvings + 1);
            }
            share *= 0.5;
        }
        (None, max_halvings)
    }
}
