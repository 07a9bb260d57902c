//! Explicit substeps of one sheet among moving solids.

mod self_collision;
mod solid_contacts;
mod solver;

pub(super) use solid_contacts::{RECOVERY_SPEED, SolidContacts, moving_pins};
pub(super) use solver::ExplicitSolver;
