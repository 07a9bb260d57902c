//! Start positions of panels: each is mapped onto a surface around the canonical body, so that seams are closed.

mod hood;
mod leg;
mod outline;
mod panels;
mod placed_body;
mod skirt;
mod sleeve;
mod trunk;
mod tube;

pub(super) use panels::place;
