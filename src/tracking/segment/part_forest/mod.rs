//! Body parts per cell from a randomised decision forest on depth differences (Shotton et al., "Real-Time Human Pose
//! Recognition in Parts from Single Depth Images", CVPR 2011), and joints from the modes of its classes (section 3.3). Its leaves
//! also vote for the yaw of the person.
//!
//! Classes are numbers here; `tracking` holds their meaning.

mod bytes;
mod class_map;
mod feature;
mod forest;
mod modes;
mod split;
mod train;
mod training_set;
mod tree;
mod yaw;

pub use crate::settings::ForestSpec;
pub use bytes::PartForestError;
pub use class_map::ClassMap;
pub use feature::PersonCells;
pub use forest::{PartForest, PartScratch};
pub use modes::JointProposal;
pub use train::train;
pub use training_set::{CellLabel, TrainingSet};
pub use yaw::{YAW_BINS, YawBelief};
