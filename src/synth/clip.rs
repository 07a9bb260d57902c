//! Recorded motion on any template: bone directions of a clip become stances.

use super::routine::{Routine, ease};
use super::settings::StanceSettings;
use super::stance::{Limb, Rig, Stance};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use tryon_body::human_joints::{HumanJoints, JointTree, LimbChain, SideBasis, SideEvidence};
use tryon_formats::{MeshAxis, MotionClip};
use tryon_geometry::math::{P3d, V3d, log_so3};

/// Component of the mean trunk along an axis from which on people stand along it.
const STANDING: f64 = 0.6;

/// The joints of a clip that a stance needs, `[left, right]` where there are two.
#[derive(Clone, Debug)]
struct Landmarks {
    hip: [usize; 2],
    knee: [usize; 2],
    ankle: [usize; 2],
    toe: [Option<usize>; 2],
    shoulder: [usize; 2],
    elbow: [usize; 2],
    wrist: [usize; 2],
    hand: [Option<usize>; 2],
    neck: usize,
    head: Option<[usize; 2]>,
}

/// A clip with its landmarks.
#[derive(Clone, Debug)]
pub(super) struct Performance {
    /// Upright: y up.
    clip: MotionClip,
    at: Landmarks,
    /// Pelvis in the first frame, floor height, and turn that makes the first frame face +z.
    start: P3d,
    floor: f64,
    facing: UnitQuaternion<f64>,
    /// Length of thigh and shank, in the clip's unit.
    leg: f64,
    /// Statements about what was recognised, one a sentence.
    notes: Vec<String>,
}

/// A clip that cannot be played on a body.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("motion clip: {0}")]
pub struct ClipError(
    /// The fault and the expectation.
    pub String,
);

/// Frame with x to the left of the body and y as near to `up` as can be.
fn basis(left: V3d, up: V3d) -> Option<UnitQuaternion<f64>> {
    let x = left.try_normalize(0.0)?;
    let z = x.cross(&up).try_normalize(0.0)?;
    let m = Matrix3::from_columns(&[x, z.cross(&x), z]);
    Some(UnitQuaternion::from_rotation_matrix(
        &Rotation3::from_matrix_unchecked(m),
    ))
}

/// A person's joints in a clip: by the lengths of bones, sides by feet, knees and elbows over all frames and by names.
fn joints_of(clip: &MotionClip) -> Result<(HumanJoints, SideBasis), ClipError> {
    let first = clip.frames.first();
    let first = first.ok_or_else(|| ClipError("it has no frames".into()))?;
    let tree = |places| JointTree {
        parents: &clip.parents,
        places,
        names: &clip.names,
    };
    // Files without offsets have their lengths in the frames.
    let rest = HumanJoints::find(&tree(&clip.rest));
    let found = rest.or_else(|_| HumanJoints::find(&tree(first)));
    let found = found.map_err(ClipError)?;
    let mut evidence = SideEvidence::default();
    for frame in &clip.frames {
        evidence.add(&found, frame);
    }
    found
        .sided(&tree(first), evidence.mean())
        .map_err(ClipError)
}

/// Turns a clip to y up: people in it stand along their mean direction from hips to shoulders.
fn upright(mut clip: MotionClip, joints: &HumanJoints) -> (MotionClip, Option<String>) {
    let middle =
        |f: &[P3d], pair: &[LimbChain; 2]| nalgebra::center(&f[pair[0].root()], &f[pair[1].root()]);
    let trunk = |f: &Vec<P3d>| (middle(f, &joints.arms) - middle(f, &joints.legs)).normalize();
    let mean = clip.frames.iter().map(trunk).sum::<V3d>() / clip.frames.len().max(1) as f64;
    let Some((up, cosine)) = MeshAxis::nearest(mean.into()) else {
        return (clip, None);
    };
    if up == MeshAxis::Y || clip.is_y_up {
        return (clip, None);
    }
    if cosine * mean.norm() < STANDING {
        let note = format!(
            "lies or turns over in most frames ({up} is the nearest axis to its trunk): taken as y up"
        );
        return (clip, Some(note));
    }
    let axis = V3d::from(up.vector());
    let turn = UnitQuaternion::rotation_between(&axis, &V3d::y())
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&V3d::x_axis(), std::f64::consts::PI));
    let places = clip.frames.iter_mut().flatten().chain(&mut clip.rest);
    places.for_each(|p| *p = turn * *p);
    (
        clip,
        Some(format!(
            "{up} up in most frames: turned to y up, as a person who lies throughout would be"
        )),
    )
}

