//! Biovision hierarchies (BVH): a tree of joints and the channels of every frame.

use super::FormatError;
use super::image::read_limited;
use super::motion_clip::MotionClip;
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use std::path::Path;
use tryon_geometry::math::{P3d, V3d};

/// Largest file, bytes; an hour at 120 Hz with 60 channels takes 250 MB as text.
const MAX_BYTES: u64 = 256 << 20;
/// Most joints of a skeleton; larger trees are refused.
const MAX_JOINTS: usize = 1024;

/// Target of one number of a frame: position or rotation along an axis.
#[derive(Clone, Copy, Debug)]
enum Channel {
    Position(usize),
    Rotation(usize),
}

impl Channel {
    /// Channel of a word such as `Xposition` or `zrotation`.
    fn parse(word: &str) -> Option<Self> {
        let word = word.to_ascii_lowercase();
        let axis = b"xyz"
            .iter()
            .position(|a| word.bytes().next() == Some(*a))?;
        match &word[1..] {
            "position" => Some(Self::Position(axis)),
            "rotation" => Some(Self::Rotation(axis)),
            _ => None,
        }
    }
}

#[derive(Debug)]
struct BvhJoint {
    name: String,
    parent: Option<usize>,
    offset: V3d,
    channels: Vec<Channel>,
}

/// Words of the file with their line.
struct Words<'a> {
    path: &'a Path,
    words: Box<dyn Iterator<Item = (usize, &'a str)> + 'a>,
    line: usize,
}

impl<'a> Words<'a> {
    fn fault(&self, why: impl Into<String>) -> FormatError {
        FormatError::field(self.path, format!("line {}", self.line), why)
    }
    fn next(&mut self, what: &str) -> Result<&'a str, FormatError> {
        match self.words.next() {
            Some((line, word)) => {
                self.line = line;
                Ok(word)
            }
            None => Err(self.fault(format!("the file ends where {what} should be"))),
        }
    }
    fn require(&mut self, word: &str) -> Result<(), FormatError> {
        let got = self.next(&format!("`{word}`"))?;
        if got.eq_ignore_ascii_case(word) {
            Ok(())
        } else {
            Err(self.fault(format!("`{got}`, expected `{word}`")))
        }
    }
    fn number(&mut self, what: &str) -> Result<f64, FormatError> {
        let word = self.next(what)?;
        let value = word.parse::<f64>().ok().filter(|v| v.is_finite());
        value.ok_or_else(|| self.fault(format!("{what}: `{word}` is no finite number")))
    }
    fn count(&mut self, what: &str) -> Result<usize, FormatError> {
        let word = self.next(what)?;
        word.parse()
            .map_err(|_| self.fault(format!("{what}: `{word}` is no count")))
    }
}

/// Reads a BVH file.
///
/// # Errors
/// Names the line and the joint at fault.
pub(super) fn read_bvh(path: &Path) -> Result<MotionClip, FormatError> {
    parse_bvh(
        &String::from_utf8_lossy(&read_limited(path, MAX_BYTES)?),
        path,
    )
}

/// Reads BVH text; `origin` is named in errors.
///
/// # Errors
/// As [`read_bvh`].
pub(super) fn parse_bvh(text: &str, origin: &Path) -> Result<MotionClip, FormatError> {
    let words = text
        .lines()
        .enumerate()
        .flat_map(|(n, l)| l.split_whitespace().map(move |w| (n + 1, w)));
    let mut w = Words {
        path: origin,
        words: Box::new(words),
        line: 1,
    };
    w.require("HIERARCHY")?;
    w.require("ROOT")?;
    let joints = hierarchy(&mut w)?;
    w.require("MOTION")?;
    w.require("Frames:")?;
    let count = w.count("number of frames")?;
    w.require("Frame")?;
    w.require("Time:")?;
    let period = w.number("frame time")?;
    if period <= 0.0 {
        return Err(w.fault(format!(
            "frame time {period}, expected a positive number of seconds"
        )));
    }
    let mut frames = Vec::new();
    let mut global: Vec<Isometry3<f64>> = Vec::new();
    for frame in 0..count {
        global.clear();
        for j in &joints {
            let (mut at, mut turn) = (j.offset, UnitQuaternion::identity());
            for c in &j.channels {
                let value = w.number("channel").map_err(|e| match e {
                    FormatError::Field { file, field, why } => {
                        let why = format!("frame {frame} of {count}, joint `{}`: {why}", j.name);
                        FormatError::Field { file, field, why }
                    }
                    other => other,
                })?;
                match *c {
                    Channel::Position(axis) => at[axis] = value,
                    Channel::Rotation(axis) => {
                        let mut about = V3d::zeros();
                        about[axis] = value.to_radians();
                        turn *= UnitQuaternion::from_scaled_axis(about);
                    }
                }
            }
            let local = Isometry3::from_parts(Translation3::from(at), turn);
            global.push(j.parent.map_or(local, |p| global[p] * local));
        }
        frames.push(
            global
                .iter()
                .map(|g| P3d::from(g.translation.vector))
                .collect(),
        );
    }
    Ok(MotionClip {
        names: joints.into_iter().map(|j| j.name).collect(),
        frames,
        period,
    })
}

fn hierarchy(w: &mut Words<'_>) -> Result<Vec<BvhJoint>, FormatError> {
    let mut joints: Vec<BvhJoint> = Vec::new();
    let mut open: Vec<usize> = Vec::new();
    let mut name = w.next("the root's name")?.to_owned();
    loop {
        // `name` has just been read: its block follows.
        w.require("{")?;
        w.require("OFFSET")?;
        let offset = V3d::new(
            w.number("offset")?,
            w.number("offset")?,
            w.number("offset")?,
        );
        if joints.len() == MAX_JOINTS {
            return Err(w.fault(format!("more than {MAX_JOINTS} joints")));
        }
        joints.push(BvhJoint {
            name,
            parent: open.last().copied(),
            offset,
            channels: Vec::new(),
        });
        open.push(joints.len() - 1);
        name = loop {
            let word = w.next("`JOINT`, `End`, `CHANNELS` or `}`")?;
            let Some(&at) = open.last() else {
                return Err(w.fault("a `}` too many"));
            };
            match word.to_ascii_uppercase().as_str() {
                "CHANNELS" => {
                    for _ in 0..w.count("number of channels")?.min(7) {
                        let word = w.next("a channel")?;
                        let joint = &mut joints[at];
                        let fault = || format!("joint `{}`: no channel `{word}`", joint.name);
                        let channel = Channel::parse(word).ok_or_else(|| w.fault(fault()))?;
                        joint.channels.push(channel);
                    }
                }
                "JOINT" => break w.next("a joint's name")?.to_owned(),
                "END" => {
                    w.require("Site")?;
                    break format!("{}_end", joints[at].name);
                }
                "}" => {
                    open.pop();
                    if open.is_empty() {
                        return Ok(joints);
                    }
                }
                other => return Err(w.fault(format!("`{other}` in joint `{}`", joints[at].name))),
            }
        };
    }
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

    proptest! {
        #[test]
        fn every_truncation_is_an_error(cut in 0usize..400) {
            if let Some(text) = ARM.get(..cut.min(ARM.len() - 4)) {
                prop_assert!(parse_bvh(text, Path::new("a.bvh")).is_err());
            }
        }
    }
}
