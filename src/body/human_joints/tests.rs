//! Trees of other rigs, with and without names.

use super::*;
use crate::embedded;
use nalgebra::{Point3, Vector3};

struct Rig {
    names: Vec<String>,
    parents: Vec<Option<usize>>,
    places: Vec<Point3<f64>>,
}

impl Rig {
    /// Joints as `(name, parent's name, place)`; the place is for the left side and mirrored for `?` replaced by R.
    fn new(joints: &[(&str, &str, [f64; 3])]) -> Self {
        let mut out = Self {
            names: Vec::new(),
            parents: Vec::new(),
            places: Vec::new(),
        };
        for (name, parent, at) in joints {
            let sides: &[(&str, f64)] = match name.contains('?') {
                true => &[("L", 1.0), ("R", -1.0)],
                false => &[("", 1.0)],
            };
            for (side, sign) in sides {
                let parent = parent.replace('?', side);
                out.parents
                    .push(out.names.iter().position(|n| *n == parent));
                out.names.push(name.replace('?', side));
                out.places.push(Point3::new(sign * at[0], at[1], at[2]));
            }
        }
        out
    }
    fn tree<'a>(&'a self, names: &'a [String]) -> JointTree<'a> {
        JointTree {
            parents: &self.parents,
            places: &self.places,
            names,
        }
    }
    fn find(&self, names: &[String]) -> Result<(HumanJoints, SideBasis), String> {
        let tree = self.tree(names);
        let found = HumanJoints::find(&tree)?;
        let mut evidence = SideEvidence::default();
        evidence.add(&found, &self.places);
        found.sided(&tree, evidence.mean())
    }
    /// Names of the joints that were found, `limbs` from the left, with and without help of names.
    fn check(&self, pelvis: &str, head: &str, limbs: [[&str; 3]; 2], basis: SideBasis) {
        let nameless = vec![String::new(); self.names.len()];
        for (names, basis) in [(&self.names, basis), (&nameless, SideBasis::Ahead)] {
            let (found, by) = self.find(names).expect("a person");
            let name = |j: usize| self.names[j].as_str();
            let at = |l: &LimbChain| [l.root(), l.hinge(), l.end()].map(name);
            assert_eq!([&found.legs[0], &found.arms[0]].map(at), limbs, "{basis:?}");
            assert_eq!(name(found.pelvis), pelvis);
            if *names == self.names {
                assert_eq!(found.head.map(name), Some(head));
            }
            assert_eq!(by, basis);
        }
    }
}

/// 3ds Max Biped: legs on the spine, collars on the neck, twist bones beside the chain.
const BIPED: [(&str, &str, [f64; 3]); 19] = [
    ("Bip01", "", [0.0, 0.95, 0.0]),
    ("Bip01 Pelvis", "Bip01", [0.0, 0.95, 0.0]),
    ("Bip01 Spine", "Bip01 Pelvis", [0.0, 1.0, 0.0]),
    ("Bip01 ? Thigh", "Bip01 Spine", [0.09, 0.94, 0.0]),
    ("Bip01 ? Calf", "Bip01 ? Thigh", [0.09, 0.52, 0.01]),
    ("Bip01 ? Foot", "Bip01 ? Calf", [0.09, 0.09, -0.02]),
    ("Bip01 ? Toe0", "Bip01 ? Foot", [0.09, 0.02, 0.1]),
    ("Bip01 ? Toe0Nub", "Bip01 ? Toe0", [0.09, 0.01, 0.18]),
    ("Bip01 Spine1", "Bip01 Spine", [0.0, 1.2, 0.0]),
    ("Bip01 Neck", "Bip01 Spine1", [0.0, 1.45, 0.0]),
    ("Bip01 Head", "Bip01 Neck", [0.0, 1.54, 0.02]),
    ("Bip01 HeadNub", "Bip01 Head", [0.0, 1.72, 0.02]),
    ("Bip01 ? Clavicle", "Bip01 Neck", [0.03, 1.44, 0.0]),
    ("Bip01 ? UpperArm", "Bip01 ? Clavicle", [0.18, 1.43, -0.01]),
    ("Bip01 ? Forearm", "Bip01 ? UpperArm", [0.46, 1.43, -0.02]),
    ("Bip01 ? ForeTwist", "Bip01 ? Forearm", [0.5, 1.43, -0.02]),
    ("Bip01 ? Hand", "Bip01 ? Forearm", [0.72, 1.43, 0.0]),
    ("Bip01 ? Finger0", "Bip01 ? Hand", [0.8, 1.43, 0.01]),
    ("Bip01 ? Finger0Nub", "Bip01 ? Finger0", [0.88, 1.43, 0.01]),
];

#[test]
fn a_biped_is_found_with_and_without_names() {
    Rig::new(&BIPED).check(
        "Bip01 Spine",
        "Bip01 Head",
        [
            ["Bip01 L Thigh", "Bip01 L Calf", "Bip01 L Foot"],
            ["Bip01 L UpperArm", "Bip01 L Forearm", "Bip01 L Hand"],
        ],
        SideBasis::Both,
    );
}

