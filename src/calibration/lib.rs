//! Extrinsics and time offset of a depth and a colour camera in one housing, from a person who walks before them.
//!
//! Outlines of the person in depth are projected into colour and moved onto the border of what differs there from the
//! empty scene: robust Gauss–Newton over pose, time and one width, from coarse to fine. The cameras stand still, and
//! their intrinsics are known.
//!
//! # Ideas
//!
//! Camera and files:
//!
//! - Two passes over a recording: [`mod@calibrate`].
//! - Empty scene in depth and colour: [`mod@depth_background`], [`mod@color_background`].
//! - Outline of the person in depth: [`mod@outline`]; its border in colour: [`mod@border`].
//! - Estimation: [`mod@solve`], its residuals [`mod@residual`]; what is not observable: [`mod@deviation`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod axis;
mod binned;
mod border;
mod calibrate;
mod change;
mod color_background;
mod depth_background;
mod deviation;
mod error;
mod evidence;
mod outline;
mod residual;
mod settings;
mod solve;
mod spread;
mod survey;
#[cfg(test)]
mod tests;

pub use axis::ExtrinsicAxis;
pub use calibrate::{Extrinsics, calibrate};
pub use deviation::Deviations;
pub use error::ExtrinsicsError;
pub use settings::ExtrinsicsSettings;
