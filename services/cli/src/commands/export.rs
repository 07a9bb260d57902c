//! `tryon export`: the embedded body or a garment to a file.

use crate::args::ExportArgs;
use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::ExitCode;
use tryon::body::embedded;
use tryon::formats::gltf::{GlbMesh, write_glb};
use tryon::formats::obj::write_obj;
use tryon::garment::{GarmentMesh, Size, Triangulation, library};
use tryon::math::P3;
use tryon::mesh::Face;

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
    let (Some(what), Some(out)) = (&args.what, &args.out) else { bail!("say what to export and where to (--out)") };
    if what == "body" {
        let t = embedded::template();
        mesh(out, "body", t.mesh().vertices(), t.mesh().faces(), &[], [205, 170, 150])?;
    } else {
        let size: Size = args.size.parse()?;
        let pattern = library::pattern(what, size)?;
        if out.extension().is_some_and(|e| e == "json") {
            std::fs::write(out, pattern.to_json()).with_context(|| format!("cannot write {}", out.display()))?;
        } else {
            // Flat, as cut: the rest shape is the panels laid out side by side.
            let g = GarmentMesh::sew(&pattern, &Triangulation::default())?;
            let flat: Vec<P3> = g.render.uv.iter().map(|p| P3::new(p[0], p[1], 0.0)).collect();
            mesh(out, what, &flat, &g.render.faces, &g.render.uv, crate::chain::look(what).base)?;
        }
    }
    println!("{what} in {}", out.display());
    Ok(ExitCode::SUCCESS)
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
        Some("glb") => write_glb(out, &[GlbMesh { name, vertices, faces, uv, color: rgb }])?,
        _ => bail!("{}: the ending must be .obj or .glb (or .json for a garment's pattern)", out.display()),
    }
    Ok(())
}
