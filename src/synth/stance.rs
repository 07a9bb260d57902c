//! A stance: a configuration of a person in directions of bones, independent of a template's rest pose.
//!
//! Keyframes and motion clips give directions; [`Rig::pose`] finds the joint angles of a template for them.

use super::settings::StanceSettings;
use nalgebra::{Matrix3, Rotation3, Unit, UnitQuaternion};
use tryon_body::{JointMotion, Pose, RestBody, Skeleton};
use tryon_geometry::math::{P3d, Rigid, V3d, World, exp_so3, log_so3};

/// Upper part, lower part and end of a limb as unit directions.
pub(super) type Limb = [V3d; 3];

/// Directions of a limb, to be normalised.
pub(super) const fn limb(upper: [f64; 3], lower: [f64; 3], end: [f64; 3]) -> Limb {
    const fn v([x, y, z]: [f64; 3]) -> V3d {
        V3d::new(x, y, z)
    }
    [v(upper), v(lower), v(end)]
}

/// A person's configuration. Sides: `[left, right]`. World is y up, a person with yaw 0 faces +z.
#[derive(Clone, Debug)]
pub(super) struct Stance {
    /// Pelvis joint, world, metres.
    pub(super) pelvis: P3d,
    /// Orientation of the pelvis in the world.
    pub(super) heading: UnitQuaternion<f64>,
    /// Rotation vector of the chest against the pelvis, pelvis axes.
    pub(super) chest: V3d,
    /// Rotation vector of the head against the chest, chest axes.
    pub(super) head: V3d,
    /// Upper arm, forearm, hand; chest axes.
    pub(super) arms: [Limb; 2],
    /// Thigh, shank, and the foot's direction (unused where `feet` is given); pelvis axes.
    pub(super) legs: [Limb; 2],
    /// Orientation of the feet in the world: flat on the floor.
    pub(super) feet: [UnitQuaternion<f64>; 2],
}

impl Stance {
    /// Part of the way to another stance, 0 to 1.
    pub(super) fn blend(&self, to: &Self, s: f64) -> Self {
        let turn = |a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>| {
            a.try_slerp(b, s, f64::EPSILON).unwrap_or(*b)
        };
        let toward = |a: &V3d, b: &V3d| {
            UnitQuaternion::rotation_between(a, b).map_or(*b, |q| {
                UnitQuaternion::from_scaled_axis(log_so3(&q) * s) * a
            })
        };
        let limbs = |a: &[Limb; 2], b: &[Limb; 2]| {
            std::array::from_fn(|k| {
                std::array::from_fn(|i| toward(&a[k][i].normalize(), &b[k][i].normalize()))
            })
        };
        Self {
            pelvis: self.pelvis + (to.pelvis - self.pelvis) * s,
            heading: turn(&self.heading, &to.heading),
            chest: self.chest + (to.chest - self.chest) * s,
            head: self.head + (to.head - self.head) * s,
            arms: limbs(&self.arms, &to.arms),
            legs: limbs(&self.legs, &to.legs),
            feet: [
                turn(&self.feet[0], &to.feet[0]),
                turn(&self.feet[1], &to.feet[1]),
            ],
        }
    }
}

/// One limb of a template: root joint, hinge, end joint and their rest geometry.
#[derive(Clone, Debug)]
struct LimbRig {
    /// Shoulder or hip, elbow or knee, wrist or ankle.
    joints: [usize; 3],
    /// Rest directions of the upper part, lower part and end.
    rest: Limb,
    /// Hinge axis in the rest pose, across the upper part.
    axis: V3d,
    /// Lengths of upper and lower part, metres.
    length: [f64; 2],
}

/// Joints and rest geometry of a template that turn a stance into a pose.
#[derive(Clone, Debug)]
pub(super) struct Rig {
    skeleton: Skeleton,
    pelvis: P3d,
    spine: Vec<usize>,
    neck: Vec<usize>,
    arms: [Option<LimbRig>; 2],
    legs: [Option<LimbRig>; 2],
    /// Hip joints against the pelvis joint, rest pose.
    hips: [V3d; 2],
    /// Height of the ankle above the sole, metres.
    ankle_height: f64,
    pub(super) settings: StanceSettings,
}

