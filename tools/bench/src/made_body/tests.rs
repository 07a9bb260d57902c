//! Tests of the embedded body.

use super::statistics as stat;
use super::*;
use tryon_body::embedded::{DIRECTIONS, RANGE, template};
use tryon_body::measure::{Measurements, measure};
use tryon_body::{BodyShape, BoneTransforms, JointMotion, Pose, RestBody, skin};
use tryon_geometry::math::{Body, Rigid};
use tryon_geometry::mesh::{face_normal, smallest_angle};
use tryon_geometry::par::{Par, with_threads};

fn shape(direction: usize, c: f64) -> BodyShape {
    let mut coefficients = vec![0.0; DIRECTIONS.len()];
    coefficients[direction] = c;
    BodyShape {
        coefficients,
        ..BodyShape::default()
    }
}

fn measured(s: &BodyShape) -> Measurements {
    let t = template();
    measure(&t, &t.personalise(s)).expect("measurable")
}

fn volume(t: &Template, v: &[P3]) -> f64 {
    t.mesh().with_vertices(v.to_vec()).expect("finite").volume()
}

#[test]
fn surface_is_one_closed_manifold_of_bounded_size() {
    let t = template();
    let (n, f, e) = (
        t.mesh().vertices().len(),
        t.mesh().faces().len(),
        t.topology().edges().len(),
    );
    assert!((12_000..=14_000).contains(&n), "{n} vertices");
    assert!(t.topology().is_closed());
    assert_eq!(t.topology().components().1, 1);
    assert_eq!(n as i64 - e as i64 + f as i64, 2, "Euler characteristic");
    // At a vertex of a manifold the faces form one fan: as many neighbours as faces.
    for i in 0..n {
        assert_eq!(
            t.topology().vertex_faces().row(i).len(),
            t.topology().vertex_neighbours().row(i).len(),
            "vertex {i}"
        );
    }
    let v = t.mesh().volume();
    assert!((0.060..0.080).contains(&v), "{v} m³");
    let (lo, hi) = t.mesh().bounds().expect("vertices");
    assert!(lo.y.abs() < 0.003, "soles at {}", lo.y);
    assert!((f64::from(hi.y - lo.y) - stat::STATURE.mean()).abs() < 0.003);
    let j = |n: &str| t.skeleton().joints()[t.skeleton().index(n).expect("joint")].rest;
    assert!(
        j("left_foot").z > j("left_ankle").z && j("left_hip").x > 0.0,
        "faces +z, left is +x"
    );
}

#[test]
fn triangles_are_fit_for_simulation() {
    let t = template();
    let sine = |i: usize| smallest_angle(t.mesh().corners(i).map(|p| p.cast::<f64>()));
    let worst = (0..t.mesh().faces().len()).map(sine).fold(1.0, f64::min);
    let poor = (0..t.mesh().faces().len())
        .filter(|&i| sine(i) < 0.5)
        .count();
    // No angle under 25°, one face in two hundred under 30°.
    assert!(
        worst > 0.4226,
        "smallest angle {:.1}°",
        worst.asin().to_degrees()
    );
    assert!(
        poor * 200 < t.mesh().faces().len(),
        "{poor} faces with an angle under 30°"
    );
}

#[test]
fn left_mirrors_right() {
    let t = template();
    let key = |p: &P3| [p.x.to_bits(), p.y.to_bits(), p.z.to_bits()];
    let index: std::collections::BTreeMap<_, usize> = t
        .mesh()
        .vertices()
        .iter()
        .enumerate()
        .map(|(i, p)| (key(p), i))
        .collect();
    let space = t.shape_space().expect("shape space");
    for (i, p) in t.mesh().vertices().iter().enumerate() {
        let image = if p.x == 0.0 {
            *p
        } else {
            P3::new(-p.x, p.y, p.z)
        };
        let m = *index
            .get(&key(&image))
            .unwrap_or_else(|| panic!("vertex {i} has no mirror image"));
        for d in &space.vertices {
            assert!(
                (d[i].x + d[m].x).abs() < 1e-6 && (d[i].yz() - d[m].yz()).norm() < 1e-6,
                "vertex {i}"
            );
        }
        let weight = |v: usize, name: &str| {
            let (w, j) = (&t.weights().weights[v], &t.weights().joints[v]);
            (0..4)
                .filter(|&k| w[k] > 0.0 && t.skeleton().joints()[usize::from(j[k])].name == name)
                .map(|k| w[k])
                .sum::<f32>()
        };
        for (l, r) in [
            ("left_hip", "right_hip"),
            ("left_shoulder", "right_shoulder"),
            ("left_collar", "right_collar"),
        ] {
            assert!(
                (weight(i, l) - weight(m, r)).abs() < 1e-5,
                "vertex {i}, {l}"
            );
        }
    }
}

