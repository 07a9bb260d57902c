//! Contact generation for worn garments: against the body, other layers and their own folds.

pub(super) mod anchor;
pub(super) mod body_contact;
pub(super) mod chunk;
pub(super) mod cloth_contact;
pub(super) mod layer_height;
pub mod self_contact;
pub(super) mod skin_projection;
