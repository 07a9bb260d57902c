//! Choice and resolution of a solver.

use serde::Serialize;

/// A solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Explicit substeps ([`super::explicit`]).
    #[serde(rename = "small_steps")]
    Explicit,
    /// Prefactorised quasi-Newton, implicit Euler.
    QuasiNewton,
    /// Prefactorised quasi-Newton, second-order backward difference (BDF2).
    QuasiNewtonBdf2,
    /// XPBD with small steps: one pass over the triangles a substep, on the edges and bending of the explicit solver.
    Xpbd,
    /// The paper's: springs along edges and across hinges, one linearised implicit Euler step.
    MassSpring,
}

/// Resolution of a simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunConfig {
    /// Solver.
    pub method: Method,
    /// Substeps a frame; 0 takes the solver's default. Implicit Euler loses energy with the step: one a frame halves a
    /// free swing within two seconds.
    pub substeps: usize,
    /// Quasi-Newton: iterations a substep.
    pub iterations: usize,
    /// Distance that cloth keeps from solids (m). Half a millimetre hides neither rounding nor a fabric's thickness.
    pub offset: f64,
    /// Explicit: extrapolation of the positions that forces are evaluated at (substeps).
    pub lookahead: f64,
    /// Explicit and XPBD: substeps between two evaluations of bending; 0 as the sheet allows.
    pub bending_interval: usize,
    /// Explicit: substeps between two contact queries.
    pub contact_interval: usize,
    /// Explicit: number of patches, each on a thread of its own where there are enough.
    pub patches: usize,
    /// Explicit: degree of the mass filter; `None` chooses as the sheet needs, 0 with self-collision. Filtered folds that
    /// press on each other hard diverge.
    pub filter_degree: Option<usize>,
    /// Explicit: contact of the sheet with itself.
    pub self_collision: bool,
    /// Distance between two folds (m); less where edges are short.
    pub thickness: f64,
    /// Longest time between two queries for other folds (s); less where they move fast.
    pub fold_search: f64,
}

impl Default for RunConfig {
    fn default() -> Self {
        Self {
            method: Method::Explicit,
            substeps: 0,
            iterations: 10,
            offset: 5e-4,
            lookahead: 0.1,
            bending_interval: 0,
            contact_interval: 8,
            patches: 1,
            filter_degree: None,
            self_collision: false,
            thickness: 0.003,
            fold_search: 1.0 / 240.0,
        }
    }
}
