//! Body-model aided segmentation (section 5.2): labels of the template, then of the scan, and the rings between them.

pub(crate) mod color_mixture;
mod islands;
pub(crate) mod labelling;
mod node_colors;
pub(crate) mod outfit;
pub(crate) mod prior;
pub(crate) mod scan_labels;
pub(crate) mod torso;
pub(crate) mod unseen;

pub use color_mixture::{ColorMixture, hsv_cone, k_means};
pub use labelling::{LabelConfig, Labelling, relabel_nodes};
pub use node_colors::NodeColors;
pub use outfit::label_nodes;
pub use prior::{BodyRegion, IMPOSSIBLE, Slot};
pub use scan_labels::ScanLabeller;
pub(super) use unseen::bone_slices;
pub use unseen::{seen_slices, unseen_regions};
