//! A garment onto a body: panel placement, sewing, size choice, first drape, fit map.
//!
//! Panels are sewn, mapped around the body in a canonical pose, and draped by the simulator while the body moves into the
//! tracked pose. The result is a model and a state for [`tryon_cloth::step`].
//!
//! ```
//! use tryon_body::measure::measure;
//! use tryon_body::{BodyShape, Pose, embedded};
//! use tryon_dressing::{DressOptions, dress, suggest};
//! use tryon_garment::library;
//! use tryon_geometry::math::Rigid;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let template = embedded::template();
//! let rest = template.personalise(&BodyShape::default());
//! let choice = suggest("tank", &measure(&template, &rest)?)?;
//! let pattern = library::pattern("tank", choice.size)?;
//! let pose = Pose::rest(template.skeleton(), Rigid::identity());
//! let dressed = dress(&template, &rest, &pose, &[pattern], &DressOptions::default())?;
//! assert_eq!(dressed.state.garments.len(), 1);
//! assert_eq!(dressed.report.crossings, 0);
//! # Ok(())
//! # }
//! ```
//!
//! # Ideas
//!
//! Settings of all stages, with units, defaults and effects: [`mod@settings`].
//!
//! - The order of it: [`mod@dress`].
//! - Size recommended, with its reason: [`mod@suggest`], from the measures in [`mod@finished`].
//! - Panels around trunk, legs, arms, head: [`mod@place::trunk`], [`mod@place::leg`], [`mod@place::sleeve`],
//!   [`mod@place::hood`]; skirts of any panels [`mod@place::hip_tube`], collars [`mod@place::collar`].
//! - Sewing: [`mod@sew`].
//! - First drape: [`mod@drape`].
//! - Stretch, pressure, gaps: [`mod@fit_map`].
//! - Meshes made on another body: [`mod@mesh_garment::classifier`], [`mod@retarget`], [`mod@source_body`].
//! - Their sizes: [`mod@mesh_garment::sizing`], [`mod@mesh_garment::grading`].
#![allow(rustdoc::private_intra_doc_links)] // the index of ideas names private modules

mod anchoring;
mod body_guess;
mod body_sections;
mod bone_map;
mod canonical;
mod crossing_finder;
mod drape;
mod dress;
mod error;
mod file_frame;
mod finished;
mod fit_map;
mod frame_search;
mod mesh_garment;
mod options;
mod place;
mod retarget;
mod rig_standing;
pub mod settings;
mod sew;
mod source_body;
mod suggest;
mod waistband;

pub use dress::{Dressed, dress, dress_all};
pub use error::{DressError, MeshGarmentError};
pub use finished::{FinishedGarment, HangsFrom, Hem};
pub use fit_map::{FIT_COLORS, FitMap, FitProbe, RegionFit, VertexFit};
pub use mesh_garment::{GarmentFile, MeshGarment};
pub use options::{DressMs, DressOptions, DressReport};
pub use rig_standing::rig_standing;
pub use settings::{FitMapSettings, MeshGarmentSettings, StageSettings, WornSizeSettings};
pub use sew::GarmentSource;
pub use source_body::SourceBody;
pub use suggest::{FitClass, GirthEase, Misfit, Suggestion, assess, check_wearable, suggest};
pub use tryon_cloth::{AnchorBinding, Outfit};
