//! A garment onto a body: panel placement, sewing, size choice, first drape, fit map.

mod canonical;
mod carry;
mod drape;
mod dress;
mod figure;
mod fit_map;
mod hood;
mod made_on;
mod mesh_wear;
mod place;
mod plane;
mod refine;
mod skin;
mod suggest;
mod waistband;

pub use crate::cloth::{AnchorBinding, Outfit};
pub use dress::{DressError, DressOptions, DressReport, Dressed, Wear, dress, dress_all};
pub use fit_map::{FIT_COLORS, FitMap, FitProbe, RegionFit, VertexFit};
pub use made_on::{MadeOn, WearError, rig_standing};
pub use mesh_wear::MeshWear;
pub use suggest::{Fit, Misfit, Room, Suggestion, hem_height, judge, rooms, suggest, wearable};
