//! The canonical pose in which garments are put on: upright, arms out and a little down, legs a little apart.

use crate::body::{JointMotion, Pose, RestBody, Template};
use crate::math::{Body, Rigid, V3d, World, exp_so3, log_so3};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

/// Upper arms below the horizontal, radians: armpits open, shoulders not shrugged.
const ARMS_DOWN: f64 = 0.60;
/// Legs from the vertical, radians.
const LEGS_OUT: f64 = 0.10;

/// Joint angles of the canonical pose, in the template's own frame (root identity).
pub(super) fn canonical_pose(template: &Template, rest: &RestBody) -> Pose<Body> {
    let mut aim = Aim {
        template,
        rest,
        pose: Pose {
            root: Rigid::<Body, Body>::identity(),
            angles: vec![0.0; template.skeleton().dofs()],
        },
    };
    for (side, s) in [("left", 1.0), ("right", -1.0)] {
        let arm = Vector3::new(s * ARMS_DOWN.cos(), -ARMS_DOWN.sin(), 0.0);
        let leg = Vector3::new(s * LEGS_OUT.sin(), -LEGS_OUT.cos(), 0.0);
        for (limb, wanted) in [
            (["shoulder", "elbow", "wrist"], arm),
            (["hip", "knee", "ankle"], leg),
        ] {
            let [upper, middle, end] = limb.map(|n| format!("{side}_{n}"));
            aim.bone(&upper, &middle, wanted);
            // The lower part's frame turns with the upper one: straight is in line with the upper part at rest.
            if let Some(straight) = aim.rest_bone(&upper, &middle) {
                aim.bone(&middle, &end, straight);
            }
        }
    }
    aim.pose
}

struct Aim<'a> {
    template: &'a Template,
    rest: &'a RestBody,
    pose: Pose<Body>,
}

impl Aim<'_> {
    fn rest_bone(&self, joint: &str, child: &str) -> Option<V3d> {
        let sk = self.template.skeleton();
        let (j, c) = (sk.index(joint)?, sk.index(child)?);
        Some(self.rest.joints[c] - self.rest.joints[j])
    }
    /// Turns a bone from its rest direction as near to `wanted` as its joint can.
    fn bone(&mut self, joint: &str, child: &str, wanted: V3d) {
        let sk = self.template.skeleton();
        let (Some(now), Some(j)) = (self.rest_bone(joint, child), sk.index(joint)) else {
            return;
        };
        let Some(turn) = UnitQuaternion::rotation_between(&now, &wanted) else {
            return;
        };
        let (at, angles) = (sk.dof_offset(j), &mut self.pose.angles);
        match &sk.joints()[j].motion {
            JointMotion::Fixed => {}
            JointMotion::Ball { .. } => {
                angles[at..at + 3].copy_from_slice(log_so3(&turn).as_slice());
            }
            JointMotion::Hinge { axis, .. } => {
                let a = Unit::new_normalize(Vector3::from(*axis));
                let flat = |v: V3d| v - a.into_inner() * a.dot(&v);
                let (p, q) = (flat(now), flat(wanted));
                angles[at] = a.dot(&p.cross(&q)).atan2(p.dot(&q));
            }
        }
    }
}

/// The tracked root turned upright: same pelvis, same heading.
pub(super) fn upright_root(rest: &RestBody, root: &Rigid<World, Body>) -> Rigid<World, Body> {
    let pelvis = rest.joints[0];
    let forward = root.vector(&Vector3::z());
    let q = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), forward.x.atan2(forward.z));
    turned_about(pelvis.coords, root.point(&pelvis).coords, q)
}

/// The rotation `q` that takes the point `rest` to `to`.
fn turned_about(rest: V3d, to: V3d, q: UnitQuaternion<f64>) -> Rigid<World, Body> {
    Rigid::new(Isometry3::from_parts(Translation3::from(to - q * rest), q))
}

/// Pose at share `t` between `a` and `b`: joints along the shortest arc, the pelvis along a line.
pub(super) fn between(
    template: &Template,
    rest: &RestBody,
    a: &Pose<World>,
    b: &Pose<World>,
    t: f64,
) -> Pose<World> {
    let skeleton = template.skeleton();
    let pelvis = rest.joints[0];
    let slerp = |p: &UnitQuaternion<f64>, q: &UnitQuaternion<f64>| {
        p * exp_so3(&(log_so3(&(p.inverse() * q)) * t))
    };
    let (pa, pb) = (a.root.point(&pelvis).coords, b.root.point(&pelvis).coords);
    let root = turned_about(
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
