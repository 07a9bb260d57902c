//! One step of garment motion against a moving body: the real-time and the offline solvers.

mod error;
pub(crate) mod folds;
pub mod model;
pub mod realtime;
pub mod scene;
pub(crate) mod sleeves;
pub mod solver;
pub(crate) mod untangle;

pub use error::ClothError;
pub use model::{Element, Hinge, Sheet};
