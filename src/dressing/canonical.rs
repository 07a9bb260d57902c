//! The canonical pose in which garments are put on: upright, arms out and a little down, legs a little apart.

use super::settings::CanonicalSettings;
use nalgebra::{Unit, UnitQuaternion, Vector3};
use tryon_body::{JointMotion, Pose, RestBody, Template};
use tryon_geometry::math::{Body, Rigid, V3d, World, log_so3};

/// Joint angles of the canonical pose, in the template's own frame (root identity).
pub(super) fn canonical_pose(
    template: &Template,
    rest: &RestBody,
    settings: &CanonicalSettings,
) -> Pose<Body> {
    let (down, out) = (settings.arms_down, settings.legs_out);
    let mut aim = Aim {
        template,
        rest,
        pose: Pose {
            root: Rigid::<Body, Body>::identity(),
            angles: vec![0.0; template.skeleton().dofs()],
        },
    };
    for (side, s) in [("left", 1.0), ("right", -1.0)] {
        let arm = Vector3::new(s * down.cos(), -down.sin(), 0.0);
        let leg = Vector3::new(s * out.sin(), -out.cos(), 0.0);
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
    let to = root.point(&pelvis).coords;
    Rigid::from_parts(to - q * pelvis.coords, q)
}
