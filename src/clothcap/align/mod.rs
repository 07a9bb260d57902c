//! Single-mesh alignment (section 5.1): body model, then free surface, first of one scan, then of a sequence.

mod active_vertices;
pub(crate) mod aligner;
mod arms;
pub(crate) mod free_surface;
mod jacobian;
pub(crate) mod legs;
pub(crate) mod model_fit;
pub(crate) mod quadratic;
pub(crate) mod scan_pairing;
pub(crate) mod shared_shape;
pub(crate) mod start;
pub(crate) mod surface_fit;
mod unknowns;

pub use active_vertices::VertexCounts;
pub use aligner::{Aligner, Alignment, AlignmentReport, ClothedTemplate};
pub use free_surface::FreeSurface;
pub use model_fit::{AlignedBody, ModelFit, PosedSurface};
pub(super) use quadratic::{EVEN_EDGE, Pull, PullPlace};
pub use quadratic::{QuadraticEnergy, Stencil};
pub use scan_pairing::{QueryCounts, SurfaceMatch};
pub(super) use scan_pairing::{ScanPairing, ScanPoints, explained};
pub(super) use shared_shape::fit_shared_shape;
pub use start::{Start, find_frame, find_person};
pub use surface_fit::SurfaceFitReport;
pub(super) use surface_fit::{SurfaceFit, SurfaceTerms};
