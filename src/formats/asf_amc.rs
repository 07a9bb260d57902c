//! Acclaim skeletons (ASF) and motions (AMC), the form of the CMU motion database.

use super::FormatError;
use super::image::read_limited;
use super::motion::MotionClip;
use crate::math::{P3d, V3d};
use nalgebra::UnitQuaternion;
use std::collections::BTreeMap;
use std::path::Path;

/// An hour at 120 Hz takes 350 MB as text; clips are minutes.
const MAX_BYTES: u64 = 256 << 20;
/// The database does not say its rate; it is 120 Hz throughout.
const PERIOD: f64 = 1.0 / 120.0;
/// An inch in metres: lengths are inches divided by the file's `length`.
const INCH: f64 = 0.0254;

#[derive(Clone, Debug)]
struct Bone {
    name: String,
    /// Index of the bone that this one hangs on.
    parent: usize,
    /// From its start to its end, metres, global axes in the rest pose.
    along: V3d,
    /// Orientation of its own axes.
    axis: UnitQuaternion<f64>,
    /// Axis of each number in a frame.
    dof: Vec<usize>,
}

#[derive(Clone, Debug)]
struct Skeleton {
    /// Bone 0 is the root, without length.
    bones: Vec<Bone>,
    /// Translations (`true`) and rotations of the root, with their axis.
    root: Vec<(bool, usize)>,
    scale: f64,
    degrees: bool,
}

fn fault(path: &Path, line: usize, why: impl Into<String>) -> FormatError {
    FormatError::field(path, format!("line {}", line + 1), why)
}

fn number(path: &Path, line: usize, what: &str, word: Option<&str>) -> Result<f64, FormatError> {
    let text = word.ok_or_else(|| fault(path, line, format!("{what}: a number is missing")))?;
    let value = text.parse::<f64>().ok().filter(|v| v.is_finite());
    value.ok_or_else(|| fault(path, line, format!("{what}: `{text}` is no finite number")))
}

/// Angles about x, y, z, applied in that order about fixed axes.
fn euler(angles: V3d) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(angles.x, angles.y, angles.z)
}

fn axis_of(letter: Option<u8>) -> Option<usize> {
    letter.and_then(|l| b"xyz".iter().position(|a| *a == l.to_ascii_lowercase()))
}

