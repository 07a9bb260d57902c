//! The captured image and the garments in one picture: visibility, shading, edges.
//!
//! Two passes as in the paper's section 5: the captured pixels at their depth, then the garments with a depth test.
//! The test is done by area, not by pixel ([`occlusion`](self)): real depth is noisy, and a shirt hangs a centimetre
//! in front of the chest. [`render`] is the whole; [`Input`] says what it takes.

mod background;
#[cfg(test)]
pub(crate) mod fixture;
pub(crate) mod framing;
mod hand;
mod input;
mod limbs;
pub(crate) mod look;
mod occlusion;
pub(crate) mod render;
pub(crate) mod shade;
pub(crate) mod shadow;
mod skin;
pub(crate) mod surface;

pub use framing::Framing;
pub use hand::HandReport;
pub use input::{BodyView, Config, GarmentView, Input, Model, RenderError, RenderReport};
pub use limbs::Limbs;
pub use look::{Look, Print};
pub use occlusion::Margins;
pub use render::{Workspace, render};
pub use shade::Lights;
pub use skin::State;
