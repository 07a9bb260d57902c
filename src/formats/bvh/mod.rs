//! Biovision hierarchies (BVH): a tree of joints and the channels of every frame.

mod hierarchy;
mod words;

use super::FormatError;
use super::image::read_limited;
use super::motion_clip::MotionClip;
use super::text_encoding::decode_text;
use hierarchy::{BvhJoint, Channel, hierarchy};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use std::path::Path;
use tryon_geometry::math::{P3d, V3d};
use words::Words;

/// Largest file, bytes; an hour at 120 Hz with 60 channels takes 250 MB as text.
const MAX_BYTES: u64 = 256 << 20;
/// Longest frame, seconds: above, the number is a rate.
const LONGEST: f64 = 1.0;
/// Position channel over its joint's offset, below which channels count from the offset, in the first frame.
const RELATIVE: f64 = 0.1;

/// Reads a BVH file.
///
/// # Errors
/// Names the line and the joint at fault.
pub(super) fn read_bvh(path: &Path) -> Result<MotionClip, FormatError> {
    parse_bvh(&decode_text(&read_limited(path, MAX_BYTES)?), path)
}

/// Reads BVH text; `origin` is named in errors.
///
/// # Errors
/// As [`read_bvh`].
pub(super) fn parse_bvh(text: &str, origin: &Path) -> Result<MotionClip, FormatError> {
    let mut w = Words::new(text, origin);
    let joints = hierarchy(&mut w)?;
    w.require("MOTION")?;
    let (stated, period) = header(&mut w)?;
    let mut notes = Vec::new();
    let roots: Vec<&str> = joints
        .iter()
        .filter(|j| j.parent.is_none())
        .map(|j| j.name.as_str())
        .collect();
    if roots.len() > 1 {
        notes.push(format!(
            "{} roots ({}): one of them is a person's",
            roots.len(),
            roots.join(", ")
        ));
    }
    let scaled = joints
        .iter()
        .filter(|j| j.channels.contains(&Channel::Scale));
    let scaled = scaled.count();
    if scaled > 0 {
        notes.push(format!(
            "scale channels of {scaled} joints left out: bones keep their lengths"
        ));
    }
    let mut values: Vec<Vec<f64>> = Vec::new();
    while values.len() < stated || !w.is_at_end() {
        let row = frame_values(&mut w, &joints, values.len(), stated)?;
        values.push(row);
    }
    if values.len() != stated {
        notes.push(format!(
            "{} frames, though `Frames:` states {stated}: all are read",
            values.len()
        ));
    }
    let is_relative = values
        .first()
        .is_some_and(|first| has_relative_positions(&joints, first));
    if is_relative {
        notes.push("position channels below the root count from the offsets".into());
    }
    let places = |row: &[f64]| places(&joints, row, is_relative);
    Ok(MotionClip {
        rest: rest(&joints),
        frames: values.iter().map(|row| places(row)).collect(),
        parents: joints.iter().map(|j| j.parent).collect(),
        names: joints.into_iter().map(|j| j.name).collect(),
        period,
        is_y_up: false,
        notes,
    })
}

/// Number of frames and frame time, seconds.
fn header(w: &mut Words<'_>) -> Result<(usize, f64), FormatError> {
    let what = "number of frames";
    let count = match w.key("Frames")? {
        Some(word) => w.to_count(word, what)?,
        None => w.count(what)?,
    };
    if count == 0 {
        return Err(w.fault("`Frames: 0`, expected at least one frame"));
    }
    let what = "frame time";
    let period = match w.key("Frame Time")? {
        Some(word) => w.to_number(word, what)?,
        None => w.number(what)?,
    };
    let is_rate = period > LONGEST && count > 1;
    if period <= 0.0 || is_rate {
        return Err(w.fault(format!(
            "frame time {period}, expected seconds a frame, above 0 and at most {LONGEST} (0.033333 for 30 frames a second)"
        )));
    }
    Ok((count, period))
}

/// Numbers of one frame in the order of the joints' channels.
fn frame_values(
    w: &mut Words<'_>,
    joints: &[BvhJoint],
    frame: usize,
    stated: usize,
) -> Result<Vec<f64>, FormatError> {
    let mut out = Vec::new();
    for joint in joints {
        for _ in &joint.channels {
            let value = w.number("channel").map_err(|e| match e {
                FormatError::Field { file, field, why } => {
                    let why = format!("frame {frame} of {stated}, joint `{}`: {why}", joint.name);
                    FormatError::Field { file, field, why }
                }
                other => other,
            })?;
            out.push(value);
        }
    }
    if out.is_empty() {
        return Err(w.fault("no joint has `CHANNELS`: nothing moves"));
    }
    Ok(out)
}

