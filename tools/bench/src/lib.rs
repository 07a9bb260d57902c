//! Run time against error: standard scenes, methods side by side and tables behind `tryon-bench`.
//!
//! A benchmark fills a [`Table`]; [`Table::write`] leaves it as Markdown and JSON.
//!
//! # Ideas
//!
//! Segmentation:
//!
//! - Its score: [`mod@parts`], on recordings: [`mod@parts_recorded`].
//!
//! Evidence:
//!
//! - Standard scenes, the paper's failures rebuilt: [`mod@scenes`].
//! - Corrupted depth: [`mod@corruptions`].
//! - Joint and surface errors: [`mod@tracking`].
//! - Captured garments against truth: [`mod@garment_capture::score`].
//! - The dance: [`mod@dance`].
//! - Outfits worn through motions: [`mod@worn`].
//! - Folds finer than the simulation against the offline solver's: [`mod@folds`], their measure [`mod@folds::band`].
//! - The composed picture: [`mod@picture`]; decisions read from it: `picture/signal`, truth: `picture/person_truth`,
//!   measures: `picture/border`, `picture/noise`, `picture/edge_width`.
//! - Dressed scans with truth per point: [`mod@scans::scene`].
//! - The embedded body: [`mod@made_body::figure`] (proportions), [`mod@made_body::field`] (surface),
//!   [`mod@made_body::rig`], [`mod@made_body::directions`] (shape space), [`mod@made_body::statistics`] (published measurements).
//! - The tracker and the paper's form side by side: [`mod@tracking_plan`].
//! - Everyone who walks in, the bars of a release: [`mod@people::plan`], a file a row beside it.
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod body_film;
pub mod ccd;
mod ccd_queries;
pub mod cloth;
pub mod cloth_offline;
mod corruptions;
pub mod dance;
mod dance_bodies;
mod depth_scene;
pub mod dress_offline;
mod error;
pub mod folds;
pub mod garment_capture;
mod inside;
pub mod made_body;
mod outfit;
pub mod parts;
pub mod parts_recorded;
pub mod people;
pub mod picture;
pub mod rest;
pub mod scans;
pub mod scenes;
mod segment;
mod sheet;
mod table;
pub mod tracking;
pub mod tracking_plan;
pub mod worn;

pub use body_film::BodyFilm;
pub use depth_scene::{DepthScene, SceneTruth};
pub use error::EvaluateError;
pub use inside::Solid;
pub use outfit::OutfitSpec;
pub use sheet::Sheet;
pub use table::{Row, Table};
