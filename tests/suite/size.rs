//! Size of the body from one side, and from all of them.

use std::f64::consts::TAU;
use std::sync::Arc;
use tryon::body::embedded::{self, DIRECTIONS};
use tryon::body::measure::{Measurements, measure};
use tryon::body::{BodyShape, Template};
use tryon::geometry::camera::{NoiseModel, RgbdFrame};
use tryon::synth::{Actor, Posture, Routine, Sequence, Setting};
use tryon::tracking::{TrackerConfig, TrackerModel, TrackerState, Workspace, step};

/// Frames before the turn, and steps of it.
const STILL: u64 = 62;
const TURN: u64 = 40;

/// A body of some directions of shape.
fn body(directions: &[(&str, f64)]) -> BodyShape {
    let of = |name: &&str| {
        directions
            .iter()
            .find(|d| d.0 == *name)
            .map_or(0.0, |d| d.1)
    };
    BodyShape {
        coefficients: DIRECTIONS.iter().map(of).collect(),
        ..BodyShape::default()
    }
}

fn measures(template: &Template, shape: &BodyShape) -> Measurements {
    measure(template, &template.personalise(shape)).expect("a body")
}

/// Greatest error of three girths, millimetres.
fn girth_error(a: &Measurements, b: &Measurements) -> f64 {
    let girths = |m: &Measurements| [m.chest, m.natural_waist, m.hip];
    let pairs = girths(a).into_iter().zip(girths(b));
    pairs.map(|(a, b)| 1e3 * (a - b).abs()).fold(0.0, f64::max)
}

/// Measures of somebody who is found at `yaw`, and after a turn.
fn tracked(template: &Arc<Template>, shape: &BodyShape, yaw: f64) -> [Measurements; 2] {
    let at = |k: u64| Setting {
        turn: yaw + TAU * k as f64 / TURN as f64,
        room: Some(Default::default()),
        noise: NoiseModel::TimeOfFlight,
        routine: Routine::Hold(Posture::Standing),
        color: false,
        ..Setting::default()
    };
    let actor = Actor {
        shape: shape.clone(),
        ..Actor::default()
    };
    let sequence = |k| Sequence::new(actor.clone(), at(k));
    let first = sequence(0);
    let model = TrackerModel::new(
        template.clone(),
        first.calibration().clone(),
        TrackerConfig::default(),
    );
    let (mut state, mut workspace) = (TrackerState::new(&model), Workspace::default());
    let mut show = |state: &mut TrackerState, sequence: &Sequence, i: u64| {
        let frame = RgbdFrame {
            sequence: i,
            time_ns: i * 33_333_333,
            ..sequence.frame(i).0
        };
        step(&model, state, &frame, &mut workspace).expect("a step");
        assert!(state.status.is_live(), "frame {i}: {:?}", state.status);
    };
    for i in 0..STILL {
        show(&mut state, &first, i);
    }
    let before = measures(template, &state.shape);
    for k in 1..=TURN {
        show(&mut state, &sequence(k), STILL + k);
    }
    [before, measures(template, &state.shape)]
}

#[test]
fn a_turn_shows_the_girths_that_one_side_hides() {
    let template = embedded::template();
    let shape = body(&[("girth", 1.0), ("belly", 3.0), ("chest", -1.0)]);
    let truth = measures(&template, &shape);
    let sides = [0.0, 0.25 * TAU].map(|yaw| tracked(&template, &shape, yaw));
    let errors = sides.map(|views| views.map(|m| girth_error(&m, &truth)));
    let apart = [0, 1].map(|k| girth_error(&sides[0][k], &sides[1][k]));
    eprintln!("girths off by {errors:.0?} mm, two sides apart by {apart:.0?} mm, before and after");
    assert!(
        apart[1] < 20.0 && apart[1] < 0.7 * apart[0],
        "apart by {apart:.0?} mm"
    );
    assert!(errors.iter().all(|e| e[1] < 40.0), "{errors:.0?} mm");
}
