//! Frame to picture for one person: track, choose size, dress, simulate, composite; the one chain that command line and services share.
//!
//! [`Mirror`] is the whole chain in one thread. The services run its parts in separate processes:
//! [`Wear`] in cloth, [`PosedBody`] and [`CameraGarments`] in the compositor.
//!
//! ```
//! use tryon::body::embedded;
//! use tryon::mirror::{Choice, Mirror};
//! use tryon::formats::RgbdSource;
//! use tryon::synth::{Sequence, Setting, Actor, SynthSource};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scene = Sequence::new(Actor::default(), Setting::default());
//! let mut recording = SynthSource::new(scene, Some(2));
//! let choices = vec![Choice::library("tshirt", None)?];
//! let mut mirror = Mirror::new(embedded::template(), recording.calibration(), choices);
//! while let Some(frame) = recording.next_frame()? {
//!     let seen = mirror.step(&frame)?;
//!     assert!(seen.is_dressed, "from the first frame in which somebody is tracked");
//!     assert_eq!(seen.picture.width(), frame.depth.width());
//! }
//! # Ok(())
//! # }
//! ```

mod body;
pub(crate) mod captured;
mod chain;
pub(crate) mod choice;
pub(crate) mod clock;
mod drawn_look;
mod error;
mod offline_drape;
pub(crate) mod offline_outfit;
pub(crate) mod offline_run;
pub(crate) mod outfit;
mod painter;
pub(crate) mod picture;
mod report;
mod settings;
pub(crate) mod wear;
mod wear_watch;

pub use body::PosedBody;
pub use captured::CapturedWardrobe;
pub use chain::Mirror;
pub use choice::{Choice, SizedGarment};
pub use clock::{FrameClock, NOMINAL_INTERVAL, time_step};
pub use drawn_look::DrawnLook;
pub use error::MirrorError;
pub use offline_drape::{OfflineDrapeLevel, OfflineDrapeReport};
pub use offline_outfit::OfflineOutfit;
pub use offline_run::OfflineRun;
pub use outfit::{DressedOutfit, PutOn, Subject};
pub use painter::OutfitPainter;
pub use picture::{CameraGarments, DrawnBody, DrawnSurface, FollowedBody, library_appearance};
pub use report::MirrorFrame;
pub use settings::OutfitSettings;
pub use wear::{SizeState, Wear, WearStep};
