//! Implicit solvers in double precision.

pub mod quasi_newton;
