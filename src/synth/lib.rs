//! Synthetic people, garments, cameras and sequences with known truth.
//!
//! A [`Sequence`] is an [`Actor`] doing a [`Routine`] in a [`Room`] before a camera with a
//! [`NoiseModel`]. Frames are functions of their number: any order, same bits.
//!
//! # Ideas
//!
//! Segmentation:
//!
//! - Its training people: [`mod@labelled`].
//!
//! Evidence:
//!
//! - Synthetic people and their truth: [`mod@sequence`], [`mod@routine`], [`mod@posture`], [`mod@room`], drawn by [`mod@room_view`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod clip;
mod furniture;
pub mod labelled;
mod paint;
mod physique;
mod posture;
#[cfg(test)]
mod reoriented_tests;
mod room;
mod room_view;
mod routine;
mod sequence;
mod settings;
mod shop;
mod source;
mod stance;

pub use clip::ClipError;
pub use furniture::{Piece, overlay};
pub use physique::{Belly, Covering, Physique};
pub use posture::Posture;
pub use room::Room;
pub use routine::Routine;
pub use sequence::{Actor, SeparateColor, Sequence, Setting, Truth};
pub use settings::{CoveringSettings, LightSettings, ShopSettings, StanceSettings};
pub use shop::{PLACES, Shop};
pub use source::SynthSource;
pub use tryon_geometry::camera::NoiseModel;
