//! Contact generation for worn garments: against the body, and of cloth with cloth.

pub(super) mod anchor;
pub(crate) mod body_contact;
pub(super) mod chunk;
pub(super) mod contact_topology;
pub(crate) mod near_candidates;
pub(crate) mod near_pairs;
mod outfit_vertices;
pub(crate) mod pair_contact;
mod pair_reach;
pub(super) mod skin_projection;
