//! Import of SMPL-layout arrays as a template with anatomical joints.

mod file_error;
mod file_frame;
#[cfg(test)]
mod frame_tests;
mod joint_names;
mod read;
mod standing_surface;
mod stature;

pub use file_error::BodyFileError;
pub use read::{BodyFile, body_of_arrays, read_body};
pub use standing_surface::StandingFrame;
pub use stature::unit_of_stature;

use super::{
    BodyError, Joint, JointMotion, PoseShapes, ShapeSpace, Skeleton, SkinWeights, Template,
};
use nalgebra::{Point3, Vector3};
use tryon_formats::PoseDirections;
use tryon_formats::npz::{SmplArrays, regress};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::TriMesh;

/// Bend of the rest pose from which on it defines the plane of elbow or knee, radians; below, the forward direction
/// does. At 0.25 the axis is known to some 5° when joints are off by 5 mm.
const BENT: f64 = 0.25;
/// Overstretching of elbows and knees, radians: hypermobility, and rest joints off by a few mm.
const OVERSTRETCH: f64 = 0.1;

/// Builds a template from the arrays of an SMPL-layout body.
///
/// Joints get the motion and limits of the human joint of their name; unknown names become balls. End points `head_end`,
/// `left_hand_end`, `right_hand_end`, `left_foot_end` and `right_foot_end` are added at the surface.
///
/// # Errors
/// Names the array, joint or vertex that does not match.
pub fn template_from_smpl(name: &str, arrays: &SmplArrays) -> Result<Template, BodyError> {
    let (n, j) = (arrays.vertices.len(), arrays.parents.len());
    let array = |array: &str, why: String| BodyError::Array {
        array: array.into(),
        why,
    };
    if arrays.joints.len() != j || arrays.joint_names.len() != j || j == 0 {
        return Err(array(
            "J",
            format!(
                "{} joints and {} names for {j}",
                arrays.joints.len(),
                arrays.joint_names.len()
            ),
        ));
    }
    if arrays.weights.len() != n * j {
        return Err(array(
            "weights",
            format!(
                "{} values for {n} vertices and {j} joints",
                arrays.weights.len()
            ),
        ));
    }
    if !arrays.shape_directions.is_empty() && arrays.joint_regressor.len() != n * j {
        return Err(array(
            "J_regressor",
            "missing or of the wrong size; `shapedirs` needs it to move the joints".into(),
        ));
    }
    let weights = SkinWeights::from_rows(arrays.weights.chunks_exact(j).map(|row| {
        row.iter()
            .enumerate()
            .map(|(k, w)| (k, f64::from(*w)))
            .collect()
    }))?;
    let mesh = TriMesh::new(
        arrays.vertices.iter().map(|v| P3::from(*v)).collect(),
        arrays.faces.clone(),
    )?;

    let rest: Vec<Point3<f64>> = arrays.joints.iter().map(|p| Point3::from(*p)).collect();
    let mut joints: Vec<Joint> = (0..j)
        .map(|k| Joint {
            name: arrays.joint_names[k].clone(),
            parent: arrays.parents[k],
            rest: rest[k],
            motion: motion(k, arrays, &rest),
        })
        .collect();
    let ends = end_points(arrays, &weights, &mesh);
    joints.extend(ends.iter().map(|e| Joint {
        name: e.name.to_owned(),
        parent: Some(e.parent),
        rest: mesh.vertices()[e.vertex].cast(),
        motion: JointMotion::Fixed,
    }));
    let shape_space = (!arrays.shape_directions.is_empty()).then(|| shape_space(arrays, &ends));
    let template = Template::new(name, mesh, Skeleton::new(joints)?, weights, shape_space)?;
    let PoseDirections {
        feature, of_pose, ..
    } = &arrays.pose_directions;
    if of_pose.is_empty() {
        return Ok(template);
    }
    template.with_pose_shapes(PoseShapes::new([n, j], *feature, of_pose.clone())?)
}

/// End point of a limb: a vertex of the surface.
struct EndPoint {
    name: &'static str,
    parent: usize,
    vertex: usize,
}

