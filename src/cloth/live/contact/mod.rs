//! Contact generation for worn garments: against the body, and of cloth with cloth.

pub(super) mod anchor;
pub(crate) mod body_contact;
pub(super) mod chunk;
mod near_candidates;
mod near_pairs;
mod outfit_vertices;
pub(super) mod pair_contact;
pub mod self_contact;
pub(super) mod skin_projection;