fn parse_asf(text: &str, path: &Path) -> Result<Skeleton, FormatError> {
    let mut s = Skeleton {
        bones: Vec::new(),
        root: Vec::new(),
        scale: INCH,
        degrees: true,
    };
    let blank = |name: &str| Bone {
        name: name.into(),
        parent: 0,
        along: V3d::zeros(),
        axis: UnitQuaternion::identity(),
        dof: Vec::new(),
    };
    s.bones.push(blank("root"));
    let (mut section, mut bone) = ("", None::<(Bone, V3d, f64)>);
    let (mut seen, mut parents) = (false, Vec::new());
    for (n, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        if let Some(name) = line.strip_prefix(':') {
            section = name.split_whitespace().next().unwrap_or_default();
            continue;
        }
        let mut words = line.split_whitespace();
        let key = words.next().unwrap_or_default();
        match (section, key) {
            ("units", "length") => {
                let length = number(path, n, "length", words.next())?;
                if length <= 0.0 {
                    return Err(fault(
                        path,
                        n,
                        format!("length {length}, expected a positive number"),
                    ));
                }
                s.scale = INCH / length;
            }
            ("units", "angle") => s.degrees = words.next() != Some("rad"),
            ("root", "order") => {
                for word in words {
                    let axis = axis_of(word.as_bytes().get(1).copied());
                    let axis =
                        axis.ok_or_else(|| fault(path, n, format!("root: no channel `{word}`")))?;
                    s.root.push((word.starts_with(['T', 't']), axis));
                }
            }
            ("bonedata", "begin") => bone = Some((blank(""), V3d::zeros(), 0.0)),
            ("bonedata", "end") => {
                let (mut b, direction, length) = bone
                    .take()
                    .ok_or_else(|| fault(path, n, "`end` without `begin`"))?;
                b.along = direction * (length * s.scale);
                if b.name.is_empty() || s.bones.iter().any(|o| o.name == b.name) {
                    return Err(fault(
                        path,
                        n,
                        format!("bone `{}`: its name is missing or used twice", b.name),
                    ));
                }
                s.bones.push(b);
            }
            ("bonedata", _) => {
                let Some((b, direction, length)) = &mut bone else {
                    continue;
                };
                match key {
                    "name" => b.name = words.next().unwrap_or_default().into(),
                    "direction" => {
                        for c in direction.iter_mut() {
                            *c = number(
                                path,
                                n,
                                &format!("bone `{}`: direction", b.name),
                                words.next(),
                            )?;
                        }
                    }
                    "length" => {
                        *length =
                            number(path, n, &format!("bone `{}`: length", b.name), words.next())?
                    }
                    "axis" => {
                        let mut a = V3d::zeros();
                        for c in a.iter_mut() {
                            *c =
                                number(path, n, &format!("bone `{}`: axis", b.name), words.next())?;
                        }
                        b.axis = euler(if s.degrees { a.map(f64::to_radians) } else { a });
                    }
                    "dof" => {
                        for word in words {
                            let axis = axis_of(word.as_bytes().get(1).copied())
                                .filter(|_| word.starts_with('r'));
                            let axis = axis.ok_or_else(|| {
                                fault(path, n, format!("bone `{}`: no dof `{word}`", b.name))
                            })?;
                            b.dof.push(axis);
                        }
                    }
                    _ => {}
                }
            }
            ("hierarchy", "begin" | "end") => seen = true,
            ("hierarchy", parent) => {
                let find = |name: &str| {
                    let at = s.bones.iter().position(|b| b.name == name);
                    at.ok_or_else(|| fault(path, n, format!("no bone `{name}`")))
                };
                let parent = find(parent)?;
                for child in words {
                    parents.push((find(child)?, parent, n));
                }
            }
            _ => {}
        }
    }
    if !seen || s.bones.len() < 2 {
        return Err(FormatError::field(
            path,
            "hierarchy",
            "no bones: not an ASF file, or cut short",
        ));
    }
    // Bones in an order in which parents come first.
    let mut order = vec![0];
    let mut at = 0;
    while at < order.len() {
        let children = parents
            .iter()
            .filter(|(_, p, _)| *p == order[at])
            .map(|(c, ..)| *c)
            .collect::<Vec<_>>();
        if let Some(&c) = children.iter().find(|c| order.contains(c)) {
            return Err(FormatError::field(
                path,
                "hierarchy",
                format!("bone `{}` has two parents", s.bones[c].name),
            ));
        }
        order.extend(children);
        at += 1;
    }
    let place = |old: usize| order.iter().position(|o| *o == old).unwrap_or(0);
    let bones = order
        .iter()
        .map(|&o| {
            let parent = parents
                .iter()
                .find(|(c, ..)| *c == o)
                .map_or(0, |(_, p, _)| place(*p));
            Bone {
                parent,
                ..s.bones[o].clone()
            }
        })
        .collect();
    Ok(Skeleton { bones, ..s })
}

/// Reads a skeleton and a motion of it. Positions in metres; a joint is where a bone starts, `NAME_end` where the
/// last bone of a chain ends.
///
/// # Errors
/// Names file, line and bone.
pub fn read_asf_amc(asf: &Path, amc: &Path) -> Result<MotionClip, FormatError> {
    let text =
        |p: &Path| read_limited(p, MAX_BYTES).map(|b| String::from_utf8_lossy(&b).into_owned());
    parse_asf_amc(&text(asf)?, asf, &text(amc)?, amc)
}

