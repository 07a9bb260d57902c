//! Body parts per cell from a randomised decision forest on depth differences (Shotton et al., "Real-Time Human Pose
//! Recognition in Parts from Single Depth Images", CVPR 2011), and joints from the modes of its classes (section 3.3).
//!
//! Classes are numbers here; `tracking` holds their meaning.

mod bytes;
mod feature;
mod forest;
mod modes;
mod split;
mod train;
mod training_set;
mod tree;

pub use bytes::PartForestError;
pub use forest::{ClassMap, PartForest, PartScratch};
pub use modes::JointProposal;
pub use train::{ForestSpec, train};
pub use training_set::TrainingSet;
