//! A garment onto a body: panel placement, sewing, size choice, first drape, fit map.

mod canonical;
mod drape;
mod dress;
mod figure;
mod fit_map;
mod place;
mod refine;
mod suggest;
mod waistband;

pub use crate::cloth::realtime::{AnchorBinding, Outfit};
pub use dress::{DressError, DressOptions, DressReport, Dressed, dress};
pub use fit_map::{FIT_COLORS, FitMap, FitProbe, RegionFit, VertexFit};
pub use suggest::{Fit, Room, Suggestion, hem_height, judge, rooms, suggest};
