//! Parametric garments of the library.

mod catalogue;
pub(crate) mod cuts;
mod draft;
pub(crate) mod dress;
pub(crate) mod skirt;
pub(crate) mod top;
pub(crate) mod trims;
pub(crate) mod trousers;

pub use catalogue::{dye, names, pattern, pattern_with};
pub use cuts::{
    DressCut, HoodCut, LibraryCuts, SkirtCut, SleeveCut, StraightSkirtCut, TopCut, TrousersCut,
};
