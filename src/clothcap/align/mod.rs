//! Single-mesh alignment (section 5.1): body model, then free surface, first of one scan, then of a sequence.

mod active_vertices;
pub(crate) mod aligner;
mod angle_priors;
mod arms;
pub(crate) mod body_equations;
pub(crate) mod face_cache;
mod face_walk;
pub(crate) mod free_surface;
mod jacobian;
pub(crate) mod legs;
pub(crate) mod model_fit;
mod pairing;
pub(crate) mod quadratic;
mod shape_unknowns;
pub(crate) mod shared_shape;
pub(crate) mod start;

pub(super) use active_vertices::ActiveVertices;
pub use active_vertices::VertexCounts;
pub use aligner::{Aligner, Alignment, AlignmentReport, ClothedTemplate};
pub use face_cache::QueryCounts;
pub(super) use face_cache::{FaceCache, QueryPoints};
pub(super) use face_walk::QuerySurface;
pub use free_surface::{
    FreeSurface, SurfaceFitConfig, SurfaceFitReport, SurfaceMatch, SurfaceStage,
};
pub(super) use free_surface::{SETTLED, STILL};
pub use model_fit::{AlignedBody, FitStage, ModelFit, ModelFitReport};
pub(super) use pairing::{ScanNormal, closest_facing};
pub(super) use quadratic::EVEN_EDGE;
pub use quadratic::{QuadraticEnergy, Stencil};
pub(super) use shared_shape::fit_shared_shape;
pub use start::{Start, find_frame, find_person};
