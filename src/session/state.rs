//! States, events and faults of a try-on.

use serde::{Deserialize, Serialize};

/// State of a try-on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// The upstream sessions are being opened.
    #[default]
    Opening,
    /// The body is being found and fitted, or garments are being put on.
    Calibrating,
    /// Pictures show the garments on the frame that they were computed for.
    Live,
    /// Pictures, if any, are the plain camera picture.
    Degraded(Fault),
    /// Nothing new is accepted; streams end soon.
    Draining,
    /// Final state.
    Closed,
}

impl State {
    /// True if pictures may show garments; in every other state a picture is the plain camera picture.
    pub fn shows_garments(self) -> bool {
        self == Self::Live
    }
    /// Fault of a degraded try-on.
    pub fn fault(self) -> Option<Fault> {
        if let Self::Degraded(fault) = self {
            Some(fault)
        } else {
            None
        }
    }
    /// True if garments received so far belong to a body or a moment that is gone.
    /// A late or refused frame costs no state: the garments go on from their last positions.
    pub fn invalidates_garments(self) -> bool {
        self.fault()
            .is_some_and(|f| !matches!(f, Fault::GarmentsLate | Fault::StepFailed))
    }
}

/// Cause of a degraded try-on, in the order of the chain: of two, the earlier is reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// No frame for longer than [`SilenceLimits::camera_silence_ns`](super::SilenceLimits::camera_silence_ns).
    CameraSilent,
    /// The tracking service does not answer.
    TrackingUnavailable,
    /// Nobody has been found yet.
    NoPerson,
    /// The tracked person left the picture.
    PersonLeft,
    /// A person is visible, but the tracker does not explain the frame.
    TrackingLost,
    /// The person sits: garments are draped on people who stand.
    PersonSits,
    /// The cloth service does not answer.
    ClothUnavailable,
    /// The garments are older than [`SilenceLimits::garments_age_ns`](super::SilenceLimits::garments_age_ns).
    GarmentsLate,
    /// A step refused its numbers; the last good state is kept.
    StepFailed,
}

impl Fault {
    /// All faults, in order.
    pub const ALL: [Self; 9] = [
        Self::CameraSilent,
        Self::TrackingUnavailable,
        Self::NoPerson,
        Self::PersonLeft,
        Self::TrackingLost,
        Self::PersonSits,
        Self::ClothUnavailable,
        Self::GarmentsLate,
        Self::StepFailed,
    ];
    /// Stage of the chain that reports it.
    pub fn stage(self) -> ChainStage {
        match self {
            Self::CameraSilent => ChainStage::Camera,
            Self::TrackingUnavailable
            | Self::NoPerson
            | Self::PersonLeft
            | Self::TrackingLost
            | Self::PersonSits => ChainStage::Tracking,
            Self::ClothUnavailable | Self::GarmentsLate => ChainStage::Cloth,
            Self::StepFailed => ChainStage::Picture,
        }
    }
    /// Short description for a status line.
    pub fn words(self) -> &'static str {
        match self {
            Self::CameraSilent => "the camera sends no frames",
            Self::TrackingUnavailable => "the tracking service does not answer",
            Self::NoPerson => "nobody is in front of the camera",
            Self::PersonLeft => "the person has left the picture",
            Self::TrackingLost => "the body cannot be followed",
            Self::PersonSits => "the person sits",
            Self::ClothUnavailable => "the cloth service does not answer",
            Self::GarmentsLate => "the garments lag behind the body",
            Self::StepFailed => "a step failed on this frame",
        }
    }
    /// True if a service does not answer.
    pub(super) fn is_service(self) -> bool {
        matches!(self, Self::TrackingUnavailable | Self::ClothUnavailable)
    }
    /// True if nobody is there to be dressed.
    pub(super) fn is_person(self) -> bool {
        matches!(
            self,
            Self::NoPerson | Self::PersonLeft | Self::TrackingLost | Self::PersonSits
        )
    }
}

/// Stage of the chain, upstream first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ChainStage {
    /// The camera and its bus.
    Camera,
    /// The tracking service.
    Tracking,
    /// The cloth service.
    Cloth,
    /// The compositor.
    Picture,
}

/// Fact about the chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// The upstream sessions answer, for the first time or again.
    Opened,
    /// Frames arrive again.
    CameraBack,
    /// The tracker fits or follows a person.
    PersonFound,
    /// Garments exist for a frame that is young enough.
    GarmentsOn,
    /// Garments are put on, or put on again: none can be shown.
    OutfitOff,
    /// A fault is present; repeated while it lasts.
    Failed(Fault),
    /// The service shuts down.
    Drain,
    /// The last picture is out, or the deadline for it has passed.
    Drained,
    /// The client ended the try-on, or has been absent for too long.
    Close,
}
