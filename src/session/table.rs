//! The table itself.

use super::{Effect, Event, Part, Reason, State};

/// The next state and what to do about it. Total: every pair has an answer, and what does not concern a state
/// leaves it alone without effects.
pub fn transition(state: State, event: Event) -> (State, Vec<Effect>) {
    use Effect::{Announce, CloseUpstream, Dress, EndStreams, ForgetGarments};
    use State::{Calibrating, Closed, Degraded, Draining, Live, Opening};
    let to = |next: State, effects: &[Effect]| {
        let announce = (next != state).then_some(Announce(next));
        (
            next,
            announce
                .into_iter()
                .chain(effects.iter().copied())
                .collect(),
        )
    };
    match (state, event) {
        (Closed, _) => to(Closed, &[]),
        (_, Event::Close) => to(Closed, &[CloseUpstream, EndStreams]),
        (Draining, Event::Drained) => to(Closed, &[CloseUpstream, EndStreams]),
        (Draining, _) => to(Draining, &[]),
        (_, Event::Drain) => to(Draining, &[]),
        (_, Event::Drained) => to(state, &[]),

        // A reopened session behind this one remembers nothing: dress again.
        (Opening, Event::Opened) => to(Calibrating, &[Dress]),
        (Degraded(why), Event::Opened) if is_service(why) => to(Calibrating, &[Dress]),
        (Degraded(Reason::CameraSilent), Event::CameraBack) => to(Calibrating, &[]),
        (Degraded(why), Event::PersonFound) if is_person(why) => to(Calibrating, &[]),
        (Calibrating | Degraded(_), Event::GarmentsOn) => to(Live, &[]),

        // Before opening there is nobody to send it to; `Opened` sends whatever is chosen by then.
        (Opening, Event::OutfitChanged) => to(Opening, &[]),
        (Live, Event::OutfitChanged) => to(Calibrating, &[Dress]),
        (_, Event::OutfitChanged) => to(state, &[Dress]),

        (_, Event::Failed(why)) => match after_fault(state, why) {
            next if next == state => to(state, &[]),
            next @ Degraded(why) => match why {
                Reason::TrackingUnavailable => {
                    to(next, &[ForgetGarments, Effect::Reopen(Part::Tracking)])
                }
                Reason::ClothUnavailable => {
                    to(next, &[ForgetGarments, Effect::Reopen(Part::Cloth)])
                }
                // One late or refused frame costs no state: the garments go on from where they are.
                Reason::GarmentsLate | Reason::StepFailed => to(next, &[]),
                _ => to(next, &[ForgetGarments]),
            },
            next => to(next, &[]),
        },
        (_, Event::Opened | Event::CameraBack | Event::PersonFound | Event::GarmentsOn) => {
            to(state, &[])
        }
    }
}

fn is_service(why: Reason) -> bool {
    matches!(why, Reason::TrackingUnavailable | Reason::ClothUnavailable)
}

fn is_person(why: Reason) -> bool {
    matches!(
        why,
        Reason::NoPerson | Reason::PersonLeft | Reason::TrackingLost
    )
}