#[test]
fn weights_are_few_and_sum_to_one() {
    let t = template();
    for (i, w) in t.weights().weights.iter().enumerate() {
        assert!(
            (w.iter().sum::<f32>() - 1.0).abs() < 1e-5 && w.iter().all(|x| *x >= 0.0),
            "vertex {i}"
        );
    }
    // The middle of each bone belongs to it, and hands do not move with the other side.
    for name in "left_shoulder left_elbow left_hip left_knee right_knee head left_wrist".split(' ')
    {
        let j = t.skeleton().index(name).expect("joint");
        assert!(
            (0..t.mesh().vertices().len())
                .any(|v| t.weights().dominant(v) == j && t.weights().weights[v][0] > 0.99),
            "{name}"
        );
    }
}

#[test]
fn skeleton_has_the_agreed_joints() {
    let t = template();
    let s = t.skeleton();
    for name in "pelvis left_hip right_hip spine1 left_knee right_knee spine2 left_ankle right_ankle spine3 left_foot \
         right_foot neck left_collar right_collar head left_shoulder right_shoulder left_elbow right_elbow left_wrist \
         right_wrist head_end left_hand_end right_hand_end left_foot_end right_foot_end"
        .split_whitespace()
    {
        assert!(s.index(name).is_some(), "{name}");
    }
    let moving = s.joints().iter().filter(|j| j.motion.dofs() > 0).count();
    assert_eq!(moving, 19);
    for n in ["left_elbow", "right_elbow", "left_knee", "right_knee"] {
        let j = &s.joints()[s.index(n).expect("joint")];
        assert!(matches!(j.motion, JointMotion::Hinge { .. }), "{n}");
    }
    assert!(
        s.limits().iter().all(|l| l[0] < 0.0 && l[1] > 0.0),
        "the rest pose is within the limits"
    );
}

#[test]
fn test_poses_are_within_the_limits() {
    let t = template();
    for (name, set) in poses() {
        let mut pose: Pose<Body> = Pose::rest(t.skeleton(), Rigid::identity());
        set.iter().for_each(|(j, a)| pose.set(t.skeleton(), j, a));
        let mut clamped = pose.clone();
        clamped.clamp_to_limits(t.skeleton());
        assert_eq!(pose, clamped, "{name}");
    }
}

#[test]
fn elbows_bend_forward_and_knees_backward() {
    let t = template();
    let rest = t.personalise(&BodyShape::default());
    for (joint, end, sign) in [
        ("left_elbow", "left_wrist", 1.0),
        ("right_elbow", "right_wrist", 1.0),
        ("left_knee", "left_ankle", -1.0),
        ("right_knee", "right_ankle", -1.0),
    ] {
        let bones = bones_of(&t, &rest, &[(joint, &[0.8])]);
        let e = t.skeleton().index(end).expect("joint");
        assert!(
            (bones.joints[e].z - rest.joints[e].z) * sign > 0.1,
            "{joint}"
        );
    }
}

#[test]
fn the_file_is_made_again_bit_for_bit_on_any_number_of_threads() {
    let once = template();
    let again = with_threads(3, generate).expect("pool").expect("generated");
    assert_eq!(once.mesh(), again.mesh());
    assert_eq!(once.weights(), again.weights());
    assert_eq!(once.shape_space(), again.shape_space());
    assert_eq!(once.skeleton(), again.skeleton());
}

/// Linear blend skinning loses volume inside bends; the bounds are those of the tuned weights.
#[test]
fn bends_without_collapsing() {
    let t = template();
    let rest = volume(&t, t.mesh().vertices());
    for (name, set) in poses() {
        let v = posed(&t, &set);
        let change = volume(&t, &v) / rest - 1.0;
        let bound = if name == "sitting" { 0.04 } else { 0.025 };
        assert!(
            change.abs() < bound,
            "{name}: volume changes by {:.1} %",
            100.0 * change
        );
    }
}

#[test]
fn no_face_turns_over() {
    let t = template();
    let rest = t.personalise(&BodyShape::default());
    for (name, set) in poses() {
        let v = posed(&t, &set);
        let bones = bones_of(&t, &rest, &slices(&set));
        // A face may turn with its bones, not against them.
        let turned = t
            .mesh()
            .faces()
            .iter()
            .filter(|f| {
                let b = bones.bones[t.weights().dominant(f[0] as usize)]
                    .rotation
                    .cast::<f32>();
                (b * face_normal(t.mesh().vertices(), f)).dot(&face_normal(&v, f)) < 0.0
            })
            .count();
        let allowed = if matches!(name, "rest" | "t_pose" | "arms_down") {
            0
        } else {
            t.mesh().faces().len() / 100
        };
        assert!(turned <= allowed, "{name}: {turned} faces turned over");
    }
}

