//! A garment onto a body: panel placement, sewing, size choice, first drape, fit map.

mod canonical;
mod dress;
mod measure;
mod place;
mod suggest;

pub use crate::cloth::realtime::{AnchorBinding, Outfit};
pub use dress::{DressError, DressOptions, DressReport, Dressed, dress};
pub use measure::measure;
pub use suggest::{Suggestion, suggest};
