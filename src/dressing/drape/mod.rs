//! First drape of garments, by XPBD in small steps (Macklin et al. 2016, 2019) on a coarse mesh.
//!
//! Putting on is not dynamics: cloth starts centimetres from its rest and slides freely over the skin. Contact projects
//! vertices out of a plane each, so nothing sticks. A few steps on the fine mesh add the detail that the coarse one lacks.

mod contact;
mod context;
mod layers;
mod state;
pub(crate) mod step;
mod transfer;
mod untangle;

pub(super) use layers::Layers;
pub(super) use state::Drape;
