//! Bodies and motion: npz, npy, BVH, ASF with AMC, MakeHuman's bindings and targets.

use super::{Target, le, lossy, packed, text};
use crate::bundle::Bundle;
use crate::execute::Scratch;
use crate::pack;
use std::path::Path;
use tryon::body::import::{body_of_arrays, template_from_smpl};
use tryon::formats::MeshFrame;
use tryon::formats::mhclo::parse_mhclo;
use tryon::formats::morph_target::read_morph_target;
use tryon::formats::npy::read_npy;
use tryon::formats::npz::read_smpl;
use tryon::formats::read_motion;
use tryon::geometry::math::P3;

/// SMPL-layout archives: members packed anew, or a raw archive.
pub(super) const NPZ: Target = Target::new(
    "npz",
    "src/formats/npz.rs, amass.rs, src/body/import",
    |b, scratch| {
        let archive = packed(b, "body.npz", || pack::zip(&b.0))?;
        let path = scratch.file("body.npz", &archive)?;
        // Motions of AMASS come in the same container.
        if let Ok(clip) = read_motion(&path) {
            return Ok(clip.frames.len());
        }
        let arrays = read_smpl(&path).map_err(text)?;
        // Few inputs are people.
        drop(body_of_arrays(
            "body",
            arrays.clone(),
            &MeshFrame::default(),
        ));
        let template = template_from_smpl("body", &arrays).map_err(text)?;
        Ok(template.mesh().vertices().len())
    },
    npz_seeds,
)
.words("'<f8' '<f4' '<i4' '<u4' '|O' '|S3' '<U5' True False (4,3) (0,) ()")
.allow(1 << 20, 2000);

/// Single arrays.
pub(super) const NPY: Target = Target::new(
    "npy",
    "src/formats/npy.rs",
    |b, scratch| {
        let path = scratch.file("a.npy", b.first())?;
        read_npy(&path).map(|(_, v)| v.len()).map_err(text)
    },
    || {
        let half = npy("'<f2'", "(2, 2)", &[0, 60, 0, 60, 1, 0, 0, 124]);
        vec![
            Bundle::of("a.bin", half),
            Bundle::of("a.bin", f64s(&[2, 3], &[0.5; 6])),
        ]
    },
)
.words("'<f2' '<f4' '<f8' 'descr' 'shape' True False (9999999999,)");

/// Motion clips.
pub(super) const MOTION: Target = Target::new(
    "motion",
    "src/formats/bvh.rs, asf_amc.rs",
    |b, scratch| {
        let folder = scratch.fill(b)?;
        let file = if b.get("a.bvh").is_empty() {
            "s_1.amc"
        } else {
            "a.bvh"
        };
        let clip = read_motion(&folder.join(file)).map_err(text)?;
        Ok(clip.at_cmu_rate().frames.len())
    },
    || {
        vec![
            Bundle::of("a.bvh", BVH),
            Bundle::of("s.asf", ASF).and("s_1.amc", AMC),
        ]
    },
)
.words(
    "HIERARCHY ROOT JOINT End Site OFFSET CHANNELS Xposition Zrotation MOTION Frames: Frame Time: \
     { } :root :bonedata :hierarchy begin end dof rx axis XYZ order length limits (-180",
)
// Clips are resampled to a fixed rate.
.allow(512 << 10, 2000);

/// MakeHuman's bindings and targets.
pub(super) const MAKEHUMAN: Target = Target::new(
    "makehuman",
    "src/formats/mhclo.rs, morph_target.rs",
    run_makehuman,
    || vec![Bundle::of("a.mhclo", MHCLO), Bundle::of("a.target", TARGET)],
)
.words("verts obj_file x_scale z_depth delete_verts basemesh material - uuid")
// `delete_verts 0 - N` is a list of N vertices, of which a body has at most 65,536.
.allow(1 << 20, 400);

const BVH: &str = "HIERARCHY\nROOT hip\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation \
    Xrotation\n JOINT arm\n {\n  OFFSET 1 0 0\n  CHANNELS 3 Zrotation Xrotation Yrotation\n  End Site\n  {\n   OFFSET 2 \
    0 0\n  }\n }\n}\nMOTION\nFrames: 2\nFrame Time: 0.01\n0 1 0 0 0 0 90 0 0\n0 1 0 90 0 0 0 90 0\n";
