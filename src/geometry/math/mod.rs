//! Small fixed-size algebra that nalgebra lacks: so(3)/se(3) maps, twists, polar rotation, PSD projection, element energy, derivative check.

pub mod derivative_check;
mod element_energy;
pub(crate) mod frames;
pub(crate) mod lie;
pub mod order_statistics;
pub(crate) mod polar;
mod symmetric;

pub use element_energy::ElementEnergy;
pub use frames::{Body, Camera, ColorCamera, Rigid, World};
pub use lie::{Twist, exp_se3, exp_so3, left_jacobian_so3, log_so3, skew};
pub use polar::polar_rotation_3;
pub use symmetric::{principal_axes, project_psd};

/// A point in f32, metres: the storage type of surfaces.
pub type P3 = nalgebra::Point3<f32>;
/// A vector in f32: normals and differences of [`P3`].
pub type V3 = nalgebra::Vector3<f32>;
/// A point in f64: what solvers and skeletons compute with.
pub type P3d = nalgebra::Point3<f64>;
/// A vector in f64.
pub type V3d = nalgebra::Vector3<f64>;
