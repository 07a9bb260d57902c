//! `tryon import`: bodies, garments and recordings of others, checked and converted.

use super::convert::convert;
use super::export::{flat, write_mesh};
use crate::args::ImportArgs;
use crate::input;
use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::ExitCode;
use tryon::cloth::BendingResolution;
use tryon::formats::fabric_json::parse_fabric;
use tryon::formats::foreign_pattern::is_foreign_pattern;
use tryon::formats::gltf::GlbMesh;
use tryon::formats::mhclo::read_mhclo;
use tryon::formats::obj::read_obj;
use tryon::formats::{NpzReader, RECORDING_EXTENSIONS};
use tryon::garment::import::{MeshFile, from_mesh, read_mesh};
use tryon::garment::{GarmentKind, GarmentMesh, Material, Triangulation};
use tryon::geometry::math::P3;
use tryon::geometry::mesh::{Face, Topology, TriMesh};

/// Colour of imported meshes without their own.
const GREY: [u8; 3] = [180, 180, 180];

/// Runs the command.
///
/// # Errors
/// The fault of the file, named by field, joint, vertex, face, panel or frame.
pub(crate) fn run(args: &ImportArgs) -> Result<ExitCode> {
    let path = &args.input;
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    match extension.to_ascii_lowercase().as_str() {
        "npz" if !NpzReader::is_recording(path)? => body(args)?,
        "obj" | "glb" | "gltf" => mesh(args)?,
        "json" => json(args)?,
        "mhclo" => clothes(args)?,
        _ if is_foreign_pattern(path) => {
            input::pattern(path)?;
        }
        e if e.is_empty() || RECORDING_EXTENSIONS.contains(&e) => {
            convert(path, &args.recording, args.out.as_deref())?;
        }
        other => bail!(
            "{}: .{other} is not known; bodies are .npz, garments .obj, .glb or .json, recordings a folder or one of .{}",
            path.display(),
            RECORDING_EXTENSIONS.join(", .")
        ),
    }
    Ok(ExitCode::SUCCESS)
}

/// Writes a mesh to `--out` where that is given.
fn write(
    args: &ImportArgs,
    name: &str,
    vertices: &[P3],
    faces: &[Face],
    uv: &[[f32; 2]],
) -> Result<()> {
    let m = GlbMesh {
        name,
        vertices,
        faces,
        uv,
        color: GREY,
        texture: &[],
    };
    args.out.as_ref().map_or(Ok(()), |out| write_mesh(out, m))
}

/// Name of a garment: that of its file.
fn stem(path: &Path) -> &str {
    path.file_stem()
        .and_then(|s| s.to_str())
        .unwrap_or("garment")
}

fn body(args: &ImportArgs) -> Result<()> {
    let t = input::body_in(&args.input, &args.frame.stated())?;
    let (m, s) = (t.mesh(), t.skeleton());
    println!(
        "body: {} vertices, {} faces, {} joints, {} angles",
        m.vertices().len(),
        m.faces().len(),
        s.len(),
        s.dofs()
    );
    println!(
        "shape directions: {}",
        t.shape_space().map_or(0, |s| s.vertices.len())
    );
    println!(
        "closed: {}, volume {:.4} m³",
        t.topology().is_closed(),
        m.volume()
    );
    write(args, t.name(), m.vertices(), m.faces(), &[])
}

/// A mesh, with stitches or without, repaired.
fn mesh(args: &ImportArgs) -> Result<()> {
    let MeshFile { sewn, notes, .. } = read_mesh(&args.input, None)?;
    if !sewn.stitches.is_empty() {
        let cotton = Material::preset("cotton")?;
        let g = from_mesh(&sewn, stem(&args.input), GarmentKind::Dress, cotton)?;
        println!(
            "sewn garment: {} panels, {} stitches ({} left open), {} vertices",
            g.garment.panels.len(),
            sewn.stitches.len(),
            g.open,
            g.garment.vertices
        );
    }
    describe(&sewn.obj.mesh)?;
    let parts = sewn.obj.origins.counts();
    for (part, faces) in parts.iter().filter(|_| parts.len() > 1) {
        println!("part `{part}`: {faces} faces");
    }
    notes.iter().for_each(|note| println!("{note}"));
    let (vertices, uv, faces, _) = sewn.obj.unwelded();
    let vertices = as_garment(args, vertices)?;
    write(args, "garment", &vertices, &faces, &uv)
}

