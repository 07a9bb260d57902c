//! Residuals of the pose, one a file: each visits its weighted least-squares terms, which the normal equations add up.

#[cfg(test)]
mod check;
pub(crate) mod clearance;
pub(crate) mod edge;
pub(crate) mod floor;
pub(crate) mod hand;
pub(crate) mod joint;
mod limb_motion;
pub(crate) mod prior;
pub(crate) mod surface;
mod term;

pub use clearance::ClearanceResidual;
pub use edge::EdgeResidual;
pub use floor::{FloorPlane, FloorResidual, FootChain, is_in_view};
pub use hand::HandResidual;
pub use joint::{JointResidual, JointTarget};
pub use limb_motion::LimbMotion;
pub use prior::RestPoseResidual;
pub use surface::{SurfaceMetric, SurfaceResidual};
pub use term::{PointTerm, Residual, RowTerm};
