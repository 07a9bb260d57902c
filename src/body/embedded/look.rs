//! Pictures of the body for eyes: written as PPM into the folder named by `TRYON_LOOK`.

use super::*;
use crate::body::{BodyShape, BoneTransforms, Pose, skin};
use crate::math::{Body, Rigid, V3};
use crate::mesh::vertex_normals;
use crate::par::Par;
use crate::raster::{View, VisibilityBuffer, rasterise_reference};
use nalgebra::{Rotation3, Vector3};

/// Shades `vertices` seen from `yaw` degrees (0 = front) into an orthographic picture.
fn shade(t: &Template, vertices: &[P3], yaw: f32, view: (f32, f32, f32, u32, u32)) -> Vec<[u8; 3]> {
    let (left, top, scale, w, h) = view;
    let rot = Rotation3::from_axis_angle(&Vector3::y_axis(), -yaw.to_radians());
    // View frame: x right as seen from the front = −body x; y down; z away from the viewer.
    let seen: Vec<P3> = vertices
        .iter()
        .map(|p| rot * p)
        .map(|p| P3::new(p.x, -p.y, -p.z))
        .collect();
    let mut normals = Vec::new();
    vertex_normals(
        Par::Rayon,
        &seen,
        t.mesh().faces(),
        t.topology().vertex_faces(),
        &mut normals,
    );
    let v = View::Orthographic {
        width: w,
        height: h,
        left,
        top: -top,
        pixels_per_metre: scale,
    };
    let mut buffer = VisibilityBuffer::default();
    rasterise_reference(&v, &seen, t.mesh().faces(), &mut buffer);
    let light = V3::new(-0.45, -0.4, -0.8).normalize();
    let fill = V3::new(0.8, 0.1, -0.3).normalize();
    (0..(w * h) as usize)
        .map(|i| {
            if buffer.face[i] == VisibilityBuffer::NONE {
                return [40, 42, 48];
            }
            let f = t.mesh().faces()[buffer.face[i] as usize];
            let (u, r) = (
                (i as u32 % w) as f32 / scale + left,
                (i as u32 / w) as f32 / scale - top,
            );
            let [a, b, c] = f.map(|k| seen[k as usize]);
            let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
            let e = |p: P3, q: P3| ((q.x - p.x) * (r - p.y) - (q.y - p.y) * (u - p.x)) / area;
            let n = (normals[f[0] as usize] * e(b, c)
                + normals[f[1] as usize] * e(c, a)
                + normals[f[2] as usize] * e(a, b))
            .normalize();
            let s = 0.12 + 0.68 * n.dot(&light).max(0.0) + 0.25 * n.dot(&fill).max(0.0);
            [(s * 235.0) as u8, (s * 200.0) as u8, (s * 180.0) as u8]
        })
        .collect()
}

fn sheet(dir: &str, name: &str, pictures: &[Vec<[u8; 3]>], w: u32, h: u32) {
    let mut bytes = format!("P6 {} {h} 255\n", w * pictures.len() as u32).into_bytes();
    for y in 0..h as usize {
        for p in pictures {
            p[y * w as usize..(y + 1) * w as usize]
                .iter()
                .for_each(|c| bytes.extend(c));
        }
    }
    std::fs::write(format!("{dir}/{name}.ppm"), bytes).expect("writable folder");
}

pub(super) fn posed(t: &Template, shape: &BodyShape, set: &[(&str, [f64; 3])]) -> Vec<P3> {
    let rest = t.personalise(shape);
    let mut pose: Pose<Body> = Pose::rest(t.skeleton(), Rigid::identity());
    set.iter().for_each(|(j, a)| pose.set(t.skeleton(), j, a));
    let mut bones = BoneTransforms::default();
    pose.bones(t.skeleton(), &rest, &mut bones);
    let mut out = Vec::new();
    skin(Par::Rayon, &rest.vertices, t.weights(), &bones, &mut out);
    out
}

