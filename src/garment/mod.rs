//! A garment before it moves: panels, seams, materials, rest shape, sizes, anchors.

mod error;
mod fabric_image;
mod flat_triangle;
pub mod import;
pub mod library;
mod material;
mod mesh;
mod outline;
mod pattern;
mod presets;
mod size;
mod subdivision;
mod triangulate;
mod union_find;

pub use error::GarmentError;
pub use fabric_image::FabricImage;
pub use flat_triangle::rest_area;
pub use material::{IsotropicSolid, Material};
pub use mesh::{AnchorKind, AnchorSet, GarmentMesh, Region, RenderMesh, Triangulation};
pub use outline::{Curve, PanelEdge};
pub use pattern::{Anchor, Dart, GarmentKind, Panel, Pattern, Placement, Seam, Side};
pub use size::{BodyMeasures, Size, SizeRow, size_table};
pub use subdivision::GarmentSubdivision;
