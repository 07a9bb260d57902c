//! Closed forms, invariants and stress of the explicit solver.

mod closed_forms;
mod degenerate;
mod invariants;
mod sleeping;
