//! A garment before it moves: panels, seams, materials, rest shape, sizes, anchors.

mod error;
pub mod import;
pub mod library;
mod material;
mod mesh;
mod outline;
mod pattern;
mod size;
mod triangulate;

pub use error::GarmentError;
pub use material::Material;
pub use mesh::mesh_area;
pub use mesh::{AnchorKind, AnchorSet, GarmentMesh, Region, RenderMesh, Triangulation};
pub use outline::{Curve, PanelEdge};
pub use pattern::{Anchor, Dart, GarmentKind, Panel, Pattern, Placement, Seam, Side};
pub use size::{BodyMeasures, Size, SizeRow, size_table};
