//! Identity after a loss: the same person keeps the measured body, another one is measured anew.

use tryon::body::BodyShape;
use tryon::body::embedded::{self, DIRECTIONS};
use tryon::geometry::camera::{ColorImage, NoiseModel, RgbdFrame};
use tryon::synth::{Actor, Posture, Room, Routine, Sequence, Setting};
use tryon::tracking::{TrackerConfig, TrackerModel, TrackerState, Workspace, step};

/// Frames until the first person's size has settled, frames of the empty room, frames of who comes then.
const FRAMES: [u64; 3] = [64, 5, 24];

/// Somebody who stands in a room, or the room alone.
fn sequence(shape: &BodyShape, routine: Routine) -> Sequence {
    let actor = Actor {
        shape: shape.clone(),
        ..Actor::default()
    };
    let setting = Setting {
        room: Some(Room::default()),
        noise: NoiseModel::TimeOfFlight,
        routine,
        ..Setting::default()
    };
    Sequence::new(actor, setting)
}

/// Clothes of other colours: red and blue exchanged, and less light on them.
fn recolored(mut image: ColorImage) -> ColorImage {
    for rgb in image.data_mut().chunks_exact_mut(3) {
        rgb.swap(0, 2);
        rgb[0] /= 3;
    }
    image
}

/// Number of the subject and whether the size is the first person's, after another comes; `dress` changes the pictures of
/// who comes.
fn after_a_change(
    other: &BodyShape,
    dress: impl Fn(ColorImage) -> Option<ColorImage>,
) -> (u64, bool) {
    let first = BodyShape::default();
    let stand = Routine::Hold(Posture::Standing);
    let scenes = [
        sequence(&first, stand),
        sequence(&first, Routine::Empty),
        sequence(other, stand),
    ];
    let calibration = scenes[0].calibration().clone();
    let model = TrackerModel::new(embedded::template(), calibration, TrackerConfig::default());
    let (mut state, mut workspace) = (TrackerState::new(&model), Workspace::default());
    let mut measured = None;
    let mut number = 0;
    for (k, (scene, frames)) in scenes.iter().zip(FRAMES).enumerate() {
        for i in 0..frames {
            let frame = scene.frame(i).0;
            let color = match (k, frame.color) {
                (2, Some(image)) => dress(image),
                (_, color) => color,
            };
            let frame = RgbdFrame {
                sequence: number,
                time_ns: number * 33_333_333,
                color,
                ..frame
            };
            number += 1;
            step(&model, &mut state, &frame, &mut workspace).expect("a step");
        }
        assert_eq!(
            state.status.is_live(),
            k != 1,
            "scene {k}: {:?}",
            state.status
        );
        if k == 0 {
            measured = state.known_body(&model);
        }
    }
    let kept = measured.expect("settled").shape.coefficients;
    (state.subject, state.shape.coefficients == kept)
}

#[test]
fn who_comes_back_keeps_the_size() {
    let same = after_a_change(&BodyShape::default(), Some);
    assert_eq!(same, (1, true), "in colour");
    let same = after_a_change(&BodyShape::default(), |_| None);
    assert_eq!(same, (1, true), "in depth alone");
}

#[test]
fn a_stranger_of_the_same_size_is_known_by_the_clothes() {
    let stranger = after_a_change(&BodyShape::default(), |image| Some(recolored(image)));
    assert_eq!(stranger.0, 2);
}

#[test]
fn a_stranger_of_another_size_is_measured_anew_without_colour() {
    for (name, value) in [("girth", 2.0), ("stature", -1.5)] {
        let of = |d: &&str| if *d == name { value } else { 0.0 };
        let other = BodyShape {
            coefficients: DIRECTIONS.iter().map(of).collect(),
            ..BodyShape::default()
        };
        let stranger = after_a_change(&other, |_| None);
        assert_eq!(stranger.0, 2, "{name}");
    }
}
