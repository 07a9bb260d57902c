//! Garments from scans: alignment, segmentation, multi-part templates, undressing, retargeting.
//!
//! # Ideas
//!
//! - Units, axes, normals: [`mod@scan`].
//! - From one camera: key frames [`mod@turn::key_frames`], points of a frame [`mod@turn::frame_points`], one pose for
//!   all [`mod@turn::fused_cloud`], joint registration [`mod@turn::multi_view`].
//! - What no scan point shows: [`mod@segment::unseen`].
//! - Start from virtual depth cameras: [`mod@align::start`], [`mod@virtual_camera`], [`tryon_tracking::still`].
//! - Body model to scan (eq. 3, 6, 7): [`mod@align::model_fit`].
//! - A surface pulled to points, the same for the fits below: [`mod@align::surface_fit`], its linear system
//!   [`mod@align::quadratic`], its pairs [`mod@align::scan_pairing`].
//! - Free surface (eq. 4, 5): [`mod@align::free_surface`].
//! - Sequences (eq. 9, 10): [`mod@align::aligner`].
//! - Surfaces of skirts and dresses: [`mod@topology`].
//! - Told from trousers in [`mod@align::legs`].
//! - Unposing (eq. 8): [`tryon_body::PosedSkin`].
//! - Colours (eq. 13): [`mod@segment::color_mixture`].
//! - Prior (figure 4): [`mod@segment::prior`].
//! - Labels (eq. 11, 12): [`mod@segment::labelling`].
//! - Number and kinds of garments: [`mod@segment::outfit`].
//! - Two on the torso: [`mod@segment::torso`].
//! - Labels of the scan: [`mod@segment::scan_labels`].
//! - Alpha expansion, maximum flow (eq. 14): [`mod@tryon_geometry::mrf`].
//! - Parts and rings: [`mod@multi::part`].
//! - Their fit (eq. 15 to 21): [`mod@multi::part_fit`].
//! - One shape from several scans (section 5.4): [`mod@align::shared_shape`], [`mod@align::body_equations`].
//! - Body under the cloth (eq. 22): [`mod@undress`].
//! - Hidden layers: [`mod@layers`].
//! - Other bodies (eq. 23 to 25): [`mod@dress_body`].
//! - Out of the body: [`mod@retarget`].
//! - A population: [`mod@population`].
//! - Texture: charts [`mod@texture::charts`], their image [`mod@texture::atlas`], its colours [`mod@texture::paint`],
//!   on the worn garment `src/mirror/captured.rs`.
//! - Files of a capture, resumed: [`mod@archive`].
//! - Captured parts as cloth to wear: [`mod@multi::trim`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

pub mod align;
pub mod archive;
mod camera_gains;
mod capture;
mod capture_header;
mod captured_outfit;
mod cloud;
mod dress_body;
mod error;
mod floor;
mod layers;
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
mod virtual_camera;

pub use capture::{CaptureConfig, FrameCapture, FrameReport, OutfitCapture};
pub use captured_outfit::CapturedOutfit;
pub use dress_body::{BodyDresser, DressedPose};
pub use error::CaptureError;
pub use population::population;
pub use segmenter::{ScanSegmenter, SegmentedScan};
pub use undress::{Undressed, minimal_shape};