/// A measure and its published statistic.
type Published = (fn(&Measurements) -> f64, stat::Statistic);

const PUBLISHED: [Published; 9] = [
    (|m| m.stature, stat::STATURE),
    (|m| m.chest, stat::CHEST),
    (|m| m.waist, stat::WAIST),
    (|m| m.hip, stat::HIP),
    (|m| m.neck, stat::NECK),
    (|m| m.thigh, stat::THIGH),
    (|m| m.calf, stat::CALF),
    (|m| m.shoulder_width, stat::SHOULDERS),
    (|m| m.inseam, stat::CROTCH),
];

#[test]
fn bodies_have_the_published_measures() {
    let mean: fn(&stat::Statistic) -> f64 = |s| s.mean();
    for (body, published, bound) in [
        (BodyShape::default(), mean, 0.03),
        (shape(2, 1.0), |s| s.men[0], 0.04),
        (shape(2, -1.0), |s| s.women[0], 0.04),
    ] {
        let m = measured(&body);
        for (k, (of, statistic)) in PUBLISHED.iter().enumerate() {
            let (got, wanted) = (of(&m), published(statistic));
            assert!(
                (got / wanted - 1.0).abs() < bound,
                "measure {k}: {got:.3} m, published {wanted:.3} m"
            );
        }
    }
}

#[test]
fn a_unit_is_a_standard_deviation() {
    type Case = (usize, fn(&Measurements) -> f64, f64);
    let of: [Case; 4] = [
        (0, |m| m.stature, stat::STATURE.deviation()),
        (5, |m| m.shoulder_width, stat::SHOULDERS.residual()),
        (7, |m| m.waist, stat::WAIST.residual()),
        (8, |m| m.hip, stat::HIP.residual()),
    ];
    let zero = measured(&BodyShape::default());
    for (d, f, deviation) in of {
        for c in [-1.0, 1.0] {
            let change = (f(&measured(&shape(d, c))) - f(&zero)) * c;
            assert!(
                (change / deviation - 1.0).abs() < 0.12,
                "{} {c}: {change:.4} m, published {deviation:.4} m",
                DIRECTIONS[d]
            );
        }
    }
}

#[test]
fn the_belly_bulges_to_the_front_alone() {
    let t = template();
    let d = DIRECTIONS.iter().position(|d| *d == "belly").expect("one");
    let space = t.shape_space().expect("shape space");
    let moved = t.mesh().vertices().iter().zip(&space.vertices[d]);
    let farthest = |is_there: fn(&P3) -> bool| {
        let there = moved.clone().filter(|(p, _)| is_there(p));
        there.map(|(_, by)| by.norm()).fold(0.0, f32::max)
    };
    let navel = farthest(|p| p.x.abs() < 0.02 && p.z > 0.08 && (p.y - 1.04).abs() < 0.02);
    assert!((0.02..0.03).contains(&navel), "{navel} m");
    assert!(farthest(|p| p.z < -0.06) < 0.003, "the back");
    assert!(farthest(|p| p.y > 1.3 || p.y < 0.8) < 0.003, "the ends");
    assert!(space.joints[d].iter().all(|j| j.norm() == 0.0));
}

#[test]
fn whole_range_of_shapes_is_sound() {
    let t = template();
    for (d, name) in DIRECTIONS.iter().enumerate() {
        for c in [-RANGE, RANGE] {
            let body = t.personalise(&shape(d, c));
            let turned = t
                .mesh()
                .faces()
                .iter()
                .filter(|f| {
                    face_normal(t.mesh().vertices(), f).dot(&face_normal(&body.vertices, f)) <= 0.0
                })
                .count();
            assert_eq!(turned, 0, "{name} {c}");
            assert!(
                (0.045..0.115).contains(&volume(&t, &body.vertices)),
                "{name} {c}"
            );
            assert!(measure(&t, &body).is_ok(), "{name} {c}");
        }
    }
}

/// Legs may touch, but a left vertex never passes the middle: within two deviations nothing intersects there.
#[test]
fn sides_stay_apart() {
    let t = template();
    for (d, name) in DIRECTIONS.iter().enumerate() {
        for c in [-2.0, 2.0] {
            let body = t.personalise(&shape(d, c));
            for (i, p) in t.mesh().vertices().iter().enumerate() {
                let q = body.vertices[i];
                assert!(
                    p.x <= 0.0 || q.x > 0.0,
                    "{name} {c}: vertex {i} at {p} went to {q}"
                );
            }
        }
    }
}

