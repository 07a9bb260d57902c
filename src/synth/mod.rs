//! Synthetic people, garments, cameras and sequences with known truth.
//!
//! A [`Sequence`] is an [`Actor`] doing a [`Routine`] in a [`Room`] before a camera with a
//! [`NoiseModel`]. Frames are functions of their number: any order, same bits.

mod clip;
mod furniture;
pub mod labelled;
mod paint;
mod physique;
mod posture;
mod room;
mod routine;
mod sequence;
mod shop;
mod source;
mod stance;

pub use crate::camera::NoiseModel;
pub use clip::ClipError;
pub use furniture::{Piece, overlay};
pub use physique::{Belly, Covering, Physique};
pub use posture::Posture;
pub use room::Room;
pub use routine::Routine;
pub use sequence::{Actor, Sequence, Setting, Truth};
pub use shop::{PLACES, Shop};
pub use source::SynthSource;
