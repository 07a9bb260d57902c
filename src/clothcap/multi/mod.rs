//! Multi-cloth alignment (section 5.3): the template cut into parts, each fitted to its own part of the scan.

pub(crate) mod part;
pub(crate) mod part_fit;
pub(crate) mod trim;

pub use crate::settings::PartFitConfig;
pub use part::{ClothPart, MultiCloth, Ring};
pub use part_fit::{LabelledScan, PartFit, PartFitReport, PartScan};
pub(super) use trim::grow;
