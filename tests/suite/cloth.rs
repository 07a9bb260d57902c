//! The real-time cloth solver on a dressed body: what it must survive, and that threads change nothing.

use std::sync::OnceLock;
use tryon::body::{BodyShape, BoneTransforms, Pose, RestBody, skin};
use tryon::cloth::realtime::{Config, Input, Model, State, StepReport, Workspace, step};
use tryon::dressing::{DressOptions, dress};
use tryon::garment::{Size, Triangulation, library};
use tryon::math::{Body, P3, Rigid, V3, World};
use tryon::par::{Par, with_threads};

const DT: f64 = 1.0 / 30.0;

struct Dressed {
    model: Model,
    state: State,
    body: Vec<P3>,
}

/// A shirt over a skirt at edges of 35 mm, on the embedded body with its arms a little down.
fn dressed(config: &Config) -> Dressed {
    static REST: OnceLock<RestBody> = OnceLock::new();
    let template = tryon::body::embedded::template();
    let rest = REST.get_or_init(|| template.personalise(&BodyShape::default()));
    let pose = Pose::rest(template.skeleton(), Rigid::<World, Body>::identity());
    let patterns = ["skirt", "tshirt"].map(|n| library::pattern(n, Size::M).expect("a pattern"));
    let options =
        DressOptions { triangulation: Triangulation { edge_length: 0.035, min_angle: 8.0 }, config: config.clone() };
    let d = dress(&template, rest, &pose, &patterns, &options).expect("dressed");
    let mut bones = BoneTransforms::default();
    pose.bones(template.skeleton(), rest, &mut bones);
    let mut body = Vec::new();
    skin(Par::Seq, &rest.vertices, template.weights(), &bones, &mut body);
    Dressed { model: d.model, state: d.state, body }
}

fn moved(body: &[P3], by: V3) -> Vec<P3> {
    body.iter().map(|p| p + by).collect()
}

fn sane(state: &State, body: &[P3]) {
    let centre = body.iter().fold(V3::zeros(), |s, p| s + p.coords) / body.len() as f32;
    for g in &state.garments {
        for (i, p) in g.positions.iter().enumerate() {
            assert!((p.coords - centre).norm() < 2.0, "vertex {i} of cloth is at {p}");
        }
    }
}

#[test]
fn threads_and_restoring_change_no_bit() {
    let d = dressed(&Config { sleep: false, ..Config::default() });
    let run = |threads: usize, cut: bool| {
        with_threads(threads, || {
            let (mut state, mut work) = (d.state.clone(), Workspace::default());
            for i in 0..6 {
                if cut && i == 3 {
                    state = state.clone();
                    work = Workspace::default();
                }
                let body = moved(&d.body, V3::new(0.02 * i as f32, 0.0, 0.01));
                step(&d.model, &mut state, &Input { body: &body, dt: DT }, &mut work).expect("a step");
            }
            state
        })
        .expect("threads")
    };
    let one = run(1, false);
    assert!(one == run(2, false), "two threads");
    assert!(one == run(1, true), "restored");
}

#[test]
fn a_jump_of_thirty_centimetres_leaves_no_vertex_under_the_skin() {
    let d = dressed(&Config::default());
    let (mut state, mut work) = (d.state.clone(), Workspace::default());
    let body = moved(&d.body, V3::new(0.3, 0.0, 0.0));
    let mut last = StepReport::default();
    for i in 0..20 {
        last = step(&d.model, &mut state, &Input { body: &body, dt: DT }, &mut work).expect("a step");
        assert_eq!(last.teleported, i == 0);
    }
    sane(&state, &body);
    assert!(last.penetration_left < 4e-3, "{}", last.penetration_left);
}

#[test]
fn a_body_at_three_metres_a_second_keeps_its_clothes() {
    let d = dressed(&Config::default());
    let (mut state, mut work) = (d.state.clone(), Workspace::default());
    let mut worst: f64 = 0.0;
    let mut body = d.body.clone();
    for i in 0..60 {
        // Back and forth, 0.3 m each way: 3 m/s in the middle.
        let s = 0.3 * (10.0 * f64::from(i) * DT).sin() as f32;
        body = moved(&d.body, V3::new(s, 0.0, 0.0));
        let r = step(&d.model, &mut state, &Input { body: &body, dt: DT }, &mut work).expect("a step");
        worst = worst.max(r.penetration_left);
        assert!(r.kept_last_good.is_none());
    }
    sane(&state, &body);
    assert!(worst < 4e-3, "{worst}");
}

#[test]
fn what_is_not_a_number_is_refused_and_nothing_moves() {
    let d = dressed(&Config::default());
    let (mut state, mut work) = (d.state.clone(), Workspace::default());
    let mut body = d.body.clone();
    body[7].y = f32::NAN;
    let e = step(&d.model, &mut state, &Input { body: &body, dt: DT }, &mut work).expect_err("NaN");
    assert!(e.to_string().contains('7'), "{e}");
    assert!(step(&d.model, &mut state, &Input { body: &d.body, dt: 0.0 }, &mut work).is_err());
    assert!(step(&d.model, &mut state, &Input { body: &d.body[1..], dt: DT }, &mut work).is_err());
    assert!(state == d.state);
}
