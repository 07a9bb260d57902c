//! Recovery of a pose that disagrees with its frame: hidden limbs behind the readings, limbs and bodies where they are
//! proposed.

pub(crate) mod hidden_limb;
pub(crate) mod repair;

pub(crate) use hidden_limb::HiddenLimb;
pub(crate) use repair::{Repair, RepairTimer};
