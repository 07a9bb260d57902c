//! Garments from scans: alignment, segmentation, multi-part templates, undressing, retargeting.

pub mod align;
pub mod archive;
mod camera_gains;
mod capture;
mod capture_header;
mod captured_outfit;
mod cloud;
mod dress_body;
mod error;
mod face_edges;
mod floor;
mod layers;
pub mod mrf;
pub mod multi;
mod part_colors;
mod part_fitter;
pub mod picture;
mod population;
pub mod retarget;
mod scalp;
pub mod scan;
pub mod segment;
mod segmenter;
#[cfg(test)]
mod test_scans;
#[cfg(test)]
mod tests;
pub mod texture;
pub mod topology;
pub mod turn;
mod undress;
mod unpose;
mod virtual_camera;

pub use capture::{CaptureConfig, FrameCapture, FrameReport, OutfitCapture};
pub use captured_outfit::CapturedOutfit;
pub use dress_body::{BodyDresser, DressedPose};
pub use error::CaptureError;
pub use population::population;
pub use segmenter::{ScanSegmenter, SegmentedScan};
pub use undress::{Undressed, minimal_shape};
pub use unpose::{blended, unpose, unpose_shaped};
