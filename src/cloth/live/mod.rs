//! One step of garment motion against a moving body, `filter → collide → solve → commit → sleep`: `model/` (sheet, membrane, bending, partition), `solver/` (kernels of the substeps), `contact/`, `sleep/`, `repair/`.
//!
//! The real-time simulator follows Ye et al. 2014, section 4, "Near Realtime simulation".

pub(crate) mod collide;
mod collision;
pub(crate) mod commit;
pub(crate) mod contact;
mod error;
mod garment_model;
pub mod model;
mod outfit;
mod outfit_model;
mod patch;
pub(crate) mod repair;
mod report;
pub(crate) mod sleep;
pub(crate) mod solve;
pub mod solver;
mod state;
pub(crate) mod step;
#[cfg(test)]
mod test_outfit;
mod workspace;

pub use crate::settings::Config;
pub use collision::collision_model;
pub use error::ClothError;
pub use model::{BendingResolution, Element, Hinge, Sheet};
pub use outfit::{AnchorBinding, Outfit};
pub use outfit_model::Model;
pub(crate) use outfit_model::WornBody;
pub use repair::reference::WornReference;
pub use report::{StagesMs, StepReport};
pub use state::{GarmentState, State};
pub use step::{Input, step};
pub use workspace::Workspace;
