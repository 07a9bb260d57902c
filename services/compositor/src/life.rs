//! State of a try-on in the terms of the wire.

use tryon::session::{Reason, State};
use tryon_proto::v1::{DegradedReason, TryOnState};

pub(crate) fn state(s: State) -> TryOnState {
    match s {
        State::Opening => TryOnState::Opening,
        State::Calibrating => TryOnState::Calibrating,
        State::Live => TryOnState::Live,
        State::Degraded(_) => TryOnState::Degraded,
        State::Draining => TryOnState::Draining,
        State::Closed => TryOnState::Closed,
    }
}

pub(crate) fn reason(s: State) -> DegradedReason {
    s.reason().map_or(DegradedReason::Unspecified, |r| match r {
        Reason::CameraSilent => DegradedReason::CameraSilent,
        Reason::TrackingUnavailable => DegradedReason::TrackingUnavailable,
        Reason::NoPerson => DegradedReason::NoPerson,
        Reason::PersonLeft => DegradedReason::PersonLeft,
        Reason::TrackingLost => DegradedReason::TrackingLost,
        Reason::ClothUnavailable => DegradedReason::ClothUnavailable,
        Reason::GarmentsLate => DegradedReason::GarmentsLate,
        Reason::StepFailed => DegradedReason::StepFailed,
    })
}

pub(crate) fn from_wire(r: DegradedReason) -> Option<Reason> {
    Some(match r {
        DegradedReason::Unspecified => return None,
        DegradedReason::CameraSilent => Reason::CameraSilent,
        DegradedReason::TrackingUnavailable => Reason::TrackingUnavailable,
        DegradedReason::NoPerson => Reason::NoPerson,
        DegradedReason::PersonLeft => Reason::PersonLeft,
        DegradedReason::TrackingLost => Reason::TrackingLost,
        DegradedReason::ClothUnavailable => Reason::ClothUnavailable,
        DegradedReason::GarmentsLate => Reason::GarmentsLate,
        DegradedReason::StepFailed => Reason::StepFailed,
    })
}

/// Service at fault; empty when none is.
pub(crate) fn service(s: State) -> &'static str {
    match s.reason() {
        Some(Reason::CameraSilent) => "capture",
        Some(Reason::TrackingUnavailable) => "tracking",
        Some(Reason::ClothUnavailable | Reason::GarmentsLate) => "cloth",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_survive_the_wire() {
        for r in Reason::ALL {
            assert_eq!(from_wire(reason(State::Degraded(r))), Some(r));
        }
        assert_eq!(from_wire(DegradedReason::Unspecified), None);
    }
}
