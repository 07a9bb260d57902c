//! `tryon`: the mirror, from a frame to a picture for one person, and the library it stands on.
//!
//! Synchronous code without network, clock or global state; the services are thin shells around its `step`
//! functions. Each part is a crate of its own below `src/`, by layer; a crate depends on lower layers only.
//!
//! Start at [`mirror`], or at its steps: [`tracking`], [`cloth`] and [`view`].
//!
//! # Ideas
//!
//! Cloth:
//!
//! - When it is put on again: [`mod@mirror::wear`].
//! - The way to the live pose: [`mod@mirror::outfit`].
//!
//! Offline cloth:
//!
//! - A dressed outfit on finer meshes, started by the preview: [`mod@mirror::offline_outfit`],
//!   `src/garment/subdivision.rs`.
//!
//! Garments from scans:
//!
//! - As garments: [`mod@mirror::captured`].
//! - Pictures of the stages: [`mod@mirror::picture`].
//!
//! Life of a try-on:
//!
//! - Transitions, precedence of faults: [`mod@session::table`].
//! - Silence of a stage: [`mod@session::ages`].
//! - Gaps in the capture clock: [`mod@mirror::clock`].
//! - Garments chosen and their sizes: [`mod@mirror::choice`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

pub use tryon_body as body;
pub use tryon_cloth as cloth;
pub use tryon_clothcap as clothcap;
pub use tryon_dressing as dressing;
pub use tryon_formats as formats;
pub use tryon_garment as garment;
pub use tryon_geometry as geometry;
pub use tryon_synth as synth;
pub use tryon_tracking as tracking;
pub use tryon_view as view;

pub mod mirror;
pub mod session;