/// The farthest vertex along each hand, each foot and the head.
fn end_points(arrays: &SmplArrays, weights: &SkinWeights, mesh: &TriMesh) -> Vec<EndPoint> {
    let index = |name: &str| arrays.joint_names.iter().position(|n| n == name);
    let wanted = [
        ("head_end", ["head", "head"], Some(Vector3::y())),
        ("left_hand_end", ["left_hand", "left_wrist"], None),
        ("right_hand_end", ["right_hand", "right_wrist"], None),
        (
            "left_foot_end",
            ["left_foot", "left_ankle"],
            Some(Vector3::z()),
        ),
        (
            "right_foot_end",
            ["right_foot", "right_ankle"],
            Some(Vector3::z()),
        ),
    ];
    let mut ends = Vec::new();
    for (name, parents, direction) in wanted {
        if index(name).is_some() {
            continue;
        }
        let Some(parent) = parents.iter().find_map(|p| index(p)) else {
            continue;
        };
        let origin = Point3::from(arrays.joints[parent]);
        let along = direction.or_else(|| {
            let before = arrays.parents[parent].map(|p| Point3::from(arrays.joints[p]))?;
            (origin - before).try_normalize(0.0)
        });
        let Some(along) = along else { continue };
        // The end belongs to the parent or to what hangs from it (fingers, toes).
        let below = |mut k: usize| loop {
            if k == parent {
                return true;
            }
            match arrays.parents.get(k).copied().flatten() {
                Some(p) => k = p,
                None => return false,
            }
        };
        let reach = |i: usize| (mesh.vertices()[i].cast::<f64>() - origin).dot(&along);
        let vertex = (0..mesh.vertices().len())
            .filter(|&i| below(weights.dominant(i)))
            .max_by(|&a, &b| reach(a).total_cmp(&reach(b)).then(b.cmp(&a)));
        if let Some(vertex) = vertex {
            ends.push(EndPoint {
                name,
                parent,
                vertex,
            });
        }
    }
    ends
}

/// Shape directions with the joints' share from the regressor, and the end points' from their vertices.
///
/// STAR's pose features have the second shape coefficient beside the rotations, so its offsets are the same in every pose:
/// they belong to that direction, but not to the joints, which are regressed before.
fn shape_space(arrays: &SmplArrays, ends: &[EndPoint]) -> ShapeSpace {
    let mut directions = arrays.shape_directions.clone();
    if let Some(second) = directions.get_mut(1) {
        let more = &arrays.pose_directions.of_second_shape;
        for (offset, more) in second.iter_mut().flatten().zip(more.iter().flatten()) {
            *offset += more;
        }
    }
    let joints = directions
        .iter()
        .zip(&arrays.shape_directions)
        .map(|(whole, own)| {
            let moved = regress(&arrays.joint_regressor, own).into_iter();
            let end = |e: &EndPoint| Vector3::from(whole[e.vertex].map(f64::from));
            let moved = moved.map(Vector3::from).chain(ends.iter().map(end));
            moved.collect()
        })
        .collect();
    ShapeSpace {
        names: (0..directions.len())
            .map(|d| format!("shape_{d}"))
            .collect(),
        vertices: directions
            .iter()
            .map(|d| d.iter().map(|o| V3::from(*o)).collect())
            .collect(),
        joints,
    }
}

/// Motion of a joint by its SMPL name. Limits are active ranges of motion (AAOS 1965) widened by a fifth.
///
/// The rest pose (T or A) that they count from differs between bodies: they keep limbs human, not exact.
fn motion(k: usize, arrays: &SmplArrays, rest: &[Point3<f64>]) -> JointMotion {
    let name = arrays.joint_names[k].as_str();
    // Left and right mirror each other in the sagittal plane: rotations about y and z change sign.
    let (side, part) = match (name.strip_prefix("left_"), name.strip_prefix("right_")) {
        (Some(part), _) => (1.0, part),
        (_, Some(part)) => (-1.0, part),
        _ => (1.0, name),
    };
    let mirrored = |l: [f64; 2]| if side > 0.0 { l } else { [-l[1], -l[0]] };
    let ball = |x: [f64; 2], y: [f64; 2], z: [f64; 2]| JointMotion::Ball {
        limits: [x, mirrored(y), mirrored(z)],
    };
    let even = |r: f64| [-r, r];
    // Elbows flex by about 150°, knees by 145° from straight (clinical ranges of motion, AAOS 1965).
    match part {
        "pelvis" => JointMotion::Fixed,
        // Flexion is forward: −x. Abduction of the left leg: +z.
        "hip" => ball([-2.3, 0.8], even(1.0), [-0.7, 1.2]),
        "knee" => hinge(k, arrays, rest, -Vector3::z(), 2.53),
        "ankle" => ball([-0.7, 1.0], even(0.6), even(0.6)),
        "foot" => JointMotion::Hinge {
            axis: [1.0, 0.0, 0.0],
            limits: [-1.0, 0.5],
        },
        "spine1" | "spine2" | "spine3" => ball([-0.4, 0.7], even(0.5), even(0.45)),
        "neck" | "head" => ball(even(0.7), even(0.8), even(0.6)),
        "collar" => ball(even(0.3), even(0.5), even(0.6)),
        "shoulder" => ball(even(2.4), even(2.4), even(2.6)),
        "elbow" => hinge(k, arrays, rest, Vector3::z(), 2.62),
        "wrist" => ball(even(1.5), even(1.2), even(1.2)),
        "hand" => JointMotion::Fixed,
        _ => ball(even(1.5), even(1.5), even(1.5)),
    }
}

