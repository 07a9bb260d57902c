//! Contact generation for worn garments: against the body, other layers and their own folds.

pub(super) mod anchor;
pub(crate) mod body_contact;
pub(super) mod chunk;
pub(crate) mod cloth_contact;
pub(crate) mod layer_height;
pub mod self_contact;
pub(super) mod skin_projection;
