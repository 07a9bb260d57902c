//! Capture from one colour and depth camera before which the subject turns around once: track → key frames → fuse → one scan.
//!
//! The camera stands still and sees one side at a time. Frames at different yaws are taken to one reference pose by the
//! inverse of their own skinning, so that they add up to a [`BodyScan`](super::scan::BodyScan) of that pose, which
//! [`OutfitCapture`](super::OutfitCapture) captures like any other.

mod error;
mod frame_points;
mod fused_cloud;
mod fusion;
mod key_frames;
mod moving_parts;
mod multi_view;
mod report;
#[cfg(test)]
mod tests;

pub use error::TurnError;
pub use fusion::{FusedTurn, TurnConfig, fuse};
pub use key_frames::{KeyFrame, KeyFrames, TurnTracker};
pub use report::{KeyFrameReport, TurnReport};
