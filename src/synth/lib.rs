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
//! - Synthetic people and their truth: [`mod@sequence`], [`mod@routine`], [`mod@posture`], [`mod@room`], drawn by [`mod@room_view`] and [`mod@body_view`].
//! - Appearance: [`mod@actor`], [`mod@paint`], [`mod@street_clothes`], [`mod@figure`] with [`mod@figure_head`]; [`mod@backdrop`]; light: [`mod@material`],
//!   [`mod@shadow_map`], [`mod@floor_shadow`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod actor;
mod backdrop;
mod base_layer;
mod body_view;
mod clip;
mod figure;
mod figure_head;
mod floor_shadow;
mod furniture;
mod imaging;
pub mod labelled;
mod material;
mod paint;
mod physique;
mod posture;
#[cfg(test)]
mod reoriented_tests;
mod rest_pose;
mod room;
mod room_view;
mod routine;
mod sequence;
mod settings;
mod shadow_map;
mod shop;
mod source;
mod stance;
mod street_clothes;

pub use actor::{Actor, ActorAppearance};
pub use backdrop::Backdrop;
pub use clip::ClipError;
pub use furniture::{Piece, overlay};
pub use imaging::ColorImaging;
pub use physique::{Belly, Covering, Physique};
pub use posture::Posture;
pub use room::Room;
pub use routine::Routine;
pub use sequence::{SeparateColor, Sequence, Setting, Truth};
pub use settings::{
    CoveringSettings, FigureSettings, LightSettings, ShopSettings, StanceSettings, StreetClothes,
};
pub use shop::{PLACES, Shop};
pub use source::SynthSource;
pub use tryon_geometry::camera::NoiseModel;
