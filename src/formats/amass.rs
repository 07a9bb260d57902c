//! Motions of the AMASS data set (Mahmood et al. 2019): rotations of SMPL's joints a frame, in an npz.
//!
//! The files have no body. Positions come from a figure of mean proportions (Drillis and Contini 1966) in SMPL's rest pose,
//! arms level and legs straight: bones point as the file says within the few degrees that SMPL's own rest differs.

use super::FormatError;
use super::motion_clip::MotionClip;
use super::npz::SMPL_JOINT_NAMES;
use super::npz_file::NpzFile;
use nalgebra::UnitQuaternion;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use tryon_geometry::math::{P3d, V3d};

/// Joints that SMPL, SMPL+H and SMPL-X share, and that are read: trunk and limbs to the wrists.
const BODY: usize = 22;
/// Numbers a joint: a rotation vector.
const NUMBERS: usize = 3;
/// Names of the frame rate in the data set's two generations.
const RATES: [&str; 2] = ["mocap_framerate", "mocap_frame_rate"];
/// Widths of `poses`: SMPL, SMPL+H, SMPL-X.
const WIDTHS: [usize; 3] = [72, 156, 165];
/// Stature of the figure, metres.
const STATURE: f64 = 1.7;

/// Parent and offset from it of each joint, in statures.
const FIGURE: [(Option<usize>, [f64; 3]); BODY] = [
    (None, [0.0, 0.0, 0.0]),
    (Some(0), [0.053, -0.045, 0.0]),
    (Some(0), [-0.053, -0.045, 0.0]),
    (Some(0), [0.0, 0.065, -0.01]),
    (Some(1), [0.0, -0.245, 0.0]),
    (Some(2), [0.0, -0.245, 0.0]),
    (Some(3), [0.0, 0.08, 0.0]),
    (Some(4), [0.0, -0.246, -0.01]),
    (Some(5), [0.0, -0.246, -0.01]),
    (Some(6), [0.0, 0.035, 0.0]),
    (Some(7), [0.01, -0.035, 0.075]),
    (Some(8), [-0.01, -0.035, 0.075]),
    (Some(9), [0.0, 0.12, -0.01]),
    (Some(9), [0.045, 0.07, -0.01]),
    (Some(9), [-0.045, 0.07, -0.01]),
    (Some(12), [0.0, 0.05, 0.02]),
    (Some(13), [0.065, 0.02, -0.01]),
    (Some(14), [-0.065, 0.02, -0.01]),
    (Some(16), [0.16, 0.0, 0.0]),
    (Some(17), [-0.16, 0.0, 0.0]),
    (Some(18), [0.15, 0.0, 0.0]),
    (Some(19), [-0.15, 0.0, 0.0]),
];
/// End points of head and hands: parent and offset, in statures.
const ENDS: [(&str, usize, [f64; 3]); 3] = [
    ("head_end", 15, [0.0, 0.12, 0.01]),
    ("left_wrist_end", 20, [0.1, 0.0, 0.0]),
    ("right_wrist_end", 21, [-0.1, 0.0, 0.0]),
];

/// Reads a motion of AMASS; z up becomes y up, the frame rate is kept.
///
/// # Errors
/// Names the file, the array and the frame at fault.
pub(super) fn read_amass(path: &Path) -> Result<MotionClip, FormatError> {
    let mut file = NpzFile::open(path)?;
    let poses = poses(&mut file)?;
    let frames = poses.len() / (BODY * NUMBERS);
    let trans = translations(&mut file, frames)?;
    let rate = rate(&mut file)?;
    // x stays, z becomes y.
    let upright = UnitQuaternion::from_axis_angle(&V3d::x_axis(), -FRAC_PI_2);
    let rows = poses.chunks_exact(BODY * NUMBERS).zip(&trans);
    let (names, parents) = joints();
    Ok(MotionClip {
        rest: places(
            &[0.0; BODY * NUMBERS],
            V3d::zeros(),
            &UnitQuaternion::identity(),
        ),
        frames: rows.map(|(row, t)| places(row, *t, &upright)).collect(),
        names,
        parents,
        period: 1.0 / rate,
        is_y_up: true,
        notes: vec![format!(
            "rotations of SMPL's joints on a figure of {STATURE} m: z up turned to y up, fingers and face left out"
        )],
    })
}

