//! A garment before it moves: panels, seams, materials, rest shape, sizes, anchors.
//!
//! # Ideas
//!
//! - Panels, seams, darts: [`mod@pattern`].
//! - Welding of panels to one mesh: [`mod@mesh`].
//! - Triangles of a panel: [`mod@triangulate`].
//! - Fabrics in SI units: [`mod@material`], their files [`mod@fabric`], what they look like [`mod@look`], bending by direction [`mod@bending`], tension
//!   curves [`mod@tensile`].
//! - Drafts of tops with their sleeves and hoods: [`mod@library::top`].
//! - Cuts of all of them, ease and lengths: [`mod@library::cuts`].
//! - Trousers, skirts, dress: [`mod@library::trousers`], [`mod@library::skirt`], [`mod@library::dress`].
//! - Pockets, buttons, zips: [`mod@trim`], those of the library [`mod@library::trims`].
//! - Sizes: [`mod@size`].
//! - GarmentCode: [`mod@import::garmentcode`].
//! - Coarser meshes of imported garments: [`mod@import::coarsen`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod bending;
mod error;
mod fabric;
mod fabric_image;
mod flat_triangle;
pub mod import;
pub mod library;
mod look;
mod material;
mod mesh;
mod outline;
mod pattern;
mod size;
mod subdivision;
mod tensile;
mod triangulate;
mod trim;

pub use bending::Bending;
pub use error::GarmentError;
pub use fabric::FabricSample;
pub use fabric_image::FabricImage;
pub use flat_triangle::rest_area;
pub use look::{FabricLook, Finish, Structure};
pub use material::{IsotropicSolid, Material};
pub use mesh::{AnchorKind, AnchorSet, GarmentMesh, Region, RenderMesh, joined_faces};
pub use outline::{Curve, PanelEdge};
pub use pattern::{Anchor, Dart, GarmentKind, Panel, Pattern, Placement, Seam, Side};
pub use size::{BodyMeasures, Size, SizeRow, size_table};
pub use subdivision::GarmentSubdivision;
pub use tensile::{CubicTension, Tensile, TensionCurve};
pub use triangulate::Triangulation;
pub use trim::{MAX_TRIM_SIDE, MAX_TRIMS, PlacedTrim, Trim, TrimKind};
