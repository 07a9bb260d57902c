//! Acclaim skeletons (ASF) and motions (AMC), the form of the CMU motion database.

use super::FormatError;
use super::image::read_limited;
use super::motion_clip::{CMU_PERIOD, MotionClip};
use super::text_encoding::decode_text;
use nalgebra::UnitQuaternion;
use std::collections::BTreeMap;
use std::path::Path;
use std::str::SplitWhitespace;
use tryon_geometry::math::{P3d, V3d};

/// Largest file, bytes. An hour at 120 Hz takes 350 MB as text; clips are minutes.
const MAX_BYTES: u64 = 256 << 20;
/// An inch in metres: lengths are inches divided by the file's `length`.
const INCH: f64 = 0.0254;

#[derive(Clone, Debug)]
struct AsfBone {
    name: String,
    /// Index of the parent bone.
    parent: usize,
    /// From its start to its end, metres, global axes in the rest pose.
    along: V3d,
    /// Orientation of its own axes.
    axis: UnitQuaternion<f64>,
    /// Axis of each number in a frame.
    dof: Vec<usize>,
}

impl AsfBone {
    fn new(name: &str) -> Self {
        Self {
            name: name.into(),
            parent: 0,
            along: V3d::zeros(),
            axis: UnitQuaternion::identity(),
            dof: Vec::new(),
        }
    }
}

#[derive(Clone, Debug)]
struct AsfSkeleton {
    /// Bone 0 is the root, without length. Parents come first.
    bones: Vec<AsfBone>,
    /// Translations (`true`) and rotations of the root, with their axis.
    root: Vec<(bool, usize)>,
    scale: f64,
    degrees: bool,
}

impl AsfSkeleton {
    fn angle(&self, value: f64) -> f64 {
        if self.degrees {
            value.to_radians()
        } else {
            value
        }
    }
}

/// Words of one line, with file and line for errors.
struct AsfLine<'a> {
    path: &'a Path,
    /// From zero.
    number: usize,
    words: SplitWhitespace<'a>,
}

impl<'a> AsfLine<'a> {
    fn fault(&self, why: impl Into<String>) -> FormatError {
        FormatError::field(self.path, format!("line {}", self.number + 1), why)
    }
    fn word(&mut self) -> &'a str {
        self.words.next().unwrap_or_default()
    }
    fn float(&mut self, what: &str) -> Result<f64, FormatError> {
        let text = self.words.next();
        let text = text.ok_or_else(|| self.fault(format!("{what}: a number is missing")))?;
        let value = text.parse::<f64>().ok().filter(|v| v.is_finite());
        value.ok_or_else(|| self.fault(format!("{what}: `{text}` is no finite number")))
    }
    fn vector(&mut self, what: &str) -> Result<V3d, FormatError> {
        Ok(V3d::new(
            self.float(what)?,
            self.float(what)?,
            self.float(what)?,
        ))
    }
}

/// Takes the order of axes at the end of a line: XYZ, or none.
///
/// # Errors
/// Another order.
fn require_order(line: &mut AsfLine<'_>, what: &str) -> Result<(), FormatError> {
    match line.words.next() {
        Some(order) if !order.eq_ignore_ascii_case("xyz") => {
            Err(line.fault(format!("{what}: order `{order}`, expected XYZ")))
        }
        _ => Ok(()),
    }
}

/// Rotation by angles about the fixed axes x, y, z, applied in that order.
fn euler(angles: V3d) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(angles.x, angles.y, angles.z)
}

/// Axis of a channel such as `TX` or `rz`.
fn axis_of(channel: &str) -> Option<usize> {
    let letter = channel.as_bytes().get(1)?.to_ascii_lowercase();
    b"xyz".iter().position(|a| *a == letter)
}

/// Bone between `begin` and `end`.
struct OpenBone {
    bone: AsfBone,
    direction: V3d,
    /// File units.
    length: f64,
}

/// Parser of an ASF file, line by line.
struct AsfParser {
    skeleton: AsfSkeleton,
    open: Option<OpenBone>,
    /// Child and parent, indices into the bones of the file.
    links: Vec<(usize, usize)>,
    has_hierarchy: bool,
}

