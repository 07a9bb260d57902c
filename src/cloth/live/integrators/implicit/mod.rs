//! Implicit integrators: quasi-Newton on the finite elements, and the paper's linearised mass-spring step.

mod mass_spring;
mod quasi_newton;
mod sheet;

pub(super) use mass_spring::solver as mass_spring_solver;
pub(super) use sheet::ImplicitSolver;