/// The shape space is linear and the figure is not: their distance at one standard deviation is bounded.
#[test]
fn linear_directions_stay_near_the_figure() {
    let t = template();
    let figure = |chest, sex| Figure {
        chest,
        sex,
        ..Figure::default()
    };
    for (d, fig) in [
        (6, figure(1.0, 0.0)),
        (2, figure(0.0, 1.0)),
        (2, figure(0.0, -1.0)),
    ] {
        let field = carve(&fig, &fig.joints());
        let space = t.shape_space().expect("shape space");
        // The sex direction holds the taller stature; the figure is at equal stature.
        let back = if d == 2 {
            stat::STATURE.sex() / stat::STATURE.deviation()
        } else {
            0.0
        };
        let c = if d == 2 { fig.sex as f32 } else { 1.0 };
        let mut worst: f64 = 0.0;
        let mut sum = 0.0;
        for (i, p) in t.mesh().vertices().iter().enumerate() {
            let q = p + (space.vertices[d][i] - space.vertices[0][i] * back as f32) * c;
            let v = field.value(&q.cast()).abs();
            worst = worst.max(v);
            sum += v * v;
        }
        let rms = (sum / t.mesh().vertices().len() as f64).sqrt();
        assert!(
            rms < 0.0015 && worst < 0.012,
            "{} {c}: rms {rms:.4} m, worst {worst:.4} m",
            DIRECTIONS[d]
        );
    }
}

#[test]
fn joints_lie_inside() {
    let t = template();
    let fig = Figure::default();
    let field = carve(&fig, &fig.joints());
    for j in t.skeleton().joints() {
        if !j.name.ends_with("_end") {
            assert!(
                field.value(&j.rest) < -0.005,
                "{} is at {:.4} m",
                j.name,
                field.value(&j.rest)
            );
        }
    }
}

fn slices<'a>(set: &'a [(&'a str, [f64; 3])]) -> Vec<(&'a str, &'a [f64])> {
    set.iter().map(|(j, a)| (*j, &a[..])).collect()
}

/// Bones in a pose, given as angles by joint, radians.
fn bones_of(t: &Template, rest: &RestBody, set: &[(&str, &[f64])]) -> BoneTransforms {
    let mut pose: Pose<Body> = Pose::rest(t.skeleton(), Rigid::identity());
    set.iter().for_each(|(j, a)| pose.set(t.skeleton(), j, a));
    let mut bones = BoneTransforms::default();
    pose.bones(t.skeleton(), rest, &mut bones);
    bones
}

/// Vertices of the body in a pose, given as angles by joint, radians.
fn posed(t: &Template, set: &[(&str, [f64; 3])]) -> Vec<P3> {
    let rest = t.personalise(&BodyShape::default());
    let bones = bones_of(t, &rest, &slices(set));
    let mut out = Vec::new();
    skin(Par::Rayon, &rest.vertices, t.weights(), &bones, &mut out);
    out
}

type Turns = Vec<(&'static str, [f64; 3])>;

/// Named poses, radians.
fn poses() -> Vec<(&'static str, Turns)> {
    let q = std::f64::consts::FRAC_PI_4;
    let both = |j: [&'static str; 2], a: [f64; 3]| [(j[0], a), (j[1], [a[0], -a[1], -a[2]])];
    let (sh, hip) = (
        ["left_shoulder", "right_shoulder"],
        ["left_hip", "right_hip"],
    );
    let hinge = |j: [&'static str; 2], a: f64| [(j[0], [a, 0.0, 0.0]), (j[1], [a, 0.0, 0.0])];
    let mut sit: Turns = both(hip, [-1.5, 0.0, 0.0]).to_vec();
    sit.extend(hinge(["left_knee", "right_knee"], 1.5));
    let mut bent: Turns = hinge(["left_elbow", "right_elbow"], 2.0).to_vec();
    bent.push(("left_hip", [-1.2, 0.0, 0.0]));
    bent.push(("left_knee", [1.6, 0.0, 0.0]));
    let mut raised: Turns = both(sh, [0.0, 0.0, 1.9]).to_vec();
    raised.extend(both(["left_collar", "right_collar"], [0.0, 0.0, 0.3]));
    vec![
        ("rest", vec![]),
        ("t_pose", both(sh, [0.0, 0.0, q]).to_vec()),
        ("arms_down", both(sh, [0.0, 0.0, -0.62]).to_vec()),
        ("sitting", sit),
        ("bent", bent),
        ("raised", raised),
        ("forward", both(sh, [0.0, -1.4, 0.3]).to_vec()),
    ]
}