const ASF: &str = ":version 1.10\n:units\n length 0.0254\n angle deg\n:root\n order TX TY TZ RX RY RZ\n:bonedata\n begin\n  \
    id 1\n  name thigh\n  direction 0 -1 0\n  length 2\n  axis 0 0 90 XYZ\n  dof rx\n limits (-160.0 20.0)\n end\n begin\n  \
    id 2\n  name shin\n  direction 0 -1 0\n  length 1\n  axis 0 0 0 XYZ\n  dof rz\n end\n:hierarchy\n begin\n  root \
    thigh\n  thigh shin\n end\n";
const AMC: &str =
    ":DEGREES\n1\nroot 1 2 3 0 0 0\nthigh 0\nshin 90\n2\nroot 0 0 0 0 90 0\nthigh 90\nshin 0\n";
const MHCLO: &str = "# a hat\nname hat\nobj_file hat.obj\nbasemesh hm08\nx_scale 0 1 2.0\nz_depth 50\nverts 0\n\
    0 1 2 0.5 0.25 0.25 0.1 0.2 0.3\n2\ndelete_verts\n0 - 2\n";
const TARGET: &str = "# basemesh hm08\n0 0.1 0.2 -0.3\n2 0 1 0\n";

fn run_makehuman(b: &Bundle, scratch: &Scratch) -> Result<usize, String> {
    let target = b.get("a.target");
    if !target.is_empty() {
        let path = scratch.file("a.target", target)?;
        let morph = read_morph_target(&path).map_err(text)?;
        morph.add_to(&mut [[0.0; 3]; 3], 0.5);
        return Ok(morph.offsets.len());
    }
    let at = Path::new("a.mhclo");
    let binding = parse_mhclo(&lossy(b.get("a.mhclo")), at).map_err(text)?;
    let body = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]].map(P3::from);
    binding.fit(&body, at).map(|p| p.len()).map_err(text)
}

/// NPY file of version 1.
fn npy(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}");
    let padded = (10 + header.len() + 1).next_multiple_of(64) - 10;
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend_from_slice(&(padded as u16).to_le_bytes());
    out.extend_from_slice(header.as_bytes());
    out.resize(10 + padded - 1, b' ');
    out.push(b'\n');
    out.extend_from_slice(data);
    out
}

fn f64s(shape: &[usize], values: &[f64]) -> Vec<u8> {
    let sides: Vec<String> = shape.iter().map(usize::to_string).collect();
    let data = le(values, f64::to_le_bytes);
    npy("'<f8'", &format!("({},)", sides.join(", ")), &data)
}

fn u32s(shape: &str, values: &[u32]) -> Vec<u8> {
    npy("'<u4'", shape, &le(values, u32::to_le_bytes))
}

/// A body of four vertices and two joints.
fn npz_seeds() -> Vec<Bundle> {
    let corners = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.];
    let bundle = Bundle::of("v_template.npy", f64s(&[4, 3], &corners))
        .and(
            "f.npy",
            u32s("(4, 3)", &[0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]),
        )
        .and("kintree_table.npy", u32s("(2, 2)", &[u32::MAX, 0, 0, 1]))
        .and("weights.npy", f64s(&[4, 2], &[0.5; 8]))
        .and("J_regressor.npy", f64s(&[2, 4], &[0.25; 8]))
        .and("shapedirs.npy", f64s(&[4, 3, 1], &[0.01; 12]))
        .and("posedirs.npy", f64s(&[4, 3, 9], &[0.0; 108]));
    let archive = pack::zip(&bundle.0).unwrap_or_default();
    let motion = Bundle::of("poses.npy", f64s(&[1, 72], &[0.1; 72]))
        .and("trans.npy", f64s(&[1, 3], &[0.5; 3]))
        .and("mocap_framerate.npy", f64s(&[1], &[30.0]));
    vec![Bundle::of("body.npz", archive), bundle, motion]
}
