//! `tryon export`: the embedded body, a garment or a recording to a file.

use super::convert::convert;
use crate::args::ExportArgs;
use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::ExitCode;
use tryon::body::{BoneTransforms, Pose, embedded};
use tryon::cloth;
use tryon::dressing::{DressOptions, dress};
use tryon::formats::RECORDING_EXTENSIONS;
use tryon::formats::gltf::{GlbMesh, write_glb, write_glb_motion};
use tryon::formats::obj::write_obj;
use tryon::garment::{GarmentMesh, Pattern, Size, Triangulation, library};
use tryon::geometry::math::{P3, V3, World};
use tryon::synth::{Actor, Sequence, Setting};

/// Runs the command.
///
/// # Errors
/// An unknown name or size, an ending that says no format, a recording that cannot be read, or a file that cannot be
/// written.
pub(crate) fn run(args: &ExportArgs) -> Result<ExitCode> {
    if args.list {
        println!("body");
        library::names().iter().for_each(|name| println!("{name}"));
        return Ok(ExitCode::SUCCESS);
    }
    let (Some(what), Some(out)) = (&args.what, &args.out) else {
        bail!("say what to export and where to (--out)")
    };
    if out.extension().is_some_and(|e| e == "mcap") {
        convert(Path::new(what), &args.recording, Some(out))?;
    } else if what == "body" {
        let t = embedded::template();
        let body = GlbMesh {
            name: "body",
            vertices: t.mesh().vertices(),
            faces: t.mesh().faces(),
            uv: &[],
            color: SKIN,
            texture: &[],
        };
        write_mesh(out, body)?;
    } else if RECORDING_EXTENSIONS
        .iter()
        .any(|e| what.ends_with(&format!(".{e}")))
    {
        bail!("{what}: a recording is exported to an .mcap file")
    } else {
        let size: Size = args.size.parse()?;
        let pattern = library::pattern(what, size)?;
        if out.extension().is_some_and(|e| e == "json") {
            std::fs::write(out, pattern.to_json())
                .with_context(|| format!("cannot write {}", out.display()))?;
        } else if args.worn {
            worn(out, &pattern, args.seconds)?;
        } else {
            let g = GarmentMesh::sew(&pattern, &Triangulation::default())?;
            let cut = GlbMesh {
                name: what,
                vertices: &flat(&g),
                faces: &g.render.faces,
                uv: &g.render.uv,
                color: library::dye(what),
                texture: &[],
            };
            write_mesh(out, cut)?;
        }
    }
    println!("{what} in {}", out.display());
    Ok(ExitCode::SUCCESS)
}

/// Colour of the body in glTF files, sRGB.
pub(crate) const SKIN: [u8; 3] = [205, 170, 150];
/// Frames a second of an exported animation.
const FRAMES: f64 = 30.0;
/// Longest animation, s.
const LONGEST: f64 = 60.0;

/// Vertices of a garment as cut: its panels side by side, metres.
pub(crate) fn flat(garment: &GarmentMesh) -> Vec<P3> {
    let uv = garment.render.uv.iter();
    uv.map(|p| P3::new(p[0], p[1], 0.0)).collect()
}

/// Pose of the try-on routine in frame `i`.
fn pose(sequence: &Sequence, i: u64) -> Pose<World> {
    let world_from_camera = &sequence.setting().world_from_camera;
    sequence.truth(i).pose.transformed(world_from_camera)
}

/// The garment on the embedded body, which starts upright over the origin and faces +z: still, or moving with the try-on
/// routine for some seconds.
fn worn(out: &Path, pattern: &Pattern, seconds: f64) -> Result<()> {
    let sequence = Sequence::new(Actor::default(), Setting::default());
    let template = embedded::template();
    let start = pose(&sequence, 0);
    let options = DressOptions {
        any_size: true,
        ..DressOptions::default()
    };
    let patterns = std::slice::from_ref(pattern);
    let dressed = dress(&template, sequence.rest(), &start, patterns, &options)?;
    let garment = &dressed.model.outfit.garments[0];
    let pelvis = start.root.point(&template.skeleton().joints()[0].rest);
    let home = V3::new(pelvis.x as f32, 0.0, pelvis.z as f32);
    let drawn = |state: &cloth::State| {
        let mut p = Vec::new();
        garment.render_positions(&state.garments[0].positions, &mut p);
        p.iter_mut().for_each(|p| *p -= home);
        p
    };
    let still = drawn(&dressed.state);
    let m = GlbMesh {
        name: &garment.name,
        vertices: &still,
        faces: &garment.render.faces,
        uv: &garment.render.uv,
        color: library::dye(&garment.name),
        texture: &[],
    };
    let count = (seconds.clamp(0.0, LONGEST) * FRAMES) as u64;
    if count == 0 || out.extension().is_none_or(|e| e != "glb") {
        return write_mesh(out, m);
    }
    let frames = simulate(
        &sequence,
        &dressed.model,
        dressed.state.clone(),
        count,
        drawn,
    )?;
    write_glb_motion(out, &[m], &[frames], (1.0 / FRAMES) as f32)?;
    Ok(())
}

/// Drawn vertices of the first `count` frames of the routine.
fn simulate(
    sequence: &Sequence,
    model: &cloth::Model,
    mut state: cloth::State,
    count: u64,
    drawn: impl Fn(&cloth::State) -> Vec<P3>,
) -> Result<Vec<Vec<P3>>> {
    let (template, rest) = (&sequence.actor().template, sequence.rest());
    let bar = crate::input::progress(Some(count), "simulating");
    let (mut work, mut body) = (cloth::Workspace::default(), Vec::new());
    let mut frames = Vec::new();
    for i in 0..count {
        let mut bones = BoneTransforms::default();
        template.skin_pose(rest, &pose(sequence, i), &mut bones, &mut body);
        let input = cloth::Input {
            body: &body,
            dt: 1.0 / FRAMES,
        };
        cloth::step(model, &mut state, &input, &mut work)?;
        frames.push(drawn(&state));
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(frames)
}

/// Writes a mesh in the format that the ending names.
///
/// # Errors
/// An unknown ending, or a file that cannot be written.
pub(crate) fn write_mesh(out: &Path, m: GlbMesh<'_>) -> Result<()> {
    match out.extension().and_then(|e| e.to_str()) {
        Some("obj") => {
            let uv = (!m.uv.is_empty()).then_some(m.uv);
            write_obj(out, m.vertices, m.faces, uv)?;
        }
        Some("glb") => write_glb(out, &[m])?,
        _ => bail!(
            "{}: the ending must be .obj or .glb (or .json for a garment's pattern)",
            out.display()
        ),
    }
    Ok(())
}
