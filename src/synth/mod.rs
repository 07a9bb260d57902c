//! Synthetic people, garments, cameras and sequences with known truth.
//!
//! A [`Sequence`] is an [`Actor`] doing a [`Routine`] in a [`Room`] before a camera with a
//! [`NoiseModel`]. Frames are functions of their number: any order, same bits.

mod clip;
mod paint;
mod room;
mod routine;
mod sequence;
mod source;
mod stance;

pub use crate::camera::NoiseModel;
pub use clip::ClipError;
pub use room::Room;
pub use routine::Routine;
pub use sequence::{Actor, Sequence, Setting, Truth};
pub use source::SynthSource;
