//! State of a try-on in the terms of the wire.

use tryon::session::{Fault, State};
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
    s.fault().map_or(DegradedReason::Unspecified, |f| match f {
        Fault::CameraSilent => DegradedReason::CameraSilent,
        Fault::TrackingUnavailable => DegradedReason::TrackingUnavailable,
        Fault::NoPerson => DegradedReason::NoPerson,
        Fault::PersonLeft => DegradedReason::PersonLeft,
        Fault::TrackingLost => DegradedReason::TrackingLost,
        Fault::PersonSits => DegradedReason::PersonSits,
        Fault::ClothUnavailable => DegradedReason::ClothUnavailable,
        Fault::GarmentsLate => DegradedReason::GarmentsLate,
        Fault::StepFailed => DegradedReason::StepFailed,
    })
}

/// Fault of a session; `None` for reasons of single pictures.
pub(crate) fn from_wire(r: DegradedReason) -> Option<Fault> {
    Some(match r {
        DegradedReason::Unspecified | DegradedReason::GarmentOffPerson => return None,
        DegradedReason::CameraSilent => Fault::CameraSilent,
        DegradedReason::TrackingUnavailable => Fault::TrackingUnavailable,
        DegradedReason::NoPerson => Fault::NoPerson,
        DegradedReason::PersonLeft => Fault::PersonLeft,
        DegradedReason::TrackingLost => Fault::TrackingLost,
        DegradedReason::PersonSits => Fault::PersonSits,
        DegradedReason::ClothUnavailable => Fault::ClothUnavailable,
        DegradedReason::GarmentsLate => Fault::GarmentsLate,
        DegradedReason::StepFailed => Fault::StepFailed,
    })
}

/// Service at fault; empty when none is.
pub(crate) fn service(s: State) -> &'static str {
    match s.fault() {
        Some(Fault::CameraSilent) => "capture",
        Some(Fault::TrackingUnavailable) => "tracking",
        Some(Fault::ClothUnavailable | Fault::GarmentsLate) => "cloth",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_survive_the_wire() {
        for r in Fault::ALL {
            assert_eq!(from_wire(reason(State::Degraded(r))), Some(r));
        }
        assert_eq!(from_wire(DegradedReason::Unspecified), None);
        assert_eq!(from_wire(DegradedReason::GarmentOffPerson), None);
    }
}