/// Rotation vectors of the body's joints, row-major, shape `[frames][22][3]`.
fn poses(file: &mut NpzFile<'_>) -> Result<Vec<f64>, FormatError> {
    if let Some(poses) = file.numbers("poses")? {
        let width = poses.side(1);
        if poses.shape.len() != 2 || !WIDTHS.contains(&width) || poses.side(0) == 0 {
            let why = format!(
                "shape {:?}, expected [frames, 72], [frames, 156] or [frames, 165]",
                poses.shape
            );
            return Err(file.fault("poses", why));
        }
        let rows = poses.data.chunks_exact(width);
        return Ok(rows
            .flat_map(|row| row[..BODY * NUMBERS].iter().copied())
            .collect());
    }
    // SMPL-X's generation has the same in parts.
    let names = file.names().join(", ");
    let (root, body) = (file.numbers("root_orient")?, file.numbers("pose_body")?);
    let (Some(root), Some(body)) = (root, body) else {
        let why = format!(
            "missing; a motion needs it, or `root_orient` and `pose_body`; the file has {names}"
        );
        return Err(file.fault("poses", why));
    };
    let frames = root.side(0);
    if root.shape != [frames, NUMBERS]
        || body.shape != [frames, (BODY - 1) * NUMBERS]
        || frames == 0
    {
        let why = format!(
            "shape {:?} beside {:?}, expected [frames, 63] beside [frames, 3]",
            body.shape, root.shape
        );
        return Err(file.fault("pose_body", why));
    }
    let rows = root
        .data
        .chunks_exact(NUMBERS)
        .zip(body.data.chunks_exact((BODY - 1) * NUMBERS));
    Ok(rows.flat_map(|(r, b)| r.iter().chain(b).copied()).collect())
}

/// Position of the body a frame, metres.
fn translations(file: &mut NpzFile<'_>, frames: usize) -> Result<Vec<V3d>, FormatError> {
    let Some(trans) = file.numbers("trans")? else {
        return Err(file.fault(
            "trans",
            "missing; a motion needs the body's place in every frame",
        ));
    };
    if trans.shape != [frames, NUMBERS] {
        let why = format!(
            "shape {:?}, expected [{frames}, 3] as `poses` has {frames} frames",
            trans.shape
        );
        return Err(file.fault("trans", why));
    }
    Ok(trans
        .data
        .as_chunks::<NUMBERS>()
        .0
        .iter()
        .map(|t| V3d::from(*t))
        .collect())
}

/// Frames a second.
fn rate(file: &mut NpzFile<'_>) -> Result<f64, FormatError> {
    for name in RATES {
        if let Some(array) = file.numbers(name)? {
            return match array.data[..] {
                [rate] if (1.0..=1000.0).contains(&rate) => Ok(rate),
                _ => Err(file.fault(
                    name,
                    format!(
                        "{:?}, expected one rate of 1 to 1000 frames a second",
                        array.data
                    ),
                )),
            };
        }
    }
    Err(file.fault(
        RATES[0],
        format!(
            "missing, and so is `{}`: the frames' rate is unknown",
            RATES[1]
        ),
    ))
}

fn joints() -> (Vec<String>, Vec<Option<usize>>) {
    let body = SMPL_JOINT_NAMES
        .iter()
        .zip(&FIGURE)
        .map(|(name, (parent, _))| ((*name).to_owned(), *parent));
    body.chain(
        ENDS.iter()
            .map(|(name, parent, _)| ((*name).to_owned(), Some(*parent))),
    )
    .unzip()
}

