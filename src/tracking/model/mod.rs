//! Immutable parts of a tracker: settings, template with samples, limbs, trunk and classes, the rest body of a shape.

mod girth_gradients;
mod leg;
mod limb;
pub mod part_classes;
mod personal_body;
mod tracker;
mod trunk;

pub(crate) use leg::Leg;
pub(crate) use limb::Limb;
pub use part_classes::PartClasses;
pub(crate) use part_classes::{NECK_CLASS, PART_CLASSES, PartKind};
pub(crate) use personal_body::PersonalBody;
pub use tracker::TrackerModel;
