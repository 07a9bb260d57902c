//! Who sits is said to sit and isn't dressed; who stands up is.

use tryon::mirror::{Choice, Mirror};
use tryon::synth::{Actor, Posture, Routine, Sequence, Setting};
use tryon::tracking::Status;

/// Somebody in the middle of a room.
fn sequence(routine: Routine) -> Sequence {
    let setting = Setting {
        routine,
        color: false,
        ..Setting::default()
    };
    Sequence::new(Actor::default(), setting)
}

#[test]
fn who_sits_is_not_dressed_until_standing() {
    let seated = sequence(Routine::Hold(Posture::Sitting));
    let standing = sequence(Routine::Still);
    let choices = vec![Choice::library("tshirt", None).expect("a garment")];
    let template = seated.actor().template.clone();
    let mut mirror = Mirror::new(template, seated.calibration(), choices);

    for i in 0..40 {
        let seen = mirror.step(&seated.frame(i).0).expect("a step");
        assert!(!seen.is_dressed, "frame {i}");
        let is_said = seen.tracking.status == Status::Sitting;
        assert!(is_said || i < 10, "frame {i}: {:?}", seen.tracking.status);
    }
    let mut standing = (40..100).map(|i| mirror.step(&standing.frame(i).0).expect("a step"));
    assert!(standing.any(|seen| seen.is_dressed));
}
