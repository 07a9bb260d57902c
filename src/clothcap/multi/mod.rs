//! Multi-cloth alignment (section 5.3): the template cut into parts, each fitted to its own part of the scan.

mod part;
mod part_fit;
mod trim;

pub use part::{ClothPart, MultiCloth, Ring};
pub use part_fit::{PartFit, PartFitConfig, PartFitReport, PartScan};