/// As [`read_asf_amc`] on text; the paths are named in errors.
///
/// # Errors
/// As [`read_asf_amc`].
pub fn parse_asf_amc(
    asf: &str,
    asf_path: &Path,
    amc: &str,
    amc_path: &Path,
) -> Result<MotionClip, FormatError> {
    let s = parse_asf(asf, asf_path)?;
    let index: BTreeMap<&str, usize> = s
        .bones
        .iter()
        .enumerate()
        .map(|(i, b)| (b.name.as_str(), i))
        .collect();
    let mut names: Vec<String> = s.bones.iter().map(|b| b.name.clone()).collect();
    let last: Vec<usize> = (1..s.bones.len())
        .filter(|i| s.bones.iter().skip(1).all(|b| b.parent != *i))
        .collect();
    names.extend(last.iter().map(|&i| format!("{}_end", s.bones[i].name)));

    let mut clip = MotionClip {
        names,
        frames: Vec::new(),
        period: PERIOD,
    };
    let mut turns: Vec<V3d> = Vec::new();
    let mut origin = V3d::zeros();
    let mut open = false;
    for (n, line) in amc.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with(['#', ':']) {
            continue;
        }
        let mut words = line.split_whitespace();
        let key = words.next().unwrap_or_default();
        if key.bytes().all(|b| b.is_ascii_digit()) {
            if open {
                clip.frames.push(positions(&s, &last, &turns, origin));
            }
            (turns, open) = (vec![V3d::zeros(); s.bones.len()], true);
            continue;
        }
        if !open {
            return Err(fault(
                amc_path,
                n,
                format!("`{key}` before the first frame number"),
            ));
        }
        let &bone = index
            .get(key)
            .ok_or_else(|| fault(amc_path, n, format!("no bone `{key}` in the skeleton")))?;
        let what = format!("frame {}, bone `{key}`", clip.frames.len() + 1);
        let angle = |v: f64| if s.degrees { v.to_radians() } else { v };
        if bone == 0 {
            for (is_shift, axis) in &s.root {
                let v = number(amc_path, n, &what, words.next())?;
                if *is_shift {
                    origin[*axis] = v * s.scale;
                } else {
                    turns[0][*axis] = angle(v);
                }
            }
        } else {
            for &axis in &s.bones[bone].dof {
                turns[bone][axis] = angle(number(amc_path, n, &what, words.next())?);
            }
        }
    }
    if open {
        clip.frames.push(positions(&s, &last, &turns, origin));
    }
    if clip.frames.is_empty() {
        return Err(FormatError::field(
            amc_path,
            "frames",
            "none: not an AMC file, or cut short",
        ));
    }
    Ok(clip)
}

/// Starts of all bones, then the ends of the last ones.
fn positions(s: &Skeleton, last: &[usize], turns: &[V3d], origin: V3d) -> Vec<P3d> {
    let mut global: Vec<UnitQuaternion<f64>> = Vec::with_capacity(s.bones.len());
    let mut ends: Vec<P3d> = Vec::with_capacity(s.bones.len());
    let mut out = Vec::with_capacity(s.bones.len() + last.len());
    for (i, b) in s.bones.iter().enumerate() {
        let local = b.axis * euler(turns[i]) * b.axis.inverse();
        let (turn, start) = if i == 0 {
            (local, P3d::from(origin))
        } else {
            (global[b.parent] * local, ends[b.parent])
        };
        global.push(turn);
        ends.push(start + turn * b.along);
        out.push(start);
    }
    out.extend(last.iter().map(|&i| ends[i]));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::read_motion;
    use std::path::PathBuf;

    const ASF: &str = ":version 1.10\n:units\n length 0.0254\n angle deg\n:root\n order TX TY TZ RX RY RZ\n:bonedata\n begin\n  id 1\n  name thigh\n  direction 0 -1 0\n  length 2\n  axis 0 0 90 XYZ\n  dof rx\n end\n begin\n  id 2\n  name shin\n  direction 0 -1 0\n  length 1\n  axis 0 0 0 XYZ\n  dof rz\n end\n:hierarchy\n begin\n  root thigh\n  thigh shin\n end\n";

    fn parse(asf: &str, amc: &str) -> Result<MotionClip, FormatError> {
        parse_asf_amc(asf, Path::new("s.asf"), amc, Path::new("s.amc"))
    }

    #[test]
    fn bones_turn_about_their_own_axes() {
        let amc = ":DEGREES\n1\nroot 1 2 3 0 0 0\nthigh 0\nshin 90\n2\nroot 0 0 0 0 90 0\nthigh 90\nshin 0\n";
        let clip = parse(ASF, amc).expect("reads");
        assert_eq!(clip.names, ["root", "thigh", "shin", "shin_end"]);
        let near =
            |p: P3d, x: f64, y: f64, z: f64| assert!((p - P3d::new(x, y, z)).norm() < 1e-9, "{p}");
        near(clip.frames[0][2], 1.0, 0.0, 3.0);
        near(clip.frames[0][3], 2.0, 0.0, 3.0);
        // The thigh's own x axis is the global y axis: it does not swing, only twists.
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
    fn shared_clips_are_people() {
        let root = std::env::var_os("TRYON_SHARED")
            .map_or_else(
                || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"),
                PathBuf::from,
            )
            .join("data/motion");
        if !root.exists() {
            assert!(
                std::env::var_os("TRYON_REQUIRE_ALL").is_none(),
                "{} is missing",
                root.display()
            );
            eprintln!("SKIPPED: {} is missing", root.display());
            return;
        }
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
                // Bones keep their lengths, and the shank is about as long as the thigh.
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
