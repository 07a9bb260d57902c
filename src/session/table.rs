//! The transition table.

use super::{Event, Fault, State};

/// Next state. Total: every pair has an answer, and an event that does not concern a state leaves it unchanged.
pub fn transition(state: State, event: Event) -> State {
    use State::{Calibrating, Closed, Degraded, Draining, Live, Opening};
    match (state, event) {
        (Closed, _) | (_, Event::Close) | (Draining, Event::Drained) => Closed,
        (Draining, _) | (_, Event::Drain) => Draining,

        (Opening, Event::Opened) | (Live, Event::OutfitOff) => Calibrating,
        (Degraded(fault), Event::Opened) if fault.is_service() => Calibrating,
        (Degraded(Fault::CameraSilent), Event::CameraBack) => Calibrating,
        (Degraded(fault), Event::PersonFound) if fault.is_person() => Calibrating,
        (Calibrating | Degraded(_), Event::GarmentsOn) => Live,

        (_, Event::Failed(fault)) => after_fault(state, fault),
        _ => state,
    }
}

/// Next state on a fault: upstream faults hide downstream ones, and a stage replaces its own fault.
fn after_fault(state: State, fault: Fault) -> State {
    match state {
        // Nothing upstream has opened: only a missing camera or service can be true.
        State::Opening if fault == Fault::CameraSilent || fault.is_service() => {
            State::Degraded(fault)
        }
        State::Opening | State::Draining | State::Closed => state,
        // Live implies that a person was tracked.
        State::Live if fault == Fault::NoPerson => State::Degraded(Fault::PersonLeft),
        State::Calibrating | State::Live => State::Degraded(fault),
        State::Degraded(Fault::PersonLeft) if fault == Fault::NoPerson => state,
        State::Degraded(old) if fault.stage() <= old.stage() => State::Degraded(fault),
        State::Degraded(_) => state,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Event::{
        CameraBack, Close, Drain, Drained, Failed, GarmentsOn, Opened, OutfitOff, PersonFound,
    };
    use Fault::{
        CameraSilent, ClothUnavailable, NoPerson, PersonLeft, StepFailed, TrackingLost,
        TrackingUnavailable,
    };
    use State::{Calibrating, Closed, Degraded, Draining, Live, Opening};

    /// The whole table as text, written independently of the code: one row a state, one column an event.
    /// `.` stays; letters are states; digits are `Degraded` in the order of [`Fault::ALL`].
    const EXPECTED: &[(&str, &str)] = &[
        // state, columns: Opened CameraBack PersonFound GarmentsOn OutfitOff Drain Drained Close | 9 faults
        ("O", "C....D.X01....6.."),
        ("C", "...L.D.X012345678"),
        ("L", "....CD.X013345678"),
        ("D", "......XX........."),
        ("X", "................."),
        ("0", ".C.L.D.X........."),
        ("1", "C..L.D.X0.2345..."),
        ("2", "..CL.D.X01.345..."),
        ("3", "..CL.D.X01..45..."),
        ("4", "..CL.D.X0123.5..."),
        ("5", "..CL.D.X01234...."),
        ("6", "C..L.D.X012345.7."),
        ("7", "...L.D.X0123456.."),
        ("8", "...L.D.X01234567."),
    ];

    fn letter(s: State) -> char {
        match s {
            Opening => 'O',
            Calibrating => 'C',
            Live => 'L',
            Draining => 'D',
            Closed => 'X',
            Degraded(fault) => {
                let i = Fault::ALL.iter().position(|f| *f == fault).expect("listed");
                char::from(b'0' + i as u8)
            }
        }
    }

    #[test]
    fn every_pair_matches_the_written_table() {
        let states = [Opening, Calibrating, Live, Draining, Closed]
            .into_iter()
            .chain(Fault::ALL.map(Degraded));
        let states: Vec<State> = states.collect();
        let events = [
            Opened,
            CameraBack,
            PersonFound,
            GarmentsOn,
            OutfitOff,
            Drain,
            Drained,
            Close,
        ];
        let events: Vec<Event> = events.into_iter().chain(Fault::ALL.map(Failed)).collect();
        assert_eq!((states.len(), events.len()), (14, 17));
        assert_eq!(EXPECTED.len(), states.len());
        for (state, (name, row)) in states.iter().zip(EXPECTED) {
            assert_eq!(name.chars().next(), Some(letter(*state)));
            for (event, want) in events.iter().zip(row.chars()) {
                let next = transition(*state, *event);
                let got = if next == *state { '.' } else { letter(next) };
                assert_eq!(got, want, "{state:?} × {event:?}");
            }
        }
    }

    #[test]
    fn garments_survive_a_late_or_refused_frame_only() {
        let kept = |s: State| !s.invalidates_garments();
        assert!(kept(Live) && kept(Calibrating));
        let lost = Fault::ALL.into_iter().filter(|f| !kept(Degraded(*f)));
        assert!(lost.eq(Fault::ALL[..7].iter().copied()));
    }

    fn run(events: &[Event]) -> State {
        events
            .iter()
            .fold(State::default(), |s, e| transition(s, *e))
    }

    #[test]
    fn event_sequences_end_in_the_expected_state() {
        assert_eq!(run(&[Opened, PersonFound, GarmentsOn]), Live);
        let left = [Opened, GarmentsOn, Failed(NoPerson), Failed(NoPerson)];
        assert_eq!(run(&left), Degraded(PersonLeft));
        assert_eq!(run(&[&left[..], &[PersonFound, GarmentsOn]].concat()), Live);
        // Tracking dies, its sessions come back empty, and nobody is there any more.
        let died = [
            Opened,
            GarmentsOn,
            Failed(TrackingUnavailable),
            Failed(ClothUnavailable),
        ];
        assert_eq!(run(&died), Degraded(TrackingUnavailable));
        assert_eq!(
            run(&[&died[..], &[Opened, Failed(NoPerson)]].concat()),
            Degraded(NoPerson)
        );
        // A silent camera explains everything after it.
        let silent = [
            Opened,
            GarmentsOn,
            Failed(TrackingLost),
            Failed(CameraSilent),
            Failed(StepFailed),
        ];
        assert_eq!(run(&silent), Degraded(CameraSilent));
        assert_eq!(run(&[&silent[..], &[CameraBack]].concat()), Calibrating);
        assert_eq!(
            run(&[Opened, OutfitOff, GarmentsOn, OutfitOff]),
            Calibrating
        );
        assert_eq!(run(&[Opened, Drain, GarmentsOn, Opened]), Draining);
        assert_eq!(run(&[Opened, Drain, Drained]), Closed);
        assert_eq!(run(&[Close, Opened, GarmentsOn]), Closed);
    }
}
