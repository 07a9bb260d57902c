//! Bare hands and forearms in front of a garment that hangs loosely before them.
//!
//! The simulated shirt does not know of a hand that presses it and hangs centimetres in front. Depth cannot decide: a
//! flat hand is as thick as the tracking error. Colour can: skin connected with the tracked hand in space is the hand.

pub(crate) mod detect;
mod grid;
mod sampling;

pub(super) use detect::{ArmScene, HandDetector, LayerDepths};
pub(super) use sampling::PosedLimbs;
