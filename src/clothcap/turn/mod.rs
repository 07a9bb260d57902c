//! Capture from one colour and depth camera before which the subject turns around once: track → key frames → fuse → one scan.
//!
//! The camera stands still and sees one side at a time. Frames at different yaws are taken to one reference pose by the
//! inverse of their own skinning, so that they add up to a [`BodyScan`](super::scan::BodyScan) of that pose, which
//! [`OutfitCapture`](super::OutfitCapture) captures like any other.

mod error;
pub(crate) mod frame_points;
pub(crate) mod fused_cloud;
mod fusion;
pub(crate) mod key_frames;
mod moving_parts;
pub(crate) mod multi_view;
mod report;
#[cfg(test)]
mod tests;

pub use crate::settings::TurnConfig;
pub use error::TurnError;
pub use fusion::{FusedTurn, fuse};
pub use key_frames::{KeyFrame, KeyFrames, TurnTracker};
pub use report::{KeyFrameReport, TurnReport};