/// Position channels of joints below the root are nearly 0 where their offsets are not.
fn has_relative_positions(joints: &[BvhJoint], first: &[f64]) -> bool {
    let (mut relative, mut absolute) = (0usize, 0usize);
    let mut at = 0;
    for joint in joints {
        let row = &first[at..at + joint.channels.len()];
        at += row.len();
        if joint.parent.is_none() || !joint.is_placed() {
            continue;
        }
        let places = joint
            .channels
            .iter()
            .zip(row)
            .filter(|(c, _)| matches!(c, Channel::Position(_)));
        let moved = places.map(|(_, v)| v * v).sum::<f64>().sqrt();
        let offset = joint.offset.norm();
        if offset > 0.0 && moved < RELATIVE * offset {
            relative += 1;
        } else if offset > 0.0 {
            absolute += 1;
        }
    }
    relative > absolute
}

/// Positions of all joints in a frame. Position channels replace the offset, or are added to it below the root.
fn places(joints: &[BvhJoint], row: &[f64], is_relative: bool) -> Vec<P3d> {
    let mut global: Vec<Isometry3<f64>> = Vec::with_capacity(joints.len());
    let mut values = row.iter();
    for joint in joints {
        let (mut at, mut turn) = (joint.offset, UnitQuaternion::identity());
        for (channel, value) in joint.channels.iter().zip(values.by_ref()) {
            match *channel {
                Channel::Position(axis) if is_relative && joint.parent.is_some() => {
                    at[axis] += value
                }
                Channel::Position(axis) => at[axis] = *value,
                Channel::Rotation(axis) => {
                    let mut about = V3d::zeros();
                    about[axis] = value.to_radians();
                    turn *= UnitQuaternion::from_scaled_axis(about);
                }
                Channel::Scale => {}
            }
        }
        let local = Isometry3::from_parts(Translation3::from(at), turn);
        global.push(joint.parent.map_or(local, |p| global[p] * local));
    }
    global
        .iter()
        .map(|g| P3d::from(g.translation.vector))
        .collect()
}