impl Landmarks {
    fn new(joints: &HumanJoints, shoulders: usize) -> Self {
        let (legs, arms) = (&joints.legs, &joints.arms);
        Self {
            hip: legs.each_ref().map(LimbChain::root),
            knee: legs.each_ref().map(LimbChain::hinge),
            ankle: legs.each_ref().map(LimbChain::end),
            toe: legs.each_ref().map(LimbChain::after_end),
            shoulder: arms.each_ref().map(LimbChain::root),
            elbow: arms.each_ref().map(LimbChain::hinge),
            wrist: arms.each_ref().map(LimbChain::end),
            hand: arms.each_ref().map(LimbChain::after_end),
            neck: joints.neck.or(joints.head).unwrap_or(shoulders),
            head: joints.head.zip(joints.head_top).map(|(a, b)| [a, b]),
        }
    }
}

impl Performance {
    /// Finds the joints.
    pub(super) fn new(clip: MotionClip) -> Result<Self, ClipError> {
        let (joints, sides) = joints_of(&clip)?;
        let mut notes = clip.statements();
        match sides {
            SideBasis::Both => {}
            SideBasis::Ahead => notes.push("left and right by feet, knees and elbows: its names name no sides".into()),
            SideBasis::Names => notes.push("left and right by its names: its feet, knees and elbows show no way ahead".into()),
            SideBasis::AgainstNames => notes.push("left and right by feet, knees and elbows; its names say the opposite: it is mirrored, or they are".into()),
        }
        let (clip, turned) = upright(clip, &joints);
        notes.extend(turned);
        let at = Landmarks::new(
            &joints,
            joints.spine.last().copied().unwrap_or(joints.pelvis),
        );
        let first = &clip.frames[0];
        let middle = |f: &[P3d]| nalgebra::center(&f[at.hip[0]], &f[at.hip[1]]);
        let start = middle(first);
        let left = first[at.hip[0]] - first[at.hip[1]];
        let ahead = V3d::new(left.x, 0.0, left.z).cross(&V3d::y());
        let facing = UnitQuaternion::from_axis_angle(&V3d::y_axis(), -ahead.x.atan2(ahead.z));
        let floor = clip
            .frames
            .iter()
            .flat_map(|f| at.ankle.map(|a| f[a].y))
            .fold(f64::INFINITY, f64::min);
        let leg = (first[at.hip[0]] - first[at.knee[0]]).norm()
            + (first[at.knee[0]] - first[at.ankle[0]]).norm();
        if leg.is_nan() || leg <= 0.0 {
            return Err(ClipError("its legs have no length".into()));
        }
        Ok(Self {
            start,
            floor,
            facing,
            leg,
            at,
            clip,
            notes,
        })
    }

    /// Statements about what was recognised, one a sentence.
    pub(super) fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Stance at `t`: calibration pose, blend, then the clip.
    pub(super) fn stance(&self, rig: &Rig, home: P3d, t: f64) -> Stance {
        let still = || Routine::Still.stance(rig, home, t);
        let StanceSettings { hold, blend, .. } = rig.settings;
        if t < hold {
            return still();
        }
        let clip = self.clip_stance(rig, home, t - hold - blend);
        let s = ease((t - hold) / blend);
        if s < 1.0 {
            still().blend(&clip, s)
        } else {
            clip
        }
    }

