//! The pose garments are put on in: upright, arms out and a little down, legs a little apart.

use crate::body::{JointMotion, Pose, RestBody, Template};
use crate::math::{Body, Rigid, World, log_so3};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

/// Upper arms this far below the horizontal, radians: armpits open, shoulders not shrugged.
const ARMS_DOWN: f64 = 0.60;
/// Legs this far from the vertical, radians.
const LEGS_OUT: f64 = 0.10;

/// Joint angles of the canonical pose, in the template's own frame (root identity).
pub(super) fn canonical_pose(template: &Template, rest: &RestBody) -> Pose<Body> {
    let skeleton = template.skeleton();
    let mut pose = Pose {
        root: Rigid::<Body, Body>::identity(),
        angles: vec![0.0; skeleton.dofs()],
    };
    let mut aim = |joint: &str, child: &str, wanted: Vector3<f64>| {
        let (Some(j), Some(c)) = (skeleton.index(joint), skeleton.index(child)) else {
            return;
        };
        let now = rest.joints[c] - rest.joints[j];
        let Some(turn) = UnitQuaternion::rotation_between(&now, &wanted) else {
            return;
        };
        let at = skeleton.dof_offset(j);
        match &skeleton.joints()[j].motion {
            JointMotion::Fixed => {}
            JointMotion::Ball { .. } => {
                pose.angles[at..at + 3].copy_from_slice(log_so3(&turn).as_slice())
            }
            JointMotion::Hinge { axis, .. } => {
                // The angle about the axis that brings the bone nearest to the wanted direction.
                let a = Unit::new_normalize(Vector3::from(*axis));
                let flat = |v: Vector3<f64>| v - a.into_inner() * a.dot(&v);
                let (p, q) = (flat(now), flat(wanted));
                pose.angles[at] = a.dot(&p.cross(&q)).atan2(p.dot(&q));
            }
        }
    };
    for (side, s) in [("left", 1.0), ("right", -1.0)] {
        let arm = Vector3::new(s * ARMS_DOWN.cos(), -ARMS_DOWN.sin(), 0.0);
        let upper = format!("{side}_shoulder");
        aim(&upper, &format!("{side}_elbow"), arm);
        // The forearm's local frame is turned by the shoulder: straight means in line with the upper arm at rest.
        if let (Some(sh), Some(el)) = (
            skeleton.index(&upper),
            skeleton.index(&format!("{side}_elbow")),
        ) {
            aim(
                &format!("{side}_elbow"),
                &format!("{side}_wrist"),
                rest.joints[el] - rest.joints[sh],
            );
        }
        let leg = Vector3::new(s * LEGS_OUT.sin(), -LEGS_OUT.cos(), 0.0);
        aim(&format!("{side}_hip"), &format!("{side}_knee"), leg);
        if let (Some(hi), Some(kn)) = (
            skeleton.index(&format!("{side}_hip")),
            skeleton.index(&format!("{side}_knee")),
        ) {
            aim(
                &format!("{side}_knee"),
                &format!("{side}_ankle"),
                rest.joints[kn] - rest.joints[hi],
            );
        }
    }
    pose
}

/// The tracked root stood upright: same pelvis, same heading.
pub(super) fn upright_root(rest: &RestBody, root: &Rigid<World, Body>) -> Rigid<World, Body> {
    let pelvis = rest.joints[0];
    let forward = root.vector(&Vector3::z());
    let q = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), forward.x.atan2(forward.z));
    around(pelvis.coords, root.point(&pelvis).coords, q)
}

fn around(rest: Vector3<f64>, to: Vector3<f64>, q: UnitQuaternion<f64>) -> Rigid<World, Body> {
    Rigid::new(Isometry3::from_parts(Translation3::from(to - q * rest), q))
}

/// Pose `t` of the way from `a` to `b`: rotations along the shortest arc joint by joint, the pelvis straight.
pub(super) fn between(
    template: &Template,
    rest: &RestBody,
    a: &Pose<World>,
    b: &Pose<World>,
    t: f64,
) -> Pose<World> {
    use crate::math::exp_so3;
    let skeleton = template.skeleton();
    let pelvis = rest.joints[0];
    let slerp = |p: &UnitQuaternion<f64>, q: &UnitQuaternion<f64>| {
        p * exp_so3(&(log_so3(&(p.inverse() * q)) * t))
    };
    let (pa, pb) = (a.root.point(&pelvis).coords, b.root.point(&pelvis).coords);
    let root = around(
        pelvis.coords,
        pa + (pb - pa) * t,
        slerp(&a.root.iso().rotation, &b.root.iso().rotation),
    );
    let mut angles: Vec<f64> = a
        .angles
        .iter()
        .zip(&b.angles)
        .map(|(x, y)| x + (y - x) * t)
        .collect();
    for (j, joint) in skeleton.joints().iter().enumerate() {
        if matches!(joint.motion, JointMotion::Ball { .. }) {
            let at = skeleton.dof_offset(j);
            let q = slerp(
                &exp_so3(&a.rotation_vector(skeleton, j)),
                &exp_so3(&b.rotation_vector(skeleton, j)),
            );
            angles[at..at + 3].copy_from_slice(log_so3(&q).as_slice());
        }
    }
    Pose { root, angles }
}
