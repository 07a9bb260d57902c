//! Joints of a BVH file: names, offsets and channels.

use super::words::Words;
use crate::FormatError;
use tryon_geometry::math::V3d;

/// Most joints of a file; larger trees are refused.
const MAX_JOINTS: usize = 1024;
/// Most channels of a joint: three positions, three rotations and three scales.
const MAX_CHANNELS: usize = 9;

/// Target of one number of a frame, with its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Channel {
    Position(usize),
    Rotation(usize),
    /// Left out: bones keep their lengths.
    Scale,
}

impl Channel {
    /// Channel of a word such as `Xposition` or `zrotation`.
    fn parse(word: &str) -> Option<Self> {
        let word = word.to_ascii_lowercase();
        let axis = b"xyz"
            .iter()
            .position(|a| word.bytes().next() == Some(*a))?;
        match &word[1..] {
            "position" | "translation" => Some(Self::Position(axis)),
            "rotation" => Some(Self::Rotation(axis)),
            "scale" | "scaling" => Some(Self::Scale),
            _ => None,
        }
    }
}

/// One joint, or end point.
#[derive(Debug)]
pub(super) struct BvhJoint {
    pub(super) name: String,
    pub(super) parent: Option<usize>,
    pub(super) offset: V3d,
    pub(super) channels: Vec<Channel>,
}

impl BvhJoint {
    fn new(name: String, parent: Option<usize>) -> Self {
        Self {
            name,
            parent,
            offset: V3d::zeros(),
            channels: Vec::new(),
        }
    }
    /// Its place is a channel.
    pub(super) fn is_placed(&self) -> bool {
        self.channels
            .iter()
            .any(|c| matches!(c, Channel::Position(_)))
    }
}

/// Reads `HIERARCHY` with all its roots, up to `MOTION`.
pub(super) fn hierarchy(w: &mut Words<'_>) -> Result<Vec<BvhJoint>, FormatError> {
    w.require("HIERARCHY")?;
    let mut joints: Vec<BvhJoint> = Vec::new();
    w.require("ROOT")?;
    root(w, &mut joints)?;
    while w
        .peek()
        .is_some_and(|word| word.eq_ignore_ascii_case("ROOT"))
    {
        w.require("ROOT")?;
        root(w, &mut joints)?;
    }
    Ok(joints)
}

/// One tree: from the root's name to its closing brace.
fn root(w: &mut Words<'_>, joints: &mut Vec<BvhJoint>) -> Result<(), FormatError> {
    let name = w.name("the root's name")?;
    joints.push(BvhJoint::new(name, None));
    w.require("{")?;
    let mut open = vec![joints.len() - 1];
    while let Some(&at) = open.last() {
        let word = w.next("`OFFSET`, `CHANNELS`, `JOINT`, `End Site` or `}`")?;
        match word.to_ascii_uppercase().as_str() {
            "OFFSET" => {
                for axis in 0..3 {
                    joints[at].offset[axis] =
                        w.number(&format!("joint `{}`: offset", joints[at].name))?;
                }
            }
            "CHANNELS" => channels(w, &mut joints[at])?,
            kind @ ("JOINT" | "END") => {
                let own = w.name("a joint's name")?;
                // End points have no name of their own.
                let name = match kind {
                    "END" => format!("{}_end", joints[at].name),
                    _ => own,
                };
                w.require("{")?;
                if joints.len() == MAX_JOINTS {
                    return Err(w.fault(format!("more than {MAX_JOINTS} joints")));
                }
                joints.push(BvhJoint::new(name, Some(at)));
                open.push(joints.len() - 1);
            }
            "}" => {
                open.pop();
            }
            _ => {
                let name = &joints[at].name;
                let expected = "expected `OFFSET`, `CHANNELS`, `JOINT`, `End Site` or `}`";
                return Err(w.fault(format!("`{word}` in joint `{name}`, {expected}")));
            }
        }
    }
    Ok(())
}

fn channels(w: &mut Words<'_>, joint: &mut BvhJoint) -> Result<(), FormatError> {
    let count = w.count(&format!("joint `{}`: number of channels", joint.name))?;
    if count > MAX_CHANNELS {
        return Err(w.fault(format!(
            "joint `{}`: {count} channels, at most {MAX_CHANNELS}",
            joint.name
        )));
    }
    for _ in 0..count {
        let word = w.next("a channel")?;
        let channel = Channel::parse(word).ok_or_else(|| {
            let expected =
                "expected Xposition, Yposition, Zposition, Xrotation, Yrotation or Zrotation";
            w.fault(format!(
                "joint `{}`: no channel `{word}`, {expected}",
                joint.name
            ))
        })?;
        joint.channels.push(channel);
    }
    Ok(())
}
