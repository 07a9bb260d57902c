//! Settings of a tracker: one struct a stage, each field with its documentation and default side by side.

mod assess;
mod fit;
mod model;
mod recover;
mod registration;
mod segment;
mod shape;
mod start;
mod step;
mod tracker;

pub use assess::{
    AssessSettings, BeliefSettings, ClothesColorSettings, ConfidenceSettings, FacingSettings,
    SeatSettings, SightingSettings,
};
pub use fit::{
    FitSettings, HandAssignmentSettings, PredictionSettings, Schedule, SeenJointSettings,
    StandingSettings,
};
pub use model::{ModelSettings, StillCameraSettings};
pub use recover::{HiddenLimbSettings, RecoverSettings, RepairSettings};
pub use registration::{Association, FloorSettings, RegistrationSettings};
pub use segment::{
    ExpectedBodySettings, ExtremitySettings, HandSettings, PersonSettings, PlaneSettings,
    RefusalSettings, SegmentSettings,
};
pub use shape::{BodySizeSettings, ShapeSettings, SurfaceSettings};
pub use start::{HypothesisSettings, ProposalSettings, StartSettings};
pub use step::{ChangeSettings, StepSettings};
pub use tracker::TrackerConfig;

use tryon_geometry::settings;
