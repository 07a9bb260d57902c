//! A person's 33 landmarks in the colour image, and their joints in metres where depth shows them.
//!
//! ```no_run
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let (frame, calibration): (tryon_geometry::camera::RgbdFrame, tryon_geometry::camera::Calibration) = todo!();
//! use tryon_landmarks::{LandmarkLifter, Landmarker};
//!
//! let mut landmarker = Landmarker::open("target/landmarks.onnx")?;
//! let mut lifter = LandmarkLifter::new(calibration);
//! if let Some(color) = &frame.color
//!     && let Some(pose) = landmarker.find(color)?
//! {
//!     let lifted = lifter.lift(&frame.depth, &pose)?;
//!     println!("{:?}", lifted.trunk.yaw(&[0.0, -1.0, 0.0].into()));
//! }
//! # Ok(())
//! # }
//! ```
//!
//! The networks are those of MediaPipe Pose (Bazarevsky et al., "BlazePose", 2020), converted by `tools/landmarks`; one
//! thread, a frame costs one run of the landmarks' network and, while nobody is followed, one of the detector for each
//! quarter turn of the picture that is tried.
//!
//! # Ideas
//!
//! - Person without memory, or in the region of the last frame: [`mod@landmarker`].
//! - The converted file and its checksum: [`mod@model_file`]; its graphs, run by rten: [`mod@network`].
//! - Square of the picture, turned with the person: [`mod@region`]; its pixels as a network's input: [`mod@crop`].
//! - Boxes on a grid of anchors (SSD), weighted suppression: [`mod@detection`], [`mod@anchors`].
//! - Landmarks from the network's numbers: [`mod@decode`], their names: [`mod@landmark`].
//! - Joints by registered depth, and the hidden ones, by the network's own depths: [`mod@lift`],
//!   [`mod@placed_guess`], [`mod@reading_window`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod anchors;
mod crop;
mod decode;
mod detection;
mod error;
mod landmark;
mod landmarker;
mod lift;
mod model_file;
mod network;
mod placed_guess;
mod reading_window;
mod region;
mod settings;
#[cfg(test)]
mod tests;

pub use error::LandmarkError;
pub use landmark::{Landmark, LandmarkKind, PoseLandmarks};
pub use landmarker::Landmarker;
pub use lift::{LandmarkLifter, LiftedPose};
pub use model_file::shared_model;
pub use region::PersonRegion;
pub use settings::{LandmarkLiftSettings, LandmarkSettings};