impl Rig {
    pub(super) fn new(skeleton: &Skeleton, rest: &RestBody) -> Self {
        let at = |name: &str| skeleton.index(name);
        let floor = rest
            .vertices
            .iter()
            .map(|v| f64::from(v.y))
            .fold(f64::INFINITY, f64::min);
        let pelvis = rest.joints[0];
        let sides = ["left", "right"];
        let limb = |side: &str, names: [&str; 3], ends: &[&str]| -> Option<LimbRig> {
            let joints = [
                at(&format!("{side}_{}", names[0]))?,
                at(&format!("{side}_{}", names[1]))?,
                at(&format!("{side}_{}", names[2]))?,
            ];
            let p = joints.map(|j| rest.joints[j]);
            let end = ends
                .iter()
                .find_map(|e| at(&format!("{side}_{e}")))
                .map_or(p[2] + (p[2] - p[1]), |j| rest.joints[j]);
            let bones = [p[1] - p[0], p[2] - p[1], end - p[2]];
            let rest_dirs = bones.map(|b| b.try_normalize(0.0).unwrap_or(-V3d::y()));
            let axis = match &skeleton.joints()[joints[1]].motion {
                JointMotion::Hinge { axis, .. } => V3d::from(*axis),
                _ => rest_dirs[0].cross(&rest_dirs[1]),
            };
            let axis = axis - rest_dirs[0] * axis.dot(&rest_dirs[0]);
            let axis = axis.try_normalize(0.0).unwrap_or(V3d::x());
            Some(LimbRig {
                joints,
                rest: rest_dirs,
                axis,
                length: [bones[0].norm(), bones[1].norm()],
            })
        };
        let list = |names: &[&str]| names.iter().filter_map(|n| at(n)).collect();
        let ankles = sides.map(|s| at(&format!("{s}_ankle")));
        Self {
            pelvis,
            spine: list(&["spine1", "spine2", "spine3"]),
            neck: list(&["neck", "head"]),
            arms: sides.map(|s| limb(s, ["shoulder", "elbow", "wrist"], &["hand_end", "hand"])),
            legs: sides.map(|s| limb(s, ["hip", "knee", "ankle"], &["foot"])),
            hips: sides
                .map(|s| at(&format!("{s}_hip")).map_or(V3d::zeros(), |j| rest.joints[j] - pelvis)),
            ankle_height: ankles[0].map_or(0.0, |j| rest.joints[j].y - floor),
            skeleton: skeleton.clone(),
            settings: StanceSettings::default(),
        }
    }

    /// Thigh and shank together, metres; one without legs.
    pub(super) fn leg_length(&self) -> f64 {
        self.legs[0]
            .as_ref()
            .map_or(1.0, |l| l.length[0] + l.length[1])
    }
    /// From hip to knee, metres; one half without legs.
    pub(super) fn thigh_length(&self) -> f64 {
        self.legs[0].as_ref().map_or(0.5, |l| l.length[0])
    }
    /// Height of the ankle above the sole, metres.
    pub(super) fn ankle_height(&self) -> f64 {
        self.ankle_height
    }
    /// From the pelvis joint to the middle between the hips at this heading.
    pub(super) fn hip_center(&self, heading: &UnitQuaternion<f64>) -> V3d {
        heading * ((self.hips[0] + self.hips[1]) * 0.5)
    }

    /// Pelvis height and leg directions for a pelvis over `x, z` with feet planted at `soles` (x, height, z of the
    /// point under each ankle, and yaw).
    pub(super) fn stand(&self, stance: &mut Stance, soles: [(P3d, f64); 2]) {
        let hips = self.hips.map(|h| stance.heading * h);
        // The straighter leg limits the height.
        let mut height = f64::INFINITY;
        for s in 0..2 {
            let Some(leg) = &self.legs[s] else { continue };
            let ankle = soles[s].0 + V3d::y() * self.ankle_height;
            let across = V3d::new(
                stance.pelvis.x + hips[s].x - ankle.x,
                0.0,
                stance.pelvis.z + hips[s].z - ankle.z,
            );
            let reach = (leg.length[0] + leg.length[1]) * self.settings.slack;
            let up = (reach * reach - across.norm_squared()).max(0.0).sqrt();
            height = height.min(ankle.y + up - hips[s].y);
        }
        if height.is_finite() {
            stance.pelvis.y = height;
        }
        self.plant(stance, soles);
    }

