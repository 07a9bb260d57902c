//! One step of garment motion against a moving body: the real-time and the offline solvers.

mod crossings;
mod error;
pub(crate) mod folds;
pub mod membrane;
mod pieces;
pub mod quasi_newton;
pub mod realtime;
pub mod scene;
mod sheet;
pub(crate) mod sleeves;
pub mod small_steps;
pub(crate) mod untangle;

pub use crossings::{Crossing, crossings};
pub use error::ClothError;
pub use sheet::{Element, Hinge, Sheet};
