//! Garments from scans: alignment, segmentation, multi-part templates, undressing, retargeting.
//!
//! Stages, each in the folder or file of its name:
//!
//! - [`mod@scan`]: units, axes, normals. [`mod@turn`]: one scan from the frames of one camera.
//! - [`mod@align`] (section 5.1): person in virtual cameras, body model (eq. 3, 6, 7, 9, 10), free surface (eq. 4, 5), all on
//!   one kind of surface pulled to points, [`mod@align::surface_fit`], and one sparse system, [`mod@align::quadratic`].
//! - [`mod@topology`]: surfaces of skirts and dresses; [`mod@align::legs`] tells them from trousers.
//! - [`mod@segment`] (section 5.2): appearances (eq. 13), prior (figure 4), labels of template and scan (eq. 11, 12, 14 by
//!   [`mod@tryon_geometry::mrf`]), number and kinds of garments, unseen parts.
//! - [`mod@multi`] (section 5.3): parts, rings, their fit (eq. 15 to 21), captured parts as cloth to wear.
//! - [`mod@undress`] (section 5.4): one shape from several scans, [`mod@align::shared_shape`], body under the cloth (eq. 22).
//! - [`mod@dress_body`] (eq. 23 to 25), out of the body by [`mod@retarget`], hidden layers by [`mod@layers`],
//!   [`mod@population`].
//! - [`mod@texture`]: charts, their image, its colours. [`mod@archive`]: files of a capture, resumed.
//! - [`mod@settings`]: a struct a stage.
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

pub mod align;
pub mod archive;
mod camera_gains;
mod capture;
mod capture_header;
mod captured_outfit;
mod cloud;
mod dense_equations;
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
pub mod settings;
#[cfg(test)]
mod test_scans;
#[cfg(test)]
mod tests;
pub mod texture;
pub mod topology;
pub mod turn;
mod undress;

pub use capture::{FrameCapture, FrameReport, OutfitCapture, OutfitCaptureConfig};
pub use captured_outfit::CapturedOutfit;
pub use dress_body::{BodyDresser, DressedPose};
pub use error::CaptureError;
pub use population::population;
pub use segmenter::{ScanSegmenter, SegmentedScan};
pub use undress::{Undressed, minimal_shape};