/// Positions in one frame, metres, turned upright.
fn places(row: &[f64], at: V3d, upright: &UnitQuaternion<f64>) -> Vec<P3d> {
    let mut turns: Vec<UnitQuaternion<f64>> = Vec::with_capacity(BODY);
    let mut out: Vec<P3d> = Vec::with_capacity(BODY + ENDS.len());
    for ((parent, offset), vector) in FIGURE.iter().zip(row.as_chunks::<NUMBERS>().0) {
        let turn = UnitQuaternion::from_scaled_axis(V3d::from(*vector));
        let (place, turn) = match parent {
            None => (P3d::from(upright * at), upright * turn),
            Some(p) => (
                out[*p] + turns[*p] * (V3d::from(*offset) * STATURE),
                turns[*p] * turn,
            ),
        };
        turns.push(turn);
        out.push(place);
    }
    for (_, parent, offset) in ENDS {
        out.push(out[parent] + turns[parent] * (V3d::from(offset) * STATURE));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use npyz::WriterBuilder;

    /// Writes a file of arrays.
    fn write(dir: &Path, arrays: &[(&str, &[u64], Vec<f64>)]) -> std::path::PathBuf {
        let path = dir.join("motion.npz");
        let mut zip = npyz::npz::NpzWriter::create(&path).expect("create");
        for (name, shape, data) in arrays {
            let entry = zip.array::<f64>(name, Default::default()).expect("entry");
            let mut entry = entry
                .default_dtype()
                .shape(shape)
                .begin_nd()
                .expect("begin");
            entry.extend(data.iter().copied()).expect("write");
            entry.finish().expect("finish");
        }
        path
    }

    /// Two frames of SMPL+H: upright in the data set's frame, facing −y; then the left elbow bent to the front.
    fn poses(width: usize) -> Vec<f64> {
        let mut out = vec![0.0; 2 * width];
        for frame in 0..2 {
            // A quarter turn about x takes SMPL's y up to z up.
            out[frame * width] = FRAC_PI_2;
        }
        out[width + 18 * NUMBERS + 1] = -FRAC_PI_2;
        out
    }

    #[test]
    fn z_up_becomes_y_up_and_the_rate_is_kept() {
        let dir = tempfile::tempdir().expect("dir");
        for width in WIDTHS {
            let rate = if width == 165 { RATES[1] } else { RATES[0] };
            let trans = vec![0.0, 0.0, 0.9, 0.0, -1.0, 0.9];
            let path = write(
                dir.path(),
                &[
                    ("poses", &[2, width as u64], poses(width)),
                    ("trans", &[2, 3], trans),
                    (rate, &[], vec![60.0]),
                ],
            );
            let clip = read_amass(&path).expect("reads");
            assert_eq!((clip.frames.len(), clip.period), (2, 1.0 / 60.0));
            let at =
                |frame: usize, name: &str| clip.frames[frame][clip.joint(&[name]).expect(name)];
            assert!((at(0, "pelvis") - P3d::new(0.0, 0.9, 0.0)).norm() < 1e-12);
            // −y of the data set is ahead, +z: the body walked a metre.
            assert!((at(1, "pelvis") - P3d::new(0.0, 0.9, 1.0)).norm() < 1e-12);
            assert!(at(0, "head").y > 1.3 && at(0, "left_ankle").y < 0.2);
            assert!(at(0, "left_wrist").x > 0.5 && at(0, "left_foot").z > 0.05);
            // The bent forearm points ahead.
            let fore = (at(1, "left_wrist") - at(1, "left_elbow")).normalize();
            assert!((fore - V3d::z()).norm() < 1e-9, "{fore}");
            assert!(clip.first_is_rest());
        }
    }

    #[test]
    fn parts_are_the_same_and_faults_are_named() {
        let dir = tempfile::tempdir().expect("dir");
        let trans = || vec![0.0; 6];
        let whole = write(
            dir.path(),
            &[
                ("poses", &[2, 156], poses(156)),
                ("trans", &[2, 3], trans()),
                (RATES[0], &[1], vec![120.0]),
            ],
        );
        let right = read_amass(&whole).expect("reads");
        let rows = poses(156);
        let part = |from: usize, to: usize| [&rows[from..to], &rows[156 + from..156 + to]].concat();
        let parts: [(&str, &[u64], Vec<f64>); 4] = [
            ("root_orient", &[2, 3], part(0, 3)),
            ("pose_body", &[2, 63], part(3, 66)),
            ("trans", &[2, 3], trans()),
            (RATES[1], &[], vec![120.0]),
        ];
        assert_eq!(
            read_amass(&write(dir.path(), &parts)).expect("reads"),
            right
        );
        let fault = |arrays: &[(&str, &[u64], Vec<f64>)]| {
            read_amass(&write(dir.path(), arrays))
                .expect_err("must be refused")
                .to_string()
        };
        let poses_only = ("poses", &[2u64, 156][..], poses(156));
        assert!(fault(std::slice::from_ref(&poses_only)).contains("`trans`"));
        let e = fault(&[poses_only.clone(), ("trans", &[2, 3], trans())]);
        assert!(
            e.contains("mocap_framerate") && e.contains("mocap_frame_rate"),
            "{e}"
        );
        assert!(fault(&[poses_only.clone(), ("trans", &[1, 3], vec![0.0; 3])]).contains("[2, 3]"));
        assert!(
            fault(&[
                poses_only,
                ("trans", &[2, 3], trans()),
                (RATES[0], &[], vec![0.0])
            ])
            .contains("1 to 1000")
        );
        assert!(fault(&[("poses", &[2, 70], vec![0.0; 140])]).contains("[frames, 156]"));
        assert!(
            fault(&[("v_template", &[1, 3], vec![0.0; 3])]).contains("the file has v_template")
        );
    }
}
