//! `tryon export`: the embedded body or a garment to a file.

use crate::args::ExportArgs;
use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::ExitCode;
use tryon::body::{BoneTransforms, Pose, embedded, skin};
use tryon::cloth;
use tryon::dressing::{DressOptions, dress};
use tryon::formats::gltf::{GlbMesh, write_glb, write_glb_motion};
use tryon::formats::obj::write_obj;
use tryon::garment::{GarmentMesh, Pattern, Size, Triangulation, library};
use tryon::math::{P3, V3, World};
use tryon::mesh::Face;
use tryon::par::Par;
use tryon::synth::{Sequence, Setting, Shopper};

/// Runs the command.
///
/// # Errors
/// An unknown name or size, an ending that says no format, or a file that cannot be written.
pub(crate) fn run(args: &ExportArgs) -> Result<ExitCode> {
    if args.list {
        println!("body");
        library::names().iter().for_each(|name| println!("{name}"));
        return Ok(ExitCode::SUCCESS);
    }
    let (Some(what), Some(out)) = (&args.what, &args.out) else {
        bail!("say what to export and where to (--out)")
    };
    if what == "body" {
        let t = embedded::template();
        mesh(
            out,
            "body",
            t.mesh().vertices(),
            t.mesh().faces(),
            &[],
            [205, 170, 150],
        )?;
    } else {
        let size: Size = args.size.parse()?;
        let pattern = library::pattern(what, size)?;
        if out.extension().is_some_and(|e| e == "json") {
            std::fs::write(out, pattern.to_json())
                .with_context(|| format!("cannot write {}", out.display()))?;
        } else if args.worn {
            worn(out, &pattern, args.seconds)?;
        } else {
            // Flat, as cut: the rest shape is the panels laid out side by side.
            let g = GarmentMesh::sew(&pattern, &Triangulation::default())?;
            let flat: Vec<P3> = g
                .render
                .uv
                .iter()
                .map(|p| P3::new(p[0], p[1], 0.0))
                .collect();
            mesh(
                out,
                what,
                &flat,
                &g.render.faces,
                &g.render.uv,
                library::dye(what),
            )?;
        }
    }
    println!("{what} in {}", out.display());
    Ok(ExitCode::SUCCESS)
}

/// Frames a second of an exported animation.
const FRAMES: f64 = 30.0;

/// The garment on the embedded body, which starts upright over the origin and faces +z: still, or moving with the try-on
/// routine for some seconds.
fn worn(out: &Path, pattern: &Pattern, seconds: f64) -> Result<()> {
    let sequence = Sequence::new(Shopper::default(), Setting::default());
    let template = embedded::template();
    let rest = sequence.rest();
    let pose = |i: u64| -> Pose<World> {
        let p = sequence.truth(i).pose;
        Pose {
            root: sequence.setting().world_from_camera * p.root,
            angles: p.angles,
        }
    };
    let dressed = dress(
        &template,
        rest,
        &pose(0),
        std::slice::from_ref(pattern),
        &DressOptions {
            any_size: true,
            ..DressOptions::default()
        },
    )?;
    let (model, mut state, mut work) = (dressed.model, dressed.state, cloth::Workspace::default());
    let garment = &model.outfit.garments[0];
    let stands = pose(0)
        .root
        .point(&template.skeleton().joints()[0].rest)
        .coords
        .cast::<f32>();
    let drawn = |state: &cloth::State| {
        let mut p = Vec::new();
        garment.render_positions(&state.garments[0].positions, &mut p);
        p.iter_mut()
            .for_each(|p| *p -= V3::new(stands.x, 0.0, stands.z));
        p
    };
    let start = drawn(&state);
    let count = (seconds.clamp(0.0, 60.0) * FRAMES) as u64;
    if count == 0 || out.extension().is_none_or(|e| e != "glb") {
        return mesh(
            out,
            &garment.name,
            &start,
            &garment.render.faces,
            &garment.render.uv,
            library::dye(&garment.name),
        );
    }
    let bar = crate::input::progress(Some(count), "simulating");
    let mut frames = Vec::new();
    let mut body = Vec::new();
    for i in 0..count {
        let mut bones = BoneTransforms::default();
        pose(i).bones(template.skeleton(), rest, &mut bones);
        skin(
            Par::Rayon,
            &rest.vertices,
            template.weights(),
            &bones,
            &mut body,
        );
        cloth::step(
            &model,
            &mut state,
            &cloth::Input {
                body: &body,
                dt: 1.0 / FRAMES,
            },
            &mut work,
        )?;
        frames.push(drawn(&state));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let name = garment.name.as_str();
    let color = library::dye(name);
    let m = GlbMesh {
        name,
        vertices: &start,
        faces: &garment.render.faces,
        uv: &garment.render.uv,
        color,
    };
    write_glb_motion(out, &[m], &[frames], (1.0 / FRAMES) as f32)?;
    Ok(())
}

/// Writes a mesh in the format that the ending names.
///
/// # Errors
/// An unknown ending, or a file that cannot be written.
pub(crate) fn mesh(
    out: &Path,
    name: &str,
    vertices: &[P3],
    faces: &[Face],
    uv: &[[f32; 2]],
    rgb: [u8; 3],
) -> Result<()> {
    match out.extension().and_then(|e| e.to_str()) {
        Some("obj") => write_obj(out, vertices, faces, (!uv.is_empty()).then_some(uv))?,
        Some("glb") => write_glb(
            out,
            &[GlbMesh {
                name,
                vertices,
                faces,
                uv,
                color: rgb,
            }],
        )?,
        _ => bail!(
            "{}: the ending must be .obj or .glb (or .json for a garment's pattern)",
            out.display()
        ),
    }
    Ok(())
}
