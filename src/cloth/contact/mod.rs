//! The collision body of a pose: filtered, parts and joints separated; its closest points, inside tests and virtual depth maps. Contact pairs: broad phase, continuous collision detection, distances, barrier, friction.
//!
//! The body is built once a pose: cloth collides with it, dressing drapes on it, the compositor draws it. Nothing here steps time.

pub(crate) mod body_filter;
pub mod broad_phase;
pub mod ccd;
mod closest_multistart;
pub(crate) mod closest_point;
pub(crate) mod collision_body;
mod contact_mesh;
pub(crate) mod depth_maps;
pub(crate) mod distance;
mod edge_triangle;
pub(crate) mod interior;
pub(crate) mod joint_clearance;
mod pair;
pub(crate) mod part_clearance;
pub(crate) mod potential;
mod proximity_cache;
mod skin_grid;
mod surface;
#[cfg(test)]
mod test_shapes;
mod triangle_fan;

pub use crate::settings::{
    CollisionConfig, JointClearanceSettings, MapDetail, MapSettings, PartClearanceSettings,
    SkinQuerySettings,
};
pub use closest_point::{ClosestPoint, SearchExtent};
pub use collision_body::{
    CollisionBody, CollisionError, CollisionModel, CollisionParts, CollisionWorkspace,
};
pub use contact_mesh::{ContactMesh, ContactMeshError, ContactSurface};
pub use depth_maps::{DepthMaps, MapView};
pub use distance::{
    ClosestFeatures, ParallelMollifier, Separation, Slide, edge_edge, mollifier_threshold,
    point_edge, point_point, point_triangle,
};
#[cfg(test)]
pub(crate) use edge_triangle::edge_meets_triangle;
pub use interior::Interior;
pub use pair::{ActivePair, ContactPair};
pub use potential::{
    Barrier, BarrierSample, ContactAssembly, ContactElement, Curvature, Friction, FrictionPair,
};
pub use skin_grid::{SkinCandidates, SkinGrid};
pub use surface::{Part, SurfaceFrame, SurfaceModel};
pub(crate) use triangle_fan::{LANES, TriangleFan};