/// Positions of all joints by their offsets alone.
fn rest(joints: &[BvhJoint]) -> Vec<P3d> {
    let mut out: Vec<P3d> = Vec::with_capacity(joints.len());
    for joint in joints {
        out.push(
            joint
                .parent
                .map_or(P3d::from(joint.offset), |p| out[p] + joint.offset),
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ARM: &str = "HIERARCHY\nROOT hip\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n JOINT arm\n {\n  OFFSET 1 0 0\n  CHANNELS 3 Zrotation Xrotation Yrotation\n  End Site\n  {\n   OFFSET 2 0 0\n  }\n }\n}\nMOTION\nFrames: 2\nFrame Time: 0.01\n0 1 0 0 0 0 90 0 0\n0 1 0 90 0 0 0 90 0\n";

    #[test]
    fn rotations_apply_in_the_order_of_the_channels() {
        let clip = parse_bvh(ARM, Path::new("a.bvh")).expect("reads");
        assert_eq!(clip.names, ["hip", "arm", "arm_end"]);
        let near =
            |p: P3d, x: f64, y: f64, z: f64| assert!((p - P3d::new(x, y, z)).norm() < 1e-12, "{p}");
        near(clip.frames[0][1], 1.0, 1.0, 0.0);
        near(clip.frames[0][2], 1.0, 3.0, 0.0);
        // The root's quarter turn about z lifts the arm; its own turn about x does not move a bone along x.
        near(clip.frames[1][1], 0.0, 2.0, 0.0);
        near(clip.frames[1][2], 0.0, 4.0, 0.0);
        assert!((clip.seconds() - 0.02).abs() < 1e-12);
    }

    #[test]
    fn faults_name_line_and_joint() {
        let fault = |text: &str| {
            parse_bvh(text, Path::new("a.bvh"))
                .expect_err("must be refused")
                .to_string()
        };
        let e = fault(&ARM.replace("0 1 0 90 0 0 0 90 0", "0 1 0 90 0 0 0 x 0"));
        assert!(
            e.contains("a.bvh")
                && e.contains("line 20")
                && e.contains("`arm`")
                && e.contains("frame 1"),
            "{e}"
        );
        assert!(
            fault(&ARM.replace("Yrotation\n  End", "Wrotation\n  End")).contains("`Wrotation`")
        );
        assert!(fault(&ARM[..ARM.find("CHANNELS").expect("there")]).contains("ends where"));
        assert!(fault(&ARM.replace("Time: 0.01", "Time: 0")).contains("frame time"));
        assert!(fault(&ARM.replace("Frames: 2", "Frames: 4000000000")).contains("ends where"));
    }

    /// As exporters write the same file.
    #[test]
    fn variants_of_the_text_are_the_same_clip() {
        let right = parse_bvh(ARM, Path::new("a.bvh")).expect("reads");
        for text in [
            format!("\u{feff}{ARM}"),
            ARM.replace('\n', "\r\n"),
            ARM.replace('\n', "\r"),
            ARM.replace("Frame Time: 0.01", "Frame Time:0.01"),
            ARM.replace("Frame Time: 0.01", "Frame Time :0.01"),
            ARM.replace("Frame Time: 0.01", "frame time\t:\t0.01"),
            ARM.replace("Frames: 2", "Frames:2"),
            ARM.replace("Frames: 2", "FRAMES 2"),
            ARM.replace("\n {", "{").replace("\n{", " {"),
            ARM.replace("End Site", "End Effector of the arm"),
            ARM.to_ascii_lowercase(),
        ] {
            let clip = parse_bvh(&text, Path::new("a.bvh")).expect(&text);
            assert_eq!(clip, right, "{text}");
        }
        let spaced = ARM
            .replace("ROOT hip", "ROOT Bip01 Hips")
            .replace("JOINT arm", "JOINT\tmixamorig:Left Arm");
        let clip = parse_bvh(&spaced, Path::new("a.bvh")).expect("reads");
        assert_eq!(
            clip.names,
            ["Bip01 Hips", "mixamorig:Left Arm", "mixamorig:Left Arm_end"]
        );
        assert_eq!((clip.frames, clip.period), (right.frames, right.period));
    }

    #[test]
    fn positions_of_every_joint_replace_offsets_or_count_from_them() {
        let with = |channels: &str, rows: [&str; 2]| {
            let text = ARM.replace("CHANNELS 3 Zrotation Xrotation Yrotation", channels);
            let text = text
                .replace("0 1 0 0 0 0 90 0 0", rows[0])
                .replace("0 1 0 90 0 0 0 90 0", rows[1]);
            parse_bvh(&text, Path::new("a.bvh")).expect("reads")
        };
        let right = parse_bvh(ARM, Path::new("a.bvh")).expect("reads");
        let six = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation";
        let placed = with(
            six,
            ["0 1 0 0 0 0 1 0 0 90 0 0", "0 1 0 90 0 0 1 0 0 0 90 0"],
        );
        assert_eq!((&placed.frames, placed.notes.len()), (&right.frames, 0));
        let relative = with(
            six,
            ["0 1 0 0 0 0 0 0 0 90 0 0", "0 1 0 90 0 0 0 0 0 0 90 0"],
        );
        assert_eq!(relative.frames, right.frames);
        assert!(relative.notes[0].contains("offsets"));
        // Other orders, and a joint without channels.
        let mixed = with(
            "CHANNELS 4 Zrotation Xposition Xrotation Yrotation",
            ["0 1 0 0 0 0 90 1 0 0", "0 1 0 90 0 0 0 1 90 0"],
        );
        assert_eq!(mixed.frames, right.frames);
        let fixed = with("CHANNELS 0", ["0 1 0 0 0 0", "0 1 0 90 0 0"]);
        assert!((fixed.frames[1][2] - P3d::new(0.0, 4.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn counts_rates_and_roots_are_said() {
        let read = |text: String| parse_bvh(&text, Path::new("a.bvh"));
        let more = read(ARM.replace("Frames: 2", "Frames: 1")).expect("reads");
        assert!(more.frames.len() == 2 && more.notes[0].contains("states 1"));
        for (text, words) in [
            (ARM.replace("Frames: 2", "Frames: 3"), "frame 2 of 3"),
            (ARM.replace("Frames: 2", "Frames: 0"), "at least one"),
            (ARM.replace("0.01", "30"), "seconds a frame"),
            (ARM.replace("0.01", "-1"), "seconds a frame"),
            (ARM.replace("0.01", "0,01"), "`0,01`"),
            (format!("{ARM}1 2 3\n"), "frame 2 of 2"),
        ] {
            let why = read(text).expect_err(words).to_string();
            assert!(why.contains(words) && why.contains("line "), "{why}");
        }
        let two = ARM.replace(
            "}\nMOTION",
            "}\nROOT prop\n{\nOFFSET 0 0 0\nCHANNELS 1 Xposition\n}\nMOTION",
        );
        let two = two
            .replace("0 1 0 0 0 0 90 0 0", "0 1 0 0 0 0 90 0 0 5")
            .replace("0 1 0 90 0 0 0 90 0", "0 1 0 90 0 0 0 90 0 6");
        let two = read(two).expect("reads");
        assert!(two.notes[0].contains("2 roots (hip, prop)"));
        assert_eq!((two.parents[3], two.frames[1][3].x), (None, 6.0));
    }

    #[test]
    fn the_rest_pose_is_told_from_the_motion() {
        let rest = ARM.replace("0 1 0 0 0 0 90 0 0", "0 1 0 45 0 30 0 0 0");
        let clip = |text: &str| parse_bvh(text, Path::new("a.bvh")).expect("reads");
        assert!(clip(&rest).first_is_rest() && !clip(ARM).first_is_rest());
        assert!(
            clip(&rest).statements()[0].contains(
                "2 frames of 0.0100 s (100.000 a second), its first frame is the rest pose"
            )
        );
    }

    proptest! {
        #[test]
        fn every_truncation_is_an_error(cut in 0usize..400) {
            if let Some(text) = ARM.get(..cut.min(ARM.len() - 4)) {
                prop_assert!(parse_bvh(text, Path::new("a.bvh")).is_err());
            }
        }
    }
}
