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

pub use assess::{AssessSettings, BeliefSettings, ConfidenceSettings, SeatSettings};
pub use fit::{
    FitSettings, HandAssignmentSettings, PredictionSettings, Schedule, StandingSettings,
};
pub use model::ModelSettings;
pub use recover::{HiddenLimbSettings, RecoverSettings, RepairSettings};
pub use registration::{Association, FloorSettings, RegistrationSettings};
pub use segment::{
    ExpectedBodySettings, ExtremitySettings, HandSettings, PersonSettings, PlaneSettings,
    RefusalSettings, SegmentSettings,
};
pub use shape::{ShapeSettings, SizeSettings, SurfaceSettings};
pub use start::{HypothesisSettings, ProposalSettings, StartSettings};
pub use step::{ChangeSettings, StepSettings};
pub use tracker::TrackerConfig;

/// Defines settings structs whose fields carry their documentation and default.
macro_rules! settings {
    ($($(#[$doc:meta])* pub struct $name:ident {
        $($(#[$field_doc:meta])* pub $field:ident: $type:ty = $default:expr,)*
    })*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }
    )*};
}
use settings;
