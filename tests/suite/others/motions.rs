//! Motions of other programs.

use tryon::body::human_joints::{HumanJoints, JointTree};
use tryon::formats::{MotionClip, read_motion, shared_data};
use tryon::geometry::math::P3d;
use tryon::synth::{Actor, Sequence, Setting};

fn report(file: &str) -> Option<MotionClip> {
    let path = shared_data("reports/bvh_variants")?.join(file);
    Some(read_motion(&path).expect(file))
}

/// A byte order mark, no space after `Frame Time:`, names with spaces: one spine of 10 units a bone, hips 95 up.
#[test]
fn text_variants_are_read() {
    for (file, hips) in [
        ("bom.bvh", "Hips"),
        ("frame_time_no_space.bvh", "Hips"),
        ("spaces.bvh", "Bip01 Hips"),
    ] {
        let Some(clip) = report(file) else { return };
        assert_eq!(
            (clip.names[0].as_str(), clip.frames.len()),
            (hips, 1),
            "{file}"
        );
        assert_eq!(
            clip.frames[0],
            [95.0, 105.0, 115.0].map(|y| P3d::new(0.0, y, 0.0)),
            "{file}"
        );
        assert_eq!(clip.period, 0.033_333);
    }
}

/// Mixamo's prefix: a person is found, by lengths alone too, and plays at the file's own rate.
#[test]
fn a_mixamo_clip_plays() {
    let Some(clip) = report("mixamorig.bvh") else {
        return;
    };
    let nameless: Vec<String> = vec![String::new(); clip.names.len()];
    for names in [&clip.names, &nameless] {
        let tree = JointTree {
            parents: &clip.parents,
            places: &clip.rest,
            names,
        };
        let found = HumanJoints::find(&tree).expect("a person");
        let named = |joint: usize| clip.names[joint].trim_start_matches("mixamorig:");
        let limbs = [&found.legs, &found.arms].map(|pair| {
            let mut names = pair
                .each_ref()
                .map(|l| [l.root(), l.hinge(), l.end()].map(named));
            names.sort();
            names
        });
        let leg = [
            ["LeftUpLeg", "LeftLeg", "LeftFoot"],
            ["RightUpLeg", "RightLeg", "RightFoot"],
        ];
        let arm = [
            ["LeftArm", "LeftForeArm", "LeftHand"],
            ["RightArm", "RightForeArm", "RightHand"],
        ];
        assert_eq!(limbs, [leg, arm]);
    }
    let (frames, period) = (clip.frames.len(), clip.period);
    let sequence = Sequence::new(Actor::default(), Setting::default());
    let sequence = sequence.with_clip(clip).expect("plays");
    let notes = sequence.clip_notes();
    assert!(
        notes[0].contains(&format!("{frames} frames of {period:.4} s")),
        "{notes:?}"
    );
    assert!(notes[0].contains("its first frame is"), "{notes:?}");
}