#[test]
fn twist_bones_in_the_chain_and_goals_beside_it_are_no_elbows() {
    // MakeHuman's rig and Unreal's: halves of segments in the chain, IK goals at the root.
    let rig = Rig::new(&[
        ("root", "", [0.0, 0.0, 0.0]),
        ("ik_foot_root", "root", [0.0, 0.0, 0.0]),
        ("ik_foot_?", "ik_foot_root", [0.09, 0.09, 0.0]),
        ("hips", "root", [0.0, 0.95, 0.0]),
        ("pelvis.?", "hips", [0.05, 0.95, 0.0]),
        ("upperleg01.?", "pelvis.?", [0.1, 0.92, 0.0]),
        ("upperleg02.?", "upperleg01.?", [0.1, 0.72, 0.005]),
        ("lowerleg01.?", "upperleg02.?", [0.1, 0.5, 0.01]),
        ("lowerleg02.?", "lowerleg01.?", [0.1, 0.3, 0.0]),
        ("foot.?", "lowerleg02.?", [0.1, 0.08, -0.02]),
        ("toe1-1.?", "foot.?", [0.1, 0.02, 0.1]),
        ("toe1-2.?", "toe1-1.?", [0.1, 0.01, 0.14]),
        ("spine03", "hips", [0.0, 1.1, 0.0]),
        ("spine01", "spine03", [0.0, 1.35, -0.02]),
        ("neck01", "spine01", [0.0, 1.47, 0.0]),
        ("neck02", "neck01", [0.0, 1.51, 0.01]),
        ("head", "neck02", [0.0, 1.55, 0.02]),
        ("jaw", "head", [0.0, 1.56, 0.1]),
        ("eye.?", "head", [0.03, 1.63, 0.1]),
        ("clavicle.?", "spine01", [0.02, 1.42, 0.02]),
        ("shoulder01.?", "clavicle.?", [0.15, 1.43, 0.0]),
        ("upperarm01.?", "shoulder01.?", [0.18, 1.42, 0.0]),
        ("upperarm02.?", "upperarm01.?", [0.31, 1.42, -0.005]),
        ("lowerarm01.?", "upperarm02.?", [0.45, 1.42, -0.01]),
        ("lowerarm02.?", "lowerarm01.?", [0.58, 1.42, -0.005]),
        ("wrist.?", "lowerarm02.?", [0.7, 1.42, 0.0]),
        ("finger2-1.?", "wrist.?", [0.79, 1.42, 0.02]),
        ("finger2-2.?", "finger2-1.?", [0.83, 1.42, 0.02]),
        ("finger3-1.?", "wrist.?", [0.79, 1.42, 0.0]),
        ("finger3-2.?", "finger3-1.?", [0.84, 1.42, 0.0]),
        ("finger4-1.?", "wrist.?", [0.79, 1.42, -0.02]),
        ("finger4-2.?", "finger4-1.?", [0.83, 1.42, -0.02]),
    ]);
    rig.check(
        "hips",
        "head",
        [
            ["upperleg01.L", "lowerleg01.L", "foot.L"],
            ["upperarm01.L", "lowerarm01.L", "wrist.L"],
        ],
        SideBasis::Both,
    );
}

#[test]
fn names_of_the_wrong_side_are_found_out() {
    let mut rig = Rig::new(&BIPED);
    rig.places.iter_mut().for_each(|p| p.x = -p.x);
    let (found, basis) = rig.find(&rig.names).expect("a person");
    assert_eq!(basis, SideBasis::AgainstNames);
    assert!(rig.places[found.legs[0].root()].x > 0.0 && rig.places[found.arms[0].root()].x > 0.0);
}

#[test]
fn the_pose_and_the_frame_do_not_matter() {
    let mut rig = Rig::new(&BIPED);
    let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::new(1.3, -0.4, 2.0));
    rig.places
        .iter_mut()
        .for_each(|p| *p = turn * *p * 39.37 + Vector3::new(5.0, -80.0, 3.0));
    rig.check(
        "Bip01 Spine",
        "Bip01 Head",
        [
            ["Bip01 L Thigh", "Bip01 L Calf", "Bip01 L Foot"],
            ["Bip01 L UpperArm", "Bip01 L Forearm", "Bip01 L Hand"],
        ],
        SideBasis::Both,
    );
}

#[test]
fn the_embedded_body_without_names_is_itself() {
    let template = embedded::template();
    let joints = template.skeleton().joints();
    let rig = Rig {
        names: joints.iter().map(|j| j.name.clone()).collect(),
        parents: joints.iter().map(|j| j.parent).collect(),
        places: joints.iter().map(|j| j.rest).collect(),
    };
    rig.check(
        "pelvis",
        "head",
        [
            ["left_hip", "left_knee", "left_ankle"],
            ["left_shoulder", "left_elbow", "left_wrist"],
        ],
        SideBasis::Both,
    );
}

#[test]
fn what_is_no_person_is_refused() {
    let rig = Rig::new(&[
        ("Hips", "", [0.0, 0.0, 0.0]),
        ("Spine", "Hips", [0.0, 10.0, 0.0]),
        ("Spine_end", "Spine", [0.0, 20.0, 0.0]),
    ]);
    let why = rig.find(&rig.names).expect_err("a spine");
    assert!(why.contains("legs") && why.contains("3 joints"), "{why}");
}