/// A hinge that bends the limb towards `front` at positive angles, from straight to `flexion`.
fn hinge(
    k: usize,
    arrays: &SmplArrays,
    rest: &[Point3<f64>],
    front: Vector3<f64>,
    flexion: f64,
) -> JointMotion {
    let child = (k + 1..rest.len()).find(|&c| arrays.parents[c] == Some(k));
    let upper = arrays.parents[k].and_then(|p| (rest[k] - rest[p]).try_normalize(0.0));
    let lower = child.and_then(|c| (rest[c] - rest[k]).try_normalize(0.0));
    let (Some(upper), Some(lower)) = (upper, lower) else {
        return JointMotion::Fixed;
    };
    let bend = upper.cross(&lower);
    let axis = if bend.norm() > BENT.sin() {
        bend
    } else {
        upper.cross(&front)
    };
    let Some(axis) = axis.try_normalize(f64::EPSILON) else {
        return JointMotion::Fixed;
    };
    let at_rest = bend.dot(&axis).atan2(upper.dot(&lower));
    JointMotion::Hinge {
        axis: axis.into(),
        limits: [(-at_rest - OVERSTRETCH).min(0.0), flexion - at_rest],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BodyShape, BoneTransforms, Pose};
    use std::path::{Path, PathBuf};
    use tryon_formats::npz::read_smpl;
    use tryon_formats::shared_data;
    use tryon_geometry::math::{Body, Rigid};

    fn makehuman(file: &str) -> Option<PathBuf> {
        shared_data(Path::new("body/makehuman_smpl_layout").join(file))
    }

    /// One entry of `posedirs`: the rotation of the left elbow, row 0, column 1, moves a vertex of its forearm along z.
    #[test]
    fn pose_directions_are_read_row_by_row() {
        let Some(path) = makehuman("template.npz") else {
            return;
        };
        const SIZE: f32 = 0.05;
        let mut arrays = read_smpl(path).expect("readable");
        let (n, j) = (arrays.vertices.len(), arrays.parents.len());
        let plain = template_from_smpl("plain", &arrays).expect("valid");
        let elbow = plain.skeleton().index("left_elbow").expect("known");
        let vertex = (0..n)
            .find(|v| plain.weights().dominant(*v) == elbow)
            .expect("a forearm");
        let features = 9 * (j - 1);
        let mut of_pose = vec![0.0; n * 3 * features];
        of_pose[(vertex * 3 + 2) * features + 9 * (elbow - 1) + 1] = SIZE;
        arrays.pose_directions.of_pose = of_pose;
        let shaped = template_from_smpl("shaped", &arrays).expect("valid");

        let mut pose = Pose::<Body>::rest(shaped.skeleton(), Rigid::identity());
        pose.set(shaped.skeleton(), "left_elbow", &[0.9]);
        let mut bones = BoneTransforms::default();
        let body = shaped.personalise(&BodyShape::default());
        pose.bones(shaped.skeleton(), &body, &mut bones);
        let offsets = shaped.pose_offsets(&bones).expect("an elbow is bent");
        let turn = pose.local_rotations(shaped.skeleton())[elbow];
        let entry = turn.to_rotation_matrix().matrix()[(0, 1)] as f32;
        assert!(entry.abs() > 0.1, "{entry}");
        let found = offsets.of(vertex);
        assert!((found - V3::z() * (SIZE * entry)).norm() < 1e-6, "{found}");
        assert_eq!(offsets.of(vertex + 1), V3::zeros());
    }

    /// The last column of STAR's `posedirs` moves the skin by the second coefficient of shape, in every pose, and no joint.
    #[test]
    fn the_second_shape_direction_of_star_has_its_pose_column() {
        let Some(path) = makehuman("template.npz") else {
            return;
        };
        const SIZE: f32 = 0.02;
        let mut arrays = read_smpl(path).expect("readable");
        let plain = template_from_smpl("plain", &arrays).expect("valid");
        arrays.pose_directions.of_second_shape = vec![[0.0, SIZE, 0.0]; arrays.vertices.len()];
        let star = template_from_smpl("star", &arrays).expect("valid");
        let shape = BodyShape {
            coefficients: vec![0.7, 1.5],
            ..Default::default()
        };
        let (a, b) = (plain.personalise(&shape), star.personalise(&shape));
        let mut moved = a.vertices.iter().zip(&b.vertices);
        assert!(moved.all(|(p, q)| (q - p - V3::y() * (1.5 * SIZE)).norm() < 1e-6));
        let known = arrays.joints.len();
        assert_eq!(a.joints[..known], b.joints[..known]);
        let tip = b.joints[known] - a.joints[known];
        assert!(
            (tip.y - 0.03).abs() < 1e-6,
            "an end point is one of the skin"
        );
    }

    #[test]
    fn the_makehuman_template_has_its_documented_numbers() {
        let Some(path) = makehuman("template.npz") else {
            return;
        };
        let arrays = read_smpl(path).expect("readable");
        assert_eq!(
            (
                arrays.vertices.len(),
                arrays.faces.len(),
                arrays.joints.len()
            ),
            (13_380, 26_756, 22)
        );
        assert_eq!(arrays.shape_directions.len(), 20);
        let t = template_from_smpl("makehuman", &arrays).expect("valid");
        let s = t.skeleton();
        assert_eq!(s.len(), 22 + 5);
        let (lo, hi) = t.mesh().bounds().expect("vertices");
        assert!(
            (hi.y - lo.y - 1.693).abs() < 1e-3,
            "stature of the mean body"
        );
        assert!(t.topology().is_closed());
        for end in [
            "head_end",
            "left_hand_end",
            "right_hand_end",
            "left_foot_end",
            "right_foot_end",
        ] {
            assert!(s.index(end).is_some(), "{end}");
        }
        let at = |n: &str| s.joints()[s.index(n).expect("joint")].rest;
        assert!((at("head_end").y - 1.693).abs() < 1e-3 && at("left_hand_end").x > 0.5);
        assert!(at("left_hip").x > 0.0 && at("left_foot_end").z > 0.15);
        // The regressor's own claim: joints within 9 mm of J on the mean body.
        let worst = regress(&arrays.joint_regressor, &arrays.vertices)
            .iter()
            .zip(&arrays.joints)
            .map(|(a, b)| (Point3::from(*a) - Point3::from(*b)).norm())
            .fold(0.0, f64::max);
        assert!(worst < 0.009, "{worst}");
        // A coefficient moves joints with the surface: the taller body has longer legs and a higher head.
        let mut coefficients = vec![0.0; 20];
        coefficients[0] = 2.0;
        let (a, b) = (
            t.personalise(&BodyShape::default()),
            t.personalise(&BodyShape {
                coefficients,
                ..Default::default()
            }),
        );
        let moved = a
            .joints
            .iter()
            .zip(&b.joints)
            .map(|(p, q)| (p - q).norm())
            .fold(0.0, f64::max);
        assert!(moved > 0.01, "{moved}");
        let head = s.index("head_end").expect("head_end");
        let top = b.vertices.iter().map(|v| v.y).fold(f32::MIN, f32::max);
        assert!((b.joints[head].y - f64::from(top)).abs() < 0.01);
    }

    #[test]
    fn subjects_without_shape_space_read_too() {
        for file in [
            "subject_f_avg",
            "subject_f_short_heavy",
            "subject_m_heavy",
            "subject_m_tall",
        ] {
            let Some(path) = makehuman(&format!("{file}.npz")) else {
                return;
            };
            let t = template_from_smpl(file, &read_smpl(path).expect("readable")).expect("valid");
            assert!(
                t.shape_space().is_none() && t.mesh().volume() > 0.03,
                "{file}"
            );
        }
    }

    #[test]
    fn elbows_and_knees_bend_the_human_way() {
        let Some(path) = makehuman("template.npz") else {
            return;
        };
        let t =
            template_from_smpl("makehuman", &read_smpl(path).expect("readable")).expect("valid");
        let (s, rest) = (t.skeleton(), t.personalise(&BodyShape::default()));
        let tip = |pose: &Pose<Body>, name: &str| {
            let mut bones = Default::default();
            pose.bones(s, &rest, &mut bones);
            bones.joints[s.index(name).expect("joint")]
        };
        let neutral = Pose::<Body>::rest(s, Rigid::identity());
        let mut bent = neutral.clone();
        for side in ["left", "right"] {
            bent.set(s, &format!("{side}_elbow"), &[0.8]);
            bent.set(s, &format!("{side}_knee"), &[0.8]);
        }
        for side in ["left", "right"] {
            let (wrist, ankle) = (format!("{side}_wrist"), format!("{side}_ankle"));
            assert!(
                tip(&bent, &wrist).z > tip(&neutral, &wrist).z + 0.02,
                "{wrist} comes forward"
            );
            assert!(
                tip(&bent, &ankle).z < tip(&neutral, &ankle).z - 0.2,
                "{ankle} goes back"
            );
        }
    }
}
