//! The captured image and the garments in one picture: visibility, shading, edges.
//!
//! Two passes (Ye et al. 2014, section 5): the captured pixels at their depth, then the garments with a depth test.
//! The test is decided by area, not by pixel (`occluder`): sensor noise is as large as the gap between chest and shirt.
//! [`render`] runs the stages: captured picture, rasterisation, vertex shading, visibility, blending.

pub(crate) mod appearance;
pub(crate) mod area;
mod arm;
mod blend;
mod body_depth;
mod captured;
pub(crate) mod captured_depth;
pub(crate) mod composition;
mod config;
pub(crate) mod contact_shadow;
pub(crate) mod coverage;
mod evidence;
mod hand;
mod input;
mod limbs;
mod matte;
mod occluder;
mod render;
mod report;
pub(crate) mod shading;
mod skin;
mod state;
pub(crate) mod surface;
#[cfg(test)]
pub(crate) mod tests;
mod vertex_shading;
pub(crate) mod viewport;
mod workspace;

pub use appearance::{Appearance, Print};
pub use config::{Config, Framing, Lights, Margins, Model};
pub use input::{BodyView, GarmentView, Input, RenderError};
pub use limbs::Limbs;
pub use render::render;
pub use report::{HandReport, RenderReport};
pub use state::State;
pub use workspace::Workspace;
