//! The life of one try-on as a pure transition table: Opening → Calibrating → Live ⇄ Degraded(why) → Draining → Closed.
//!
//! ```text
//!               Opened                     GarmentsOn
//!   Opening ───────────────► Calibrating ────────────► Live
//!      │                      ▲   │   ▲                │  │
//!      │ Failed(service,      │   │   └─ OutfitChanged ┘  │
//!      │        camera)       │   │ Failed(why)           │ Failed(why)
//!      ▼                      │   ▼                       ▼
//!   Degraded(why) ────────────┴─ Degraded(why) ◄──────────┘
//!                  Opened, CameraBack, PersonFound: the event that answers `why`
//!                  GarmentsOn: straight to Live, for a fresh picture proves the whole chain
//!
//!   any of these ── Drain ──► Draining ── Drained ──► Closed          any ── Close ──► Closed
//! ```
//!
//! Services feed facts in and carry effects out; the table holds no clock and no handle. Faults are levels, not
//! edges: whoever sees one repeats it while it lasts, so that a fault hidden by a worse one comes up when that is gone.
//! Of two faults the one further upstream is told, for it explains the other.

mod ages;
mod table;

pub use ages::{Ages, Limits};
pub use table::transition;

use serde::{Deserialize, Serialize};

/// Where a try-on stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// The sessions behind it are being opened.
    #[default]
    Opening,
    /// The body is being found and fitted, or garments are being put on.
    Calibrating,
    /// Pictures show the garments on the frame that they were computed for.
    Live,
    /// Pictures, if any, are the plain camera picture.
    Degraded(Reason),
    /// Nothing new is accepted; streams end soon.
    Draining,
    /// Over. Nothing leads out of here.
    Closed,
}

/// Why a try-on is less than live, in the order of the chain: of two, the earlier is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// No frame has come for longer than [`Limits::camera_silence_ns`].
    CameraSilent,
    /// The tracking service does not answer.
    TrackingUnavailable,
    /// Nobody has been found yet.
    NoPerson,
    /// Somebody was tracked and left.
    PersonLeft,
    /// Somebody is there, but the tracker no longer explains what the camera sees.
    TrackingLost,
    /// The cloth service does not answer.
    ClothUnavailable,
    /// The garments are older than [`Limits::garments_age_ns`].
    GarmentsLate,
    /// A step refused its numbers; the last good state is kept.
    StepFailed,
}

impl Reason {
    /// All of them, in order.
    pub const ALL: [Self; 8] = [
        Self::CameraSilent,
        Self::TrackingUnavailable,
        Self::NoPerson,
        Self::PersonLeft,
        Self::TrackingLost,
        Self::ClothUnavailable,
        Self::GarmentsLate,
        Self::StepFailed,
    ];
    /// Which part of the chain says so.
    pub fn part(self) -> Part {
        match self {
            Self::CameraSilent => Part::Camera,
            Self::TrackingUnavailable | Self::NoPerson | Self::PersonLeft | Self::TrackingLost => {
                Part::Tracking
            }
            Self::ClothUnavailable | Self::GarmentsLate => Part::Cloth,
            Self::StepFailed => Part::Picture,
        }
    }
    /// A few words for a status line.
    pub fn words(self) -> &'static str {
        match self {
            Self::CameraSilent => "the camera sends no frames",
            Self::TrackingUnavailable => "the tracking service does not answer",
            Self::NoPerson => "nobody is in front of the camera",
            Self::PersonLeft => "the person has left the picture",
            Self::TrackingLost => "the body cannot be followed",
            Self::ClothUnavailable => "the cloth service does not answer",
            Self::GarmentsLate => "the garments lag behind the body",
            Self::StepFailed => "a step failed on this frame",
        }
    }
}

/// A part of the chain, upstream first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// The camera and its bus.
    Camera,
    /// The tracking service.
    Tracking,
    /// The cloth service.
    Cloth,
    /// Putting the picture together.
    Picture,
}

/// A fact about the chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// The sessions behind this one answer, for the first time or again.
    Opened,
    /// Frames come again.
    CameraBack,
    /// The tracker sees somebody: it fits the body, or follows it.
    PersonFound,
    /// Garments exist for a frame that is young enough.
    GarmentsOn,
    /// Another outfit was chosen, perhaps an empty one.
    OutfitChanged,
    /// Something is missing; repeated while it lasts.
    Failed(Reason),
    /// The service shuts down.
    Drain,
    /// The last picture is out, or the deadline for it has passed.
    Drained,
    /// The client is done, or gone for too long.
    Close,
}

impl Event {
    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        use Event::{
            CameraBack, Close, Drain, Drained, GarmentsOn, Opened, OutfitChanged, PersonFound,
        };
        [
            Opened,
            CameraBack,
            PersonFound,
            GarmentsOn,
            OutfitChanged,
            Drain,
            Drained,
            Close,
        ]
        .into_iter()
        .chain(Reason::ALL.map(Self::Failed))
    }
}

impl State {
    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        [
            Self::Opening,
            Self::Calibrating,
            Self::Live,
            Self::Draining,
            Self::Closed,
        ]
        .into_iter()
        .chain(Reason::ALL.map(Self::Degraded))
    }
    /// Garments may be shown; in every other state a picture is the plain camera picture.
    pub fn shows_garments(self) -> bool {
        self == Self::Live
    }
    /// Whether new work (outfits, streams) is accepted.
    pub fn accepts_work(self) -> bool {
        !matches!(self, Self::Draining | Self::Closed)
    }
    /// Why it is less than live, if something failed.
    pub fn reason(self) -> Option<Reason> {
        if let Self::Degraded(why) = self {
            Some(why)
        } else {
            None
        }
    }
}

/// What the service must do after a transition, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Effect {
    /// Tell every client of this try-on the new state; a status is never dropped.
    Announce(State),
    /// Open the session at this part of the chain again, with back-off.
    Reopen(Part),
    /// Send the chosen outfit to cloth.
    Dress,
    /// Drop garment states: they belong to a body or a moment that is gone.
    ForgetGarments,
    /// Close the sessions behind this one.
    CloseUpstream,
    /// End the client streams after the last status.
    EndStreams,
}