    /// Leg directions that bring the feet from a given pelvis to `soles`, as in [`Rig::stand`].
    pub(super) fn plant(&self, stance: &mut Stance, soles: [(P3d, f64); 2]) {
        let hips = self.hips.map(|h| stance.heading * h);
        for s in 0..2 {
            let Some(leg) = &self.legs[s] else { continue };
            let yaw = UnitQuaternion::from_axis_angle(&V3d::y_axis(), soles[s].1);
            stance.feet[s] = yaw;
            let hip = stance.pelvis + hips[s];
            let to = soles[s].0 + V3d::y() * self.ankle_height - hip;
            let [a, b] = leg.length;
            let d = to
                .norm()
                .clamp((a - b).abs() + f64::EPSILON, (a + b) * self.settings.slack);
            let down = to.try_normalize(0.0).unwrap_or(-V3d::y());
            // The knee points halfway between the directions of pelvis and foot.
            let pole = stance.heading * V3d::z() + yaw * V3d::z();
            let front = (pole - down * pole.dot(&down))
                .try_normalize(0.0)
                .unwrap_or(V3d::z());
            let cos = ((a * a + d * d - b * b) / (2.0 * a * d)).clamp(-1.0, 1.0);
            let thigh = down * cos + front * (1.0 - cos * cos).sqrt();
            let shank = (down * d - thigh * a).try_normalize(0.0).unwrap_or(down);
            let back = stance.heading.inverse();
            stance.legs[s] = [back * thigh, back * shank, back * (yaw * V3d::z())];
        }
    }

    /// Joint angles that take the stance, within the limits of the skeleton.
    pub(super) fn pose(&self, stance: &Stance) -> Pose<World> {
        let root = Rigid::from_parts(
            stance.pelvis.coords - stance.heading * self.pelvis.coords,
            stance.heading,
        );
        let mut pose = Pose::rest(&self.skeleton, root);
        for &j in &self.spine {
            self.set(
                &mut pose,
                j,
                &exp_so3(&(stance.chest / self.spine.len() as f64)),
            );
        }
        for &j in &self.neck {
            self.set(
                &mut pose,
                j,
                &exp_so3(&(stance.head / self.neck.len() as f64)),
            );
        }
        for s in 0..2 {
            if let Some(arm) = &self.arms[s] {
                let lower = self.bend(&mut pose, arm, &stance.arms[s]);
                let hand = lower.inverse() * stance.arms[s][2];
                let turn =
                    UnitQuaternion::rotation_between(&arm.rest[2], &hand).unwrap_or_default();
                self.set(&mut pose, arm.joints[2], &turn);
            }
            if let Some(leg) = &self.legs[s] {
                let lower = self.bend(&mut pose, leg, &stance.legs[s]);
                self.set(
                    &mut pose,
                    leg.joints[2],
                    &((stance.heading * lower).inverse() * stance.feet[s]),
                );
            }
        }
        pose.clamp_to_limits(&self.skeleton);
        pose
    }

    /// Sets root joint and hinge of a limb; returns the orientation of its lower part in the frame of its root.
    fn bend(&self, pose: &mut Pose<World>, limb: &LimbRig, to: &Limb) -> UnitQuaternion<f64> {
        let [a, f, _] = limb.rest;
        let [d, e, _] = *to;
        let least = UnitQuaternion::rotation_between(&a, &d).unwrap_or_else(|| {
            UnitQuaternion::from_axis_angle(&Unit::new_normalize(limb.axis), std::f64::consts::PI)
        });
        let axis = d.cross(&e) + least * limb.axis * self.settings.straight;
        let axis = (axis - d * axis.dot(&d))
            .try_normalize(0.0)
            .unwrap_or(least * limb.axis);
        let frame = |x: V3d, y: V3d| Matrix3::from_columns(&[x, y, x.cross(&y)]);
        let turn = frame(d, axis) * frame(a, limb.axis).transpose();
        let upper = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
        let bent = |x: &V3d, y: &V3d, n: &V3d| n.dot(&x.cross(y)).atan2(x.dot(y));
        let angle = bent(&d, &e, &axis) - bent(&a, &f, &limb.axis);
        self.set(pose, limb.joints[0], &upper);
        let hinge = UnitQuaternion::from_axis_angle(&Unit::new_normalize(limb.axis), angle);
        self.set(pose, limb.joints[1], &hinge);
        upper * hinge
    }

    fn set(&self, pose: &mut Pose<World>, joint: usize, turn: &UnitQuaternion<f64>) {
        let w = log_so3(turn);
        let at = self.skeleton.dof_offset(joint);
        match &self.skeleton.joints()[joint].motion {
            JointMotion::Fixed => {}
            JointMotion::Hinge { axis, .. } => pose.angles[at] = w.dot(&V3d::from(*axis)),
            JointMotion::Ball { .. } => pose.angles[at..at + 3].copy_from_slice(w.as_slice()),
        }
    }
}