type Turns = Vec<(&'static str, [f64; 3])>;

/// Named poses for pictures and tests, radians.
pub(super) fn poses() -> Vec<(&'static str, Turns)> {
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

#[test]
fn pictures() {
    let Ok(dir) = std::env::var("TRYON_LOOK") else {
        return;
    };
    let only = std::env::var("TRYON_LOOK_ONLY").unwrap_or_default();
    let start = std::time::Instant::now();
    let t = template();
    eprintln!(
        "generated in {:?}: {} vertices, {} faces, volume {:.4}",
        start.elapsed(),
        t.mesh().vertices().len(),
        t.mesh().faces().len(),
        t.mesh().volume()
    );
    eprintln!(
        "generated {:#?}",
        crate::body::measure::measure(&t, &t.personalise(&BodyShape::default()))
    );
    let full = |w: f32| (-w / 2.0, 1.75, 420.0, (w * 420.0) as u32, 760);
    let shape = BodyShape::default();
    for (name, set) in poses() {
        if !only.is_empty() && !only.contains(name) {
            continue;
        }
        let v = posed(&t, &shape, &set);
        let width = if name == "t_pose" { 1.8 } else { 1.2 };
        let view = if name == "raised" {
            (-0.6, 2.1, 380.0, 456, 820)
        } else {
            full(width)
        };
        let pics: Vec<_> = [0.0, 40.0, 90.0, 180.0]
            .iter()
            .map(|&y| shade(&t, &v, y, view))
            .collect();
        sheet(&dir, name, &pics, view.3, view.4);
    }
    if only.is_empty() || only.contains("shapes") {
        let view = full(1.25);
        for (d, name) in DIRECTIONS.iter().enumerate() {
            let mut pics = Vec::new();
            for c in [-1.0, 1.0] {
                let mut shape = BodyShape {
                    coefficients: vec![0.0; DIRECTIONS.len()],
                    ..BodyShape::default()
                };
                shape.coefficients[d] = c * if matches!(d, 0 | 2) { 1.0 } else { 2.0 };
                let v = posed(&t, &shape, &[]);
                pics.push(shade(&t, &v, 0.0, view));
                pics.push(shade(&t, &v, 60.0, view));
                if d == 2 || d == 1 {
                    pics.push(shade(&t, &v, 180.0, view));
                }
                shape.coefficients[d] = c;
                let m =
                    crate::body::measure::measure(&t, &t.personalise(&shape)).expect("measurable");
                eprintln!(
                    "generated {name} {c}: stature {:.3} chest {:.3} waist {:.3} hip {:.3} neck {:.3} thigh {:.3} calf {:.3} arm {:.3} wrist {:.3} shoulder {:.3} inseam {:.3} armlen {:.3} torso {:.3}",
                    m.stature,
                    m.chest,
                    m.waist,
                    m.hip,
                    m.neck,
                    m.thigh,
                    m.calf,
                    m.upper_arm,
                    m.wrist,
                    m.shoulder_width,
                    m.inseam,
                    m.arm_length,
                    m.torso_length
                );
            }
            sheet(&dir, &format!("shape_{name}"), &pics, view.3, view.4);
        }
    }
    if only.is_empty() || only.contains("close") {
        let v = posed(&t, &shape, &[]);
        let trunk = (-0.34, 1.5, 720.0, 490, 560);
        let pics: Vec<_> = [0.0, 40.0, 90.0, 180.0]
            .iter()
            .map(|&y| shade(&t, &v, y, trunk))
            .collect();
        sheet(&dir, "close_trunk", &pics, 490, 560);
        let legs = (-0.3, 0.95, 620.0, 372, 600);
        let pics: Vec<_> = [0.0, 40.0, 90.0, 180.0]
            .iter()
            .map(|&y| shade(&t, &v, y, legs))
            .collect();
        sheet(&dir, "close_legs", &pics, 372, 600);
        for (name, c) in [("man", 1.0), ("woman", -1.0)] {
            let shape = BodyShape {
                coefficients: vec![0.0, 0.0, c],
                ..BodyShape::default()
            };
            let v = posed(&t, &shape, &poses()[2].1);
            let pics: Vec<_> = [0.0, 40.0, 90.0, 180.0]
                .iter()
                .map(|&y| shade(&t, &v, y, (-0.42, 1.8, 500.0, 420, 920)))
                .collect();
            sheet(&dir, &format!("close_{name}"), &pics, 420, 920);
        }
        let v = posed(
            &t,
            &shape,
            &[
                ("left_elbow", [2.1, 0.0, 0.0]),
                ("left_knee", [2.1, 0.0, 0.0]),
                ("left_hip", [-1.4, 0.0, 0.0]),
                ("spine1", [0.3, 0.0, 0.0]),
                ("spine2", [0.3, 0.0, 0.0]),
                ("spine3", [0.3, 0.0, 0.0]),
                ("neck", [0.3, 0.5, 0.0]),
                ("right_shoulder", [0.0, 1.6, -0.9]),
            ],
        );
        let pics: Vec<_> = [20.0, 60.0, 90.0, 180.0]
            .iter()
            .map(|&y| shade(&t, &v, y, (-0.55, 1.65, 500.0, 560, 840)))
            .collect();
        sheet(&dir, "close_bend", &pics, 560, 840);
        let face = (-0.16, 1.72, 1900.0, 608, 608);
        let pics: Vec<_> = [0.0, 30.0, 60.0, 90.0]
            .iter()
            .map(|&y| shade(&t, &v, y, face))
            .collect();
        sheet(&dir, "close_head", &pics, 608, 608);
        let hand = (0.46, 1.05, 2000.0, 560, 600);
        let pics = vec![
            shade(&t, &v, 0.0, hand),
            shade(&t, &v, 90.0, (-0.2, 1.05, 2000.0, 560, 600)),
            shade(&t, &v, 180.0, (-0.74, 1.05, 2000.0, 560, 600)),
        ];
        sheet(&dir, "close_hand", &pics, 560, 600);
        let pics = vec![
            shade(&t, &v, 0.0, (0.0, 0.3, 2000.0, 560, 620)),
            shade(&t, &v, 90.0, (-0.2, 0.3, 1400.0, 560, 620)),
            shade(&t, &v, 40.0, (-0.02, 0.3, 2000.0, 560, 620)),
        ];
        sheet(&dir, "close_foot", &pics, 560, 620);
    }
}
