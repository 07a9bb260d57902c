//! The minimisation of one step: shape, inertia and pins of the cloth, springs of the obstacle, contact.

use super::contacts::Contacts;
use super::error::OfflineError;
use super::linear_solver::DirectionSolver;
use super::newton::{Minimised, NewtonReport, NewtonSystem, largest};
use super::potential::StepPotential;
use crate::settings::{NewtonSettings, ObstacleSpring};
use nalgebra::Matrix3;
use tryon_geometry::linear::LinearError;
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Unknowns are the cloth's vertices, then the obstacle's.
pub(super) struct StepProblem<'a> {
    pub(super) potential: StepPotential<'a>,
    /// Targets of the obstacle's vertices (m).
    pub(super) obstacle: &'a [V3d],
    pub(super) spring: ObstacleSpring,
    pub(super) contacts: Option<&'a mut Contacts>,
    pub(super) par: Par,
}

impl StepProblem<'_> {
    /// First guess of a step from `x`: one linear step in which the obstacle follows its script and gaps keep their width,
    /// shortened to where nothing touches.
    ///
    /// # Errors
    /// A linear system that cannot be solved.
    pub(super) fn guess(
        &mut self,
        settings: &NewtonSettings,
        solver: &mut DirectionSolver,
        x: &mut [V3d],
        report: &mut NewtonReport,
    ) -> Result<(), OfflineError> {
        let n = self.potential.cloth.len();
        let motion: Vec<V3d> = x[n..]
            .iter()
            .zip(self.obstacle)
            .map(|(x, t)| t - x)
            .collect();
        let reach = 2.0 * largest(&motion).1;
        let mut system = self.new_system();
        self.potential.assemble(self.par, x, &mut system);
        for (j, d) in motion.iter().enumerate() {
            let k = self.spring.stiffness;
            system.add_diagonal(n + j, d * -k, Matrix3::from_diagonal_element(k));
        }
        if let Some(contacts) = &mut self.contacts {
            contacts.keep_gaps(x, reach, &mut system)?;
        }
        let mut direction = vec![V3d::zeros(); x.len()];
        let linear = settings.linear(self.par, settings.guess_accuracy);
        report.products += solver.solve(linear, &system.linear(x), &mut direction)?;
        let free = self.free_share(x, &direction);
        for (x, d) in x.iter_mut().zip(&direction) {
            *x += d * free;
        }
        Ok(())
    }
}

impl Minimised for StepProblem<'_> {
    fn new_system(&self) -> NewtonSystem {
        NewtonSystem {
            shape: self.potential.cloth.matrix(self.obstacle.len()),
            ..NewtonSystem::default()
        }
    }

    fn value(&mut self, x: &[V3d]) -> f64 {
        let n = self.potential.cloth.len();
        let mut value = self.potential.value(self.par, x);
        let apart = x[n..].iter().zip(self.obstacle);
        value += apart.map(|(x, t)| self.spring.value(&(x - t))).sum::<f64>();
        match &mut self.contacts {
            Some(contacts) => value + contacts.value(x),
            None => value,
        }
    }

    fn assemble(&mut self, x: &[V3d], out: &mut NewtonSystem) -> Result<(), LinearError> {
        let n = self.potential.cloth.len();
        self.potential.assemble(self.par, x, out);
        for (j, target) in self.obstacle.iter().enumerate() {
            self.spring.assemble(n + j, &(x[n + j] - target), out);
        }
        match &mut self.contacts {
            Some(contacts) => contacts.assemble(x, out),
            None => Ok(()),
        }
    }

    fn free_share(&mut self, x: &[V3d], direction: &[V3d]) -> f64 {
        match &mut self.contacts {
            Some(contacts) => contacts.free_share(x, direction),
            None => 1.0,
        }
    }
}
