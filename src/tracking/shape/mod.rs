//! Shape of the subject: size in turns with the pose, displacements of the surface, bodies that were measured before.

pub(crate) mod calibration;
pub(crate) mod girth_deviation;
pub(crate) mod known_body;
pub(crate) mod probation;
pub(crate) mod size;
pub(crate) mod surface;
pub(crate) mod view_information;

pub(crate) use calibration::SizeCalibration;
pub use girth_deviation::GirthDeviations;
pub use known_body::{KnownBody, ShapeFault};
pub(crate) use probation::Probation;
pub use size::SizeEstimate;
pub(crate) use size::first_shapes;
pub use surface::SurfaceStatistics;
pub(crate) use surface::{SurfaceScratch, fit_displacements};
