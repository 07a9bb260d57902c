//! Start positions of panels: each is mapped onto a surface around the canonical body, so that seams are closed.

pub(crate) mod collar;
pub(crate) mod hip_tube;
pub(crate) mod hood;
pub(crate) mod leg;
mod outline;
mod panels;
mod placed_body;
mod rim_distance;
mod skirt;
pub(crate) mod sleeve;
pub(crate) mod trunk;
mod tube;

pub(super) use panels::place;
pub(super) use placed_body::PlacedBody;
