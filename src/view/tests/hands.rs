//! Bare hands in front of loose garments.

use super::fixture::{RED, SKIN, Scenery};
use crate::limbs::Limbs;
use crate::{BodyView, HandReport, Input, Model, RenderReport, State, Workspace, render};
use tryon_geometry::camera::ColorImage;

/// The picture with the limbs of `s`, others, or no body at all.
fn draw_with(s: &Scenery, state: &mut State, limbs: Option<&Limbs>) -> (ColorImage, RenderReport) {
    let garments = [s.garment()];
    let body = limbs.map(|limbs| BodyView {
        limbs,
        ..s.body_view()
    });
    let input = Input {
        body,
        ..s.input(&garments, None)
    };
    // The light of the room would change with what is seen of the body.
    let mut model = Model::default();
    model.config.room_light.interval = f64::INFINITY;
    render(&model, state, &input, &mut Workspace::default()).expect("drawn")
}

#[test]
fn a_bare_hand_on_the_hip_hides_a_loose_shirt() {
    for (own, light) in [
        (RED, 1.0),
        (RED, 0.3),
        ([40, 60, 120], 1.0),
        ([200, 200, 205], 0.5),
        ([25, 25, 27], 1.0),
    ] {
        let s = Scenery::resting(5, own, SKIN, light);
        let (image, report) = draw_with(&s, &mut State::default(), Some(&s.limbs));
        let [arm, shirt] = s.mistakes(&image, 2);
        assert!(
            report.hands.known && report.hands.pixels > 800,
            "{own:?} {light}: {report:?}"
        );
        assert!(
            arm < 0.02 && shirt < 0.002,
            "{own:?} {light}: arm {arm}, shirt {shirt}"
        );
        // Without the body's parts it is painted over, or this proves nothing.
        let none = Limbs::default();
        let (image, report) = draw_with(&s, &mut State::default(), Some(&none));
        assert!(s.mistakes(&image, 2)[0] > 0.5 && report.hands == HandReport::default());
    }
}

#[test]
fn inseparable_colours_leave_the_decision_to_depth() {
    let cases = [
        ("own sleeve", RED, RED),
        ("other sleeve", RED, [60, 70, 120]),
        ("skin-coloured", SKIN, SKIN),
    ];
    for (name, own, sleeve) in cases {
        let s = Scenery::resting(6, own, sleeve, 1.0);
        let (image, report) = draw_with(&s, &mut State::default(), Some(&s.limbs));
        assert!(
            !report.hands.known && report.hands.tested == 1,
            "{name}: {report:?}"
        );
        let none = Limbs::default();
        let before = draw_with(&s, &mut State::default(), Some(&none));
        assert!(image == before.0, "{name}");
    }
}

#[test]
fn without_colour_body_or_finite_vertices_no_arm_is_tested() {
    let mut s = Scenery::resting(7, RED, SKIN, 1.0);
    let mut state = State::default();
    draw_with(&s, &mut state, Some(&s.limbs));
    assert_ne!(state, State::default());
    let (_, report) = draw_with(&s, &mut state, None);
    let mut fresh = State::default();
    draw_with(&s, &mut fresh, None);
    // The scene, and where somebody stood in it, are nobody's colours.
    fresh.focus = state.focus;
    fresh.plate = state.plate.clone();
    assert_eq!((report.hands, state), (HandReport::default(), fresh));
    let first = s.limbs.arms[0].hand[0] as usize;
    s.body.vertices[first].x = f32::NAN;
    let (_, report) = draw_with(&s, &mut State::default(), Some(&s.limbs));
    assert_eq!((report.hands.tested, report.hands.skipped), (0, 2));
    s.frame.color = None;
    let (_, report) = draw_with(&s, &mut State::default(), Some(&s.limbs));
    assert_eq!(report.hands, HandReport::default());
}

#[test]
fn decisions_are_stable_under_sensor_noise() {
    let mut state = State::default();
    let mut last: Option<Vec<bool>> = None;
    for seed in 20..26 {
        let s = Scenery::resting(seed, RED, SKIN, 1.0);
        let (image, report) = draw_with(&s, &mut state, Some(&s.limbs));
        assert!(report.hands.known);
        let captured = s.frame.color.as_ref().expect("colour");
        let open: Vec<bool> = image
            .data()
            .chunks(3)
            .zip(captured.data().chunks(3))
            .map(|(a, b)| a == b)
            .collect();
        let arm: Vec<usize> = (0..open.len())
            .filter(|&i| s.arm[i] && s.shirt_visible[i])
            .collect();
        if let Some(last) = last.replace(open.clone()) {
            let flips = arm.iter().filter(|&&i| last[i] != open[i]).count();
            assert!(flips * 20 < arm.len(), "{flips} of {}", arm.len());
        }
    }
}
