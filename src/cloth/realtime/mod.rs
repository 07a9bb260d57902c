//! The real-time simulator: Ye et al. 2014, section 4, "Near Realtime simulation", with today's solver.

mod carry;
mod cloth_touch;
mod finish;
mod model;
mod piece;
mod piled;
mod regions;
mod roomy;
mod state;
mod steady;
mod step;
mod still;
mod touch;
mod untangle;

pub use model::{AnchorBinding, Config, Model, Outfit};
pub use roomy::RoomyBody;
pub use state::{GarmentState, Input, State, StepReport, Workspace};
pub use step::step;
