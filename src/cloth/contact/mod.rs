//! Contact generation for worn garments: against the body, and of cloth with cloth.

pub(super) mod anchor;
pub(super) mod body_contact;
pub(super) mod chunk;
mod near_pairs;
pub(super) mod pair_contact;
pub(crate) mod self_contact;
pub(super) mod skin_projection;