impl AsfParser {
    fn line(&mut self, section: &str, line: &mut AsfLine<'_>) -> Result<(), FormatError> {
        let key = line.word();
        match (section, key) {
            ("units", "length") => {
                let length = line.float("length")?;
                if length <= 0.0 {
                    return Err(line.fault(format!("length {length}, expected a positive number")));
                }
                self.skeleton.scale = INCH / length;
            }
            ("units", "angle") => self.skeleton.degrees = line.words.next() != Some("rad"),
            ("root", "order") => {
                while let Some(word) = line.words.next() {
                    let axis = axis_of(word)
                        .ok_or_else(|| line.fault(format!("root: no channel `{word}`")))?;
                    let is_translation = word.starts_with(['T', 't']);
                    self.skeleton.root.push((is_translation, axis));
                }
            }
            ("root", "axis") => require_order(line, "root: axis")?,
            ("bonedata", "begin") => {
                self.open = Some(OpenBone {
                    bone: AsfBone::new(""),
                    direction: V3d::zeros(),
                    length: 0.0,
                });
            }
            ("bonedata", "end") => self.end_bone(line)?,
            ("bonedata", _) => self.bone_field(key, line)?,
            ("hierarchy", "begin" | "end") => self.has_hierarchy = true,
            ("hierarchy", parent) => {
                let parent = self.find(parent, line)?;
                while let Some(child) = line.words.next() {
                    self.links.push((self.find(child, line)?, parent));
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn find(&self, name: &str, line: &AsfLine<'_>) -> Result<usize, FormatError> {
        let at = self.skeleton.bones.iter().position(|b| b.name == name);
        at.ok_or_else(|| line.fault(format!("no bone `{name}`")))
    }

    fn bone_field(&mut self, key: &str, line: &mut AsfLine<'_>) -> Result<(), FormatError> {
        let Some(open) = &mut self.open else {
            return Ok(());
        };
        let name = open.bone.name.clone();
        match key {
            "name" => open.bone.name = line.word().into(),
            "direction" => open.direction = line.vector(&format!("bone `{name}`: direction"))?,
            "length" => open.length = line.float(&format!("bone `{name}`: length"))?,
            "axis" => {
                let angles = line.vector(&format!("bone `{name}`: axis"))?;
                require_order(line, &format!("bone `{name}`: axis"))?;
                open.bone.axis = euler(angles.map(|a| self.skeleton.angle(a)));
            }
            "dof" => {
                while let Some(word) = line.words.next() {
                    let axis = axis_of(word).filter(|_| word.starts_with(['r', 'R']));
                    let axis =
                        axis.ok_or_else(|| line.fault(format!("bone `{name}`: no dof `{word}`")))?;
                    open.bone.dof.push(axis);
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn end_bone(&mut self, line: &AsfLine<'_>) -> Result<(), FormatError> {
        let open = self.open.take();
        let open = open.ok_or_else(|| line.fault("`end` without `begin`"))?;
        let mut bone = open.bone;
        bone.along = open.direction * (open.length * self.skeleton.scale);
        let bones = &mut self.skeleton.bones;
        if bone.name.is_empty() || bones.iter().any(|o| o.name == bone.name) {
            let why = format!("bone `{}`: its name is missing or used twice", bone.name);
            return Err(line.fault(why));
        }
        bones.push(bone);
        Ok(())
    }

    /// Sorts the bones so that parents come first.
    fn finish(self, path: &Path) -> Result<AsfSkeleton, FormatError> {
        let fault = |why: String| FormatError::field(path, "hierarchy", why);
        let Self {
            skeleton, links, ..
        } = self;
        if !self.has_hierarchy || skeleton.bones.len() < 2 {
            return Err(fault("no bones: not an ASF file, or cut short".into()));
        }
        let mut order = vec![0];
        let mut at = 0;
        while at < order.len() {
            let children = links.iter().filter(|(_, parent)| *parent == order[at]);
            let children: Vec<usize> = children.map(|(child, _)| *child).collect();
            if let Some(&c) = children.iter().find(|c| order.contains(c)) {
                let name = &skeleton.bones[c].name;
                return Err(fault(format!("bone `{name}` has two parents")));
            }
            order.extend(children);
            at += 1;
        }
        let new_index = |old: usize| order.iter().position(|o| *o == old).unwrap_or(0);
        let sorted = |old: &usize| {
            let link = links.iter().find(|(child, _)| child == old);
            AsfBone {
                parent: link.map_or(0, |(_, parent)| new_index(*parent)),
                ..skeleton.bones[*old].clone()
            }
        };
        let bones = order.iter().map(sorted).collect();
        Ok(AsfSkeleton { bones, ..skeleton })
    }
}

/// Reads an ASF skeleton.
fn parse_asf(text: &str, path: &Path) -> Result<AsfSkeleton, FormatError> {
    let mut parser = AsfParser {
        skeleton: AsfSkeleton {
            bones: vec![AsfBone::new("root")],
            root: Vec::new(),
            scale: INCH,
            degrees: true,
        },
        open: None,
        links: Vec::new(),
        has_hierarchy: false,
    };
    let mut section = "";
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        if let Some(name) = line.strip_prefix(':') {
            section = name.split_whitespace().next().unwrap_or_default();
            continue;
        }
        let words = line.split_whitespace();
        let mut line = AsfLine {
            path,
            number,
            words,
        };
        parser.line(section, &mut line)?;
    }
    parser.finish(path)
}

/// Reads a skeleton and its motion. Positions in metres; a joint is the start of a bone, `NAME_end` the end of the last
/// bone of a chain.
///
/// # Errors
/// Names file, line and bone.
pub(super) fn read_asf_amc(asf: &Path, amc: &Path) -> Result<MotionClip, FormatError> {
    let text = |p: &Path| read_limited(p, MAX_BYTES).map(|b| decode_text(&b).into_owned());
    parse_asf_amc(&text(asf)?, asf, &text(amc)?, amc)
}

/// Parses a skeleton and its motion; the paths are named in errors.
///
/// # Errors
/// As [`read_asf_amc`].
fn parse_asf_amc(
    asf: &str,
    asf_path: &Path,
    amc: &str,
    amc_path: &Path,
) -> Result<MotionClip, FormatError> {
    let s = parse_asf(asf, asf_path)?;
    let names = s.bones.iter().enumerate();
    let index: BTreeMap<&str, usize> = names.map(|(i, b)| (b.name.as_str(), i)).collect();
    let leaves: Vec<usize> = (1..s.bones.len())
        .filter(|i| s.bones.iter().skip(1).all(|b| b.parent != *i))
        .collect();

    let mut frames = Vec::new();
    let mut pose: Option<AmcPose> = None;
    let mut origin = V3d::zeros();
    for (number, line) in amc.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with(['#', ':']) {
            continue;
        }
        let mut line = AsfLine {
            path: amc_path,
            number,
            words: line.split_whitespace(),
        };
        let key = line.word();
        if key.bytes().all(|b| b.is_ascii_digit()) {
            if let Some(p) = pose.take() {
                origin = p.origin;
                frames.push(p.positions(&s, &leaves));
            }
            pose = Some(AmcPose {
                angles: vec![V3d::zeros(); s.bones.len()],
                origin,
            });
            continue;
        }
        let Some(pose) = &mut pose else {
            return Err(line.fault(format!("`{key}` before the first frame number")));
        };
        let bone = index.get(key);
        let bone = bone.ok_or_else(|| line.fault(format!("no bone `{key}` in the skeleton")))?;
        let what = format!("frame {}, bone `{key}`", frames.len() + 1);
        pose.read_bone(&s, *bone, &mut line, &what)?;
    }
    frames.extend(pose.map(|p| p.positions(&s, &leaves)));
    if frames.is_empty() {
        let why = "none: not an AMC file, or cut short";
        return Err(FormatError::field(amc_path, "frames", why));
    }
    let mut names: Vec<String> = s.bones.iter().map(|b| b.name.clone()).collect();
    names.extend(leaves.iter().map(|&i| format!("{}_end", s.bones[i].name)));
    let parents = (0..s.bones.len()).map(|i| (i > 0).then(|| s.bones[i].parent));
    let rest = AmcPose {
        angles: vec![V3d::zeros(); s.bones.len()],
        origin: V3d::zeros(),
    };
    Ok(MotionClip {
        names,
        parents: parents.chain(leaves.iter().map(|i| Some(*i))).collect(),
        rest: rest.positions(&s, &leaves),
        frames,
        period: CMU_PERIOD,
        is_y_up: false,
        notes: vec!["AMC states no frame rate: 120 a second, as the CMU database".into()],
    })
}

/// Pose of one AMC frame.
struct AmcPose {
    /// Angles of each bone about its own axes, radians.
    angles: Vec<V3d>,
    /// Position of the root, metres.
    origin: V3d,
}

impl AmcPose {
    fn read_bone(
        &mut self,
        s: &AsfSkeleton,
        bone: usize,
        line: &mut AsfLine<'_>,
        what: &str,
    ) -> Result<(), FormatError> {
        if bone == 0 {
            for (is_translation, axis) in &s.root {
                let v = line.float(what)?;
                if *is_translation {
                    self.origin[*axis] = v * s.scale;
                } else {
                    self.angles[0][*axis] = s.angle(v);
                }
            }
        } else {
            for &axis in &s.bones[bone].dof {
                self.angles[bone][axis] = s.angle(line.float(what)?);
            }
        }
        Ok(())
    }

    /// Starts of all bones, then the ends of the leaves, metres.
    fn positions(&self, s: &AsfSkeleton, leaves: &[usize]) -> Vec<P3d> {
        let mut global: Vec<UnitQuaternion<f64>> = Vec::with_capacity(s.bones.len());
        let mut ends: Vec<P3d> = Vec::with_capacity(s.bones.len());
        let mut out = Vec::with_capacity(s.bones.len() + leaves.len());
        for (i, b) in s.bones.iter().enumerate() {
            let local = b.axis * euler(self.angles[i]) * b.axis.inverse();
            let (rotation, start) = if i == 0 {
                (local, P3d::from(self.origin))
            } else {
                (global[b.parent] * local, ends[b.parent])
            };
            global.push(rotation);
            ends.push(start + rotation * b.along);
            out.push(start);
        }
        out.extend(leaves.iter().map(|&i| ends[i]));
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read_motion;

    const ASF: &str = ":version 1.10\n:units\n length 0.0254\n angle deg\n:root\n order TX TY TZ RX RY RZ\n:bonedata\n begin\n  id 1\n  name thigh\n  direction 0 -1 0\n  length 2\n  axis 0 0 90 XYZ\n  dof rx\n end\n begin\n  id 2\n  name shin\n  direction 0 -1 0\n  length 1\n  axis 0 0 0 XYZ\n  dof rz\n end\n:hierarchy\n begin\n  root thigh\n  thigh shin\n end\n";

    fn parse(asf: &str, amc: &str) -> Result<MotionClip, FormatError> {
        parse_asf_amc(asf, Path::new("s.asf"), amc, Path::new("s.amc"))
    }

    #[test]
    fn bones_rotate_about_their_own_axes() {
        let amc = ":DEGREES\n1\nroot 1 2 3 0 0 0\nthigh 0\nshin 90\n2\nroot 0 0 0 0 90 0\nthigh 90\nshin 0\n";
        let clip = parse(ASF, amc).expect("reads");
        assert_eq!(clip.names, ["root", "thigh", "shin", "shin_end"]);
        let near =
            |p: P3d, x: f64, y: f64, z: f64| assert!((p - P3d::new(x, y, z)).norm() < 1e-9, "{p}");
        near(clip.frames[0][2], 1.0, 0.0, 3.0);
        near(clip.frames[0][3], 2.0, 0.0, 3.0);
        // The thigh's own x axis is the global y axis: it only twists.
        near(clip.frames[1][2], 0.0, -2.0, 0.0);
    }

    #[test]
    fn faults_name_line_and_bone() {
        let fault =
            |asf: &str, amc: &str| parse(asf, amc).expect_err("must be refused").to_string();
        let e = fault(ASF, "1\nroot 0 0 0 0 0 0\nthigh x\n");
        assert!(
            e.contains("s.amc") && e.contains("line 3") && e.contains("`thigh`"),
            "{e}"
        );
        assert!(fault(ASF, "1\narm 3\n").contains("no bone `arm`"));
        assert!(fault(ASF, "1\nroot 0 0\n").contains("missing"));
        assert!(fault(ASF, "").contains("`frames`"));
        assert!(
            fault(&ASF.replace("thigh shin\n", "thigh arm\n"), "1\n").contains("no bone `arm`")
        );
        assert!(fault(&ASF.replace("length 2", "length NaN"), "1\n").contains("`thigh`"));
        assert!(fault(&ASF[..ASF.find(":root").expect("there")], "1\n").contains("`hierarchy`"));
        assert!(
            fault(
                &ASF.replace("  thigh shin\n", "  thigh shin thigh\n"),
                "1\n"
            )
            .contains("two parents")
        );
    }

    #[test]
    fn shared_clips_keep_bone_lengths_and_human_proportions() {
        let Some(root) = crate::shared_data("motion") else {
            return;
        };
        for (file, frames, names) in [
            ("cmu_asf_amc/02_07.amc", 0, ["lfemur", "ltibia", "lfoot"]),
            ("cmu_asf_amc/93_04.amc", 0, ["lfemur", "ltibia", "lfoot"]),
            (
                "cmu_bvh/02_02_makehuman.bvh",
                299,
                ["lThigh", "lShin", "lFoot"],
            ),
            ("cmu_bvh/02_03.bvh", 174, ["lhip", "lknee", "lfoot"]),
        ] {
            let clip = read_motion(&root.join(file)).expect(file);
            assert!(
                clip.frames.len() == frames || frames == 0 && clip.frames.len() > 100,
                "{file}"
            );
            let [hip, knee, ankle] = names.map(|n| clip.joint(&[n]).expect(n));
            for f in clip.frames.iter().step_by(20) {
                // Bones keep their lengths; the shank is about as long as the thigh.
                let (a, b) = ((f[hip] - f[knee]).norm(), (f[knee] - f[ankle]).norm());
                let first = &clip.frames[0];
                assert!(
                    ((first[hip] - first[knee]).norm() - a).abs() < 1e-6 * a,
                    "{file}"
                );
                assert!((0.8..1.4).contains(&(a / b)), "{file}: {a} {b}");
            }
        }
    }
}