    fn clip_stance(&self, rig: &Rig, home: P3d, t: f64) -> Stance {
        let (n, at) = (self.clip.frames.len(), &self.at);
        let place = (t / self.clip.period).clamp(0.0, (n - 1) as f64);
        let (i, s) = (place as usize, place.fract());
        let (a, b) = (&self.clip.frames[i], &self.clip.frames[(i + 1).min(n - 1)]);
        let p = |j: usize| self.facing * (a[j] + (b[j] - a[j]) * s);
        let toward =
            |from: usize, to: usize| (p(to) - p(from)).try_normalize(0.0).unwrap_or(-V3d::y());
        let hips = nalgebra::center(&p(at.hip[0]), &p(at.hip[1]));
        let up = p(at.neck) - hips;
        let heading = basis(p(at.hip[0]) - p(at.hip[1]), up).unwrap_or_default();
        let chest_at = basis(p(at.shoulder[0]) - p(at.shoulder[1]), up).unwrap_or(heading);
        let (from_pelvis, from_chest) = (heading.inverse(), chest_at.inverse());
        let head = at.head.map_or(V3d::zeros(), |[base, top]| {
            let to = from_chest * toward(base, top);
            UnitQuaternion::rotation_between(&V3d::y(), &to).map_or(V3d::zeros(), |q| log_so3(&q))
        });
        let arm = |side: usize| -> Limb {
            let fore = toward(at.elbow[side], at.wrist[side]);
            let hand = at.hand[side].map_or(fore, |h| toward(at.wrist[side], h));
            [
                from_chest * toward(at.shoulder[side], at.elbow[side]),
                from_chest * fore,
                from_chest * hand,
            ]
        };
        let foot = |side: usize| {
            let ahead = at.toe[side].map_or(heading * V3d::z(), |toe| toward(at.ankle[side], toe));
            UnitQuaternion::from_axis_angle(&V3d::y_axis(), ahead.x.atan2(ahead.z))
        };
        let leg = |side: usize| -> Limb {
            let (thigh, shank) = (
                toward(at.hip[side], at.knee[side]),
                toward(at.knee[side], at.ankle[side]),
            );
            [
                from_pelvis * thigh,
                from_pelvis * shank,
                from_pelvis * (foot(side) * V3d::z()),
            ]
        };
        let scale = rig.leg_length() / self.leg;
        let moved = (hips - self.facing * self.start) * scale;
        let mut stance = Stance {
            pelvis: P3d::origin(),
            heading,
            chest: log_so3(&(from_pelvis * chest_at)),
            head,
            arms: [arm(0), arm(1)],
            legs: [leg(0), leg(1)],
            feet: [foot(0), foot(1)],
        };
        let height = (hips.y - self.floor) * scale + rig.ankle_height();
        let hip_offset = rig.hip_center(&stance.heading);
        stance.pelvis =
            P3d::new(home.x + moved.x, height, home.z + moved.z) - V3d::new(0.0, hip_offset.y, 0.0);
        stance
    }
}

#[cfg(test)]
mod tests {
    use crate::{Actor, Sequence, Setting};
    use tryon_formats::{MotionClip, read_motion, shared_data};

    fn shared(name: &str) -> Option<MotionClip> {
        let root = shared_data("motion")?;
        Some(read_motion(&root.join(name)).expect(name))
    }

    #[test]
    fn a_clip_without_joints_is_refused() {
        let clip = MotionClip {
            names: vec!["root".into()],
            parents: vec![None],
            rest: vec![nalgebra::Point3::origin()],
            frames: vec![vec![nalgebra::Point3::origin()]],
            period: 0.01,
            ..MotionClip::default()
        };
        let e = Sequence::new(Actor::default(), Setting::default())
            .with_clip(clip)
            .expect_err("no joints");
        assert!(e.to_string().contains("two legs"), "{e}");
    }

    #[test]
    fn bones_point_where_the_clip_points() {
        for (file, names) in [
            (
                "cmu_asf_amc/02_07.amc",
                ["lhumerus", "lradius", "rfemur", "rtibia"],
            ),
            (
                "cmu_bvh/02_02_makehuman.bvh",
                ["lShldr", "lForeArm", "rThigh", "rShin"],
            ),
        ] {
            let Some(clip) = shared(file) else { return };
            let s = Sequence::new(Actor::default(), Setting::default())
                .with_clip(clip.clone())
                .expect("plays");
            let skeleton = s.actor().template.skeleton().clone();
            let ours = ["left_shoulder", "left_elbow", "right_hip", "right_knee"]
                .map(|n| skeleton.index(n).expect(n));
            let theirs = names.map(|n| clip.joint(&[n]).expect(n));
            let mut worst = 0.0f64;
            for i in (60..200).step_by(7) {
                let truth = s.truth(i);
                let t = i as f64 / 30.0 - 2.0;
                let f = &clip.frames[((t / clip.period) as usize).min(clip.frames.len() - 1)];
                // The angle between thigh and upper arm does not depend on the headings of clip and camera.
                let w = |k: usize| truth.joints[ours[k + 1]] - truth.joints[ours[k]];
                let c = |k: usize| f[theirs[k + 1]] - f[theirs[k]];
                worst = worst.max((w(0).angle(&w(2)) - c(0).angle(&c(2))).abs());
            }
            assert!(worst < 0.2, "{file}: {worst} rad");
        }
    }
}
