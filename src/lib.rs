//! `tryon`: the mirror, from a frame to a picture for one person, and the library it stands on.
//!
//! Synchronous code without network, clock or global state; the services are thin shells around its `step`
//! functions. Each part is a crate of its own below `src/`, by layer; a crate depends on lower layers only.
//!
//! Start at [`mirror`], or at its steps: [`tracking`], [`cloth`] and [`view`].
//!
//! # Tracking
//!
//! ```
//! use tryon::body::embedded;
//! use tryon::synth::{Actor, Routine, Sequence, Setting};
//! use tryon::tracking::{TrackerConfig, TrackerModel, TrackerState, Workspace, step};
//!
//! // A synthetic subject before a depth camera; `formats::open_recording` reads recorded ones.
//! let setting = Setting { routine: Routine::Still, color: false, ..Setting::default() };
//! let sequence = Sequence::new(Actor::default(), setting);
//! let model = TrackerModel::new(
//!     embedded::template(),
//!     sequence.calibration().clone(),
//!     TrackerConfig { samples: 300, ..TrackerConfig::default() },
//! );
//! let (mut state, mut workspace) = (TrackerState::new(&model), Workspace::default());
//! for i in 0..2 {
//!     let (frame, _) = sequence.frame(i);
//!     let report = step(&model, &mut state, &frame, &mut workspace)?;
//!     assert!(report.status.is_live() && report.residual_mm < 10.0);
//! }
//! // Vertices of the tracked body, camera frame, metres, shape `[vertices]`.
//! let (vertices, _bones) = workspace.posed(&model, &state);
//! assert_eq!(vertices.len(), model.template().mesh().vertices().len());
//! # Ok::<(), tryon::tracking::StepError>(())
//! ```
//!
//! # Cloth
//!
//! ```
//! use tryon::body::{BodyShape, Pose, embedded};
//! use tryon::cloth::{Input, Workspace, step};
//! use tryon::dressing::{DressOptions, dress};
//! use tryon::garment::{Size, library};
//! use tryon::geometry::math::Rigid;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let template = embedded::template();
//! let rest = template.personalise(&BodyShape::default());
//! let pose = Pose::rest(template.skeleton(), Rigid::identity());
//! let pattern = library::pattern("tank", Size::M)?;
//! let mut dressed = dress(&template, &rest, &pose, &[pattern], &DressOptions::default())?;
//!
//! let body = &rest.vertices; // posed skin of each frame (m)
//! let mut workspace = Workspace::default();
//! let input = Input { body, dt: 1.0 / 30.0 };
//! let report = step(&dressed.model, &mut dressed.state, &input, &mut workspace)?;
//! assert!(report.kept_last_good.is_none());
//! # Ok(())
//! # }
//! ```
//!
//! # Ideas
//!
//! Cloth:
//!
//! - When it is put on again: [`mod@mirror::wear`].
//! - The way to the live pose: [`mod@mirror::outfit`].
//!
//! Offline cloth:
//!
//! - A dressed outfit on finer meshes, started by the preview: [`mod@mirror::offline_outfit`],
//!   `src/garment/subdivision.rs`.
//! - From a drape or a checkpoint through the motion of the body: [`mod@mirror::offline_run`].
//!
//! Garments from scans:
//!
//! - As garments: [`mod@mirror::captured`].
//! - Pictures of the stages: [`mod@mirror::picture`].
//!
//! Life of a try-on:
//!
//! - Transitions, precedence of faults: [`mod@session::table`].
//! - Silence of a stage: [`mod@session::ages`].
//! - Gaps in the capture clock: [`mod@mirror::clock`].
//! - Garments chosen and their sizes: [`mod@mirror::choice`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

pub use tryon_body as body;
pub use tryon_calibration as calibration;
pub use tryon_cloth as cloth;
pub use tryon_clothcap as clothcap;
pub use tryon_dressing as dressing;
pub use tryon_formats as formats;
pub use tryon_garment as garment;
pub use tryon_geometry as geometry;
pub use tryon_inspection as inspection;
pub use tryon_landmarks as landmarks;
pub use tryon_synth as synth;
pub use tryon_tracking as tracking;
pub use tryon_view as view;

pub mod mirror;
pub mod session;
