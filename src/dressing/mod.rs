//! A garment onto a body: panel placement, sewing, size choice, first drape, fit map.

mod canonical;
mod drape;
mod dress;
mod figure;
mod place;
mod refine;
mod suggest;

pub use crate::cloth::realtime::{AnchorBinding, Outfit};
pub use dress::{DressError, DressOptions, DressReport, Dressed, dress};
pub use suggest::{Fit, Room, Suggestion, hem_height, judge, rooms, suggest};