/// Where a fault leads: upstream faults hide downstream ones, and a part corrects its own word.
fn after_fault(state: State, why: Reason) -> State {
    match state {
        // Nothing behind it has opened: only a missing camera or service can be true.
        State::Opening if why == Reason::CameraSilent || is_service(why) => State::Degraded(why),
        State::Opening | State::Draining | State::Closed => state,
        // Somebody was there a moment ago.
        State::Live if why == Reason::NoPerson => State::Degraded(Reason::PersonLeft),
        State::Calibrating | State::Live => State::Degraded(why),
        State::Degraded(Reason::PersonLeft) if why == Reason::NoPerson => state,
        State::Degraded(old) if why.part() <= old.part() => State::Degraded(why),
        State::Degraded(_) => state,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Event::{
        CameraBack, Close, Drain, Drained, Failed, GarmentsOn, Opened, OutfitChanged, PersonFound,
    };
    use Reason::{
        CameraSilent, ClothUnavailable, NoPerson, PersonLeft, StepFailed, TrackingLost,
        TrackingUnavailable,
    };
    use State::{Calibrating, Closed, Degraded, Draining, Live, Opening};

    /// The whole table as text, written independently of the code: one row a state, one column an event.
    /// `.` stays; letters are states; digits are `Degraded` in the order of [`Reason::ALL`].
    const EXPECTED: &[(&str, &str)] = &[
        // state, columns: Opened CameraBack PersonFound GarmentsOn OutfitChanged Drain Drained Close | 8 faults
        ("O", "C....D.X01...5.."),
        ("C", "...L.D.X01234567"),
        ("L", "....CD.X01334567"),
        ("D", "......XX........"),
        ("X", "................"),
        ("0", ".C.L.D.X........"),
        ("1", "C..L.D.X0.234..."),
        ("2", "..CL.D.X01.34..."),
        ("3", "..CL.D.X01..4..."),
        ("4", "..CL.D.X0123...."),
        ("5", "C..L.D.X01234.6."),
        ("6", "...L.D.X012345.."),
        ("7", "...L.D.X0123456."),
    ];

    fn letter(s: State) -> char {
        match s {
            Opening => 'O',
            Calibrating => 'C',
            Live => 'L',
            Draining => 'D',
            Closed => 'X',
            Degraded(why) => {
                let i = Reason::ALL.iter().position(|r| *r == why).expect("listed");
                char::from(b'0' + i as u8)
            }
        }
    }

    #[test]
    fn every_state_and_event_is_in_the_table() {
        let states: Vec<State> = State::all().collect();
        let events: Vec<Event> = Event::all().collect();
        assert_eq!((states.len(), events.len()), (13, 16));
        assert_eq!(EXPECTED.len(), states.len());
        for (state, (name, row)) in states.iter().zip(EXPECTED) {
            assert_eq!(name.chars().next(), Some(letter(*state)));
            for (event, want) in events.iter().zip(row.chars()) {
                let (next, _) = transition(*state, *event);
                let got = if next == *state { '.' } else { letter(next) };
                assert_eq!(got, want, "{state:?} × {event:?}");
            }
        }
    }

    #[test]
    fn effects_follow_from_the_move() {
        for state in State::all() {
            for event in Event::all() {
                let (next, effects) = transition(state, event);
                let announced = effects
                    .iter()
                    .filter(|e| matches!(e, Effect::Announce(_)))
                    .count();
                assert_eq!(
                    announced,
                    usize::from(next != state),
                    "{state:?} × {event:?}: a change is told once"
                );
                if next == Closed && state != Closed {
                    assert!(
                        effects.contains(&Effect::CloseUpstream)
                            && effects.contains(&Effect::EndStreams)
                    );
                }
                let reopens = effects.iter().any(|e| matches!(e, Effect::Reopen(_)));
                assert_eq!(
                    reopens,
                    next != state && next.reason().is_some_and(is_service),
                    "{state:?} × {event:?}"
                );
                if effects.contains(&Effect::Dress) {
                    assert!(state.accepts_work() && matches!(event, Opened | OutfitChanged));
                }
            }
        }
    }

    fn run(events: &[Event]) -> State {
        events
            .iter()
            .fold(State::default(), |s, e| transition(s, *e).0)
    }

    #[test]
    fn stories() {
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
            run(&[Opened, OutfitChanged, GarmentsOn, OutfitChanged]),
            Calibrating
        );
        assert_eq!(run(&[Opened, Drain, GarmentsOn, Opened]), Draining);
        assert_eq!(run(&[Opened, Drain, Drained]), Closed);
        assert_eq!(run(&[Close, Opened, GarmentsOn]), Closed);
    }
}
