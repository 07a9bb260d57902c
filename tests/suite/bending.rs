//! Worn cloth where the body folds: the insides of elbows and knees, and the groin.

use super::common::{arms_down, posed};
use crate::common::{DT, step_on};
use tryon::body::{BodyShape, Pose, RestBody, Template, embedded};
use tryon::cloth::{StepReport, Workspace};
use tryon::dressing::{DressOptions, dress};
use tryon::garment::{Size, Triangulation, library};
use tryon::geometry::math::{P3, World};
use tryon::geometry::spatial::intersections;
use tryon_bench::Solid;

/// Bending and straightening again takes so many calls, two seconds, and the person stands for so many more.
const CALLS: usize = 60;
const STANDING: usize = 30;

/// Arms down, and in the middle of the time each joint turned by so much, rad.
fn pose(template: &Template, rest: &RestBody, joints: &[(&str, f64)], call: usize) -> Pose<World> {
    let mut pose = arms_down(template, rest);
    for side in ["left", "right"] {
        for (joint, most) in joints {
            let bent =
                most * (0.5 - 0.5 * (std::f64::consts::TAU * call as f64 / CALLS as f64).cos());
            pose.set(
                template.skeleton(),
                &format!("{side}_{joint}"),
                &[bent, 0.0, 0.0],
            );
        }
    }
    pose
}

/// Someone of average build in one garment bends and stands up again: the report and the crossings of each call, and
/// where cloth was before and is now, metres.
fn bend(garment: &str, joints: &[(&str, f64)]) -> (Vec<StepReport>, Vec<usize>, [Vec<P3>; 2]) {
    let t = embedded::template();
    let rest = t.personalise(&BodyShape::default());
    let options = DressOptions {
        triangulation: Triangulation {
            edge_length: 0.018,
            ..Triangulation::default()
        },
        ..DressOptions::default()
    };
    let pattern = library::pattern(garment, Size::M).expect("a pattern");
    let d = dress(&t, &rest, &pose(&t, &rest, joints, 0), &[pattern], &options).expect("dressed");
    let (mut state, mut work) = (d.state.clone(), Workspace::default());
    let before = state.garments[0].positions.clone();
    let (mut reports, mut crossed) = (Vec::new(), Vec::new());
    for call in 1..=CALLS + STANDING {
        let body = posed(&t, &rest, &pose(&t, &rest, joints, call.min(CALLS)));
        reports.push(step_on(&d.model, &mut state, &body, &mut work).expect("a step"));
        crossed.push(
            intersections(
                &d.model.outfit.garments[0].faces,
                &state.garments[0].positions,
            )
            .len(),
        );
    }
    (
        reports,
        crossed,
        [before, state.garments[0].positions.clone()],
    )
}

#[test]
fn a_long_sleeve_stays_whole_around_an_elbow_that_folds() {
    // 137°: forearm and upper arm lie in each other.
    let (reports, _, _) = bend("longsleeve", &[("elbow", 2.4)]);
    let worst = |of: fn(&StepReport) -> f64| reports.iter().map(of).fold(0.0, f64::max);
    let p99 = worst(|r| r.p99_strain);
    println!("p99 stretch {p99}, most {}", worst(|r| r.max_strain));
    // 0.20; 0.17 in cotton that was stiffer than measured. Without room inside the elbow 0.38, and torn for good.
    assert!(p99 < 0.25, "{p99}");
    assert!(reports.last().expect("calls").max_strain < 0.6);
    assert!(worst(|r| r.penetration_left) < 0.004);
}

#[test]
fn trousers_of_someone_who_squats_come_down_again_and_hardly_pass_through_themselves() {
    // Contact of vertices and faces only left more than 200 crossings in the mean.
    let (reports, crossed, [before, after]) = bend("trousers", &[("hip", -1.3), ("knee", 1.7)]);
    let lowest = |x: &[P3]| x.iter().fold(f32::MAX, |l, p| l.min(p.y));
    let mean = crossed[..CALLS].iter().sum::<usize>() / CALLS;
    let p99 = reports.iter().map(|r| r.p99_strain).fold(0.0, f64::max);
    println!(
        "{mean} crossings, p99 stretch {p99}, hem {} m up",
        lowest(&after) - lowest(&before)
    );
    assert!(lowest(&after) - lowest(&before) < 0.05);
    assert!(p99 < 0.3, "{p99}");
    assert!(mean < 20, "{mean}");
}

#[test]
fn what_a_deep_squat_pushed_through_itself_comes_free() {
    // Thighs on the belly, 126°. Contact of vertices and faces only left 608, 189 and 187 crossings for good.
    let left = ["skirt", "shorts", "trousers"].map(|garment| {
        let (_, crossed, _) = bend(garment, &[("hip", -2.2), ("knee", 2.2)]);
        let (most, left) = (
            crossed.iter().max().expect("calls"),
            crossed[crossed.len() - 1],
        );
        println!("{garment}: {most} crossings at most, {left} after a second of standing");
        left
    });
    assert!(left.iter().sum::<usize>() < 100, "{left:?}");
}

#[test]
fn legs_that_swing_past_each_other_under_a_skirt_leave_no_cloth_in_them() {
    let t = embedded::template();
    let rest = t.personalise(&BodyShape::default());
    // Thighs to 57° to the front and 34° to the back, twice a second: knees at 4 m/s. What only knew the skin of the leg
    // that it came from was 27 mm deep in the other one.
    let pose = |call: usize| {
        let s = (std::f64::consts::TAU * 2.0 * call as f64 * DT).sin();
        let mut pose = arms_down(&t, &rest);
        pose.set(t.skeleton(), "left_hip", &[-0.2 + 0.8 * s, 0.0, 0.08]);
        pose.set(t.skeleton(), "right_hip", &[-0.2 - 0.8 * s, 0.0, -0.08]);
        pose
    };
    let options = DressOptions {
        triangulation: Triangulation {
            edge_length: 0.022,
            ..Triangulation::default()
        },
        ..DressOptions::default()
    };
    let pattern = library::pattern("skirt", Size::M).expect("a pattern");
    let d = dress(&t, &rest, &pose(0), &[pattern], &options).expect("dressed");
    let (mut state, mut work, mut deepest) = (d.state.clone(), Workspace::default(), 0.0f32);
    for call in 1..=60 {
        let body = posed(&t, &rest, &pose(call));
        step_on(&d.model, &mut state, &body, &mut work).expect("a step");
        let solid = Solid::new(&body, t.mesh().faces());
        let depth = |p: &P3| {
            if solid.winding(p) < 2 {
                solid.depth(p)
            } else {
                0.0
            }
        };
        deepest = state.garments[0]
            .positions
            .iter()
            .map(depth)
            .fold(deepest, f32::max);
    }
    println!("deepest {deepest} m");
    assert!(deepest < 3e-3);
}
