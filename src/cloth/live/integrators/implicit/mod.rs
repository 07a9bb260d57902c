//! Implicit integrators: quasi-Newton on the finite elements, and the paper's linearised mass-spring step.

pub(crate) mod mass_spring;
pub(crate) mod quasi_newton;
mod sheet;

pub(super) use mass_spring::solver as mass_spring_solver;
pub(super) use sheet::ImplicitSolver;