fn describe(surface: &TriMesh) -> Result<()> {
    let topology = Topology::new(surface)?;
    let (_, pieces) = topology.components();
    println!(
        "mesh: {} vertices, {} faces, {pieces} pieces, closed: {}, area {:.3} m²",
        surface.vertices().len(),
        surface.faces().len(),
        topology.is_closed(),
        surface.area()
    );
    Ok(())
}

/// Says how a mesh is worn, or why it is not; its vertices, in metres, y up, facing +z where it is.
fn as_garment(args: &ImportArgs, vertices: Vec<P3>) -> Result<Vec<P3>> {
    let cotton = Material::preset("cotton")?;
    match input::mesh_garment(&args.input, None, args.frame.stated(), &cotton) {
        Ok(garment) => {
            println!("as a garment: {}", garment.notes.join("; "));
            Ok(garment.in_metres(&vertices))
        }
        Err(e) => {
            println!("as a garment: {e:#}");
            Ok(vertices)
        }
    }
}

/// MakeHuman clothes, with the OBJ beside them.
fn clothes(args: &ImportArgs) -> Result<()> {
    let path = &args.input;
    let m = read_mhclo(path)?;
    let o = read_obj(&path.with_file_name(&m.obj_file))?;
    let (bound, has) = (m.bindings.len(), o.mesh.vertices().len());
    if bound != has {
        bail!(
            "{}: {bound} vertices are bound, but {} has {has}",
            path.display(),
            m.obj_file
        );
    }
    println!(
        "clothes `{}` for {}: {bound} vertices, hides {} of the body",
        m.name,
        m.base,
        m.deleted.len()
    );
    o.notes.iter().for_each(|note| println!("{note}"));
    let (vertices, uv, faces, _) = o.unwelded();
    write(args, &m.name, &vertices, &faces, &uv)
}

/// A sewing pattern, GarmentCode's or ours, or a measured fabric.
fn json(args: &ImportArgs) -> Result<()> {
    let path = &args.input;
    let text =
        std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let name = stem(path);
    if text.contains("\"stretching\"") {
        let m = Material::from_measured(name, &parse_fabric(&text, path)?)?;
        println!(
            "fabric `{name}`: {:.0} g/m², warp {:.0}, weft {:.0}, shear {:.0} N/m, bending {:.1e} and {:.1e} N·m; \
             --fabric {} takes it",
            m.area_density * 1e3,
            m.stretch_warp,
            m.stretch_weft,
            m.shear,
            m.bending.warp,
            m.bending.weft,
            path.display()
        );
        return Ok(());
    }
    let pattern = input::pattern(path)?;
    let g = GarmentMesh::sew(&pattern, &Triangulation::default())
        .with_context(|| path.display().to_string())?;
    println!(
        "garment: {} panels, {} seams, {} darts, {} vertices, smallest angle {:.0}°",
        pattern.panels.len(),
        pattern.seams.len(),
        pattern.darts.len(),
        g.vertices,
        g.min_angle
    );
    let (limit, _) = BendingResolution::of_garment(&g);
    println!(
        "{}: bending {:.1e} and {:.1e} N·m; in real time edges of {:.0} mm carry no less than {:.1e}",
        g.material.name,
        limit.own[0],
        limit.own[1],
        limit.edge * 1e3,
        limit.least
    );
    match &args.out {
        Some(out) if out.extension().is_some_and(|e| e == "json") => {
            std::fs::write(out, pattern.to_json())?
        }
        _ => write(args, name, &flat(&g), &g.render.faces, &g.render.uv)?,
    }
    Ok(())
}
