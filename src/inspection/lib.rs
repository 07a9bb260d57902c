//! Inspection of a camera: measurements from its frames, and findings about its place in words for a shop.
//!
//! An [`Inspector`] takes frames and gives an [`InspectionReport`]; [`judge`] turns it into [`Finding`]s.
//!
//! # Ideas
//!
//! Camera and files:
//!
//! - Rate, jitter, lost frames, clock: [`mod@timing`].
//! - Pixels without depth: [`mod@holes`]; their colours, which tell sunlight from dark floors: [`mod@light`].
//! - Temporal noise against a sensor's model: [`mod@temporal_noise`].
//! - Nearest and farthest surface: [`mod@depth_range`].
//! - Height, tilt and roll from the floor: [`mod@placement`]; things in the way and the back of the room: [`mod@place`].
//! - Distances at which a whole person is in view: [`mod@person_fit`].
//! - Sentences and their limits: [`mod@findings`], [`mod@settings`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod depth_range;
mod finding;
mod findings;
mod holes;
mod inspector;
mod light;
mod person_fit;
mod place;
mod placement;
mod settings;
mod temporal_noise;
mod timing;

pub use depth_range::{DepthHistogram, DepthRange};
pub use finding::{Finding, Rating};
pub use findings::judge;
pub use holes::HoleShares;
pub use inspector::{InspectionReport, Inspector};
pub use light::HoleColors;
pub use person_fit::{FitRange, person_fit, tilt_for};
pub use place::{PlaceReport, inspect_place};
pub use placement::CameraPlacement;
pub use settings::{FindingLimits, InspectionSettings, PersonSize};
pub use temporal_noise::{NoiseEstimate, SensorModel, TemporalNoise};
pub use timing::{FrameTimes, TimingReport};
