//! `tryon import`: what was made elsewhere, checked and converted.

use super::{export::mesh, record::Sink};
use crate::args::ImportArgs;
use crate::input;
use anyhow::{Context, Result, bail};
use std::process::ExitCode;
use tryon::formats::fabric_json::parse_fabric;
use tryon::formats::gltf::read_glb;
use tryon::formats::mhclo::read_mhclo;
use tryon::formats::obj::read_obj;
use tryon::formats::open_recording;
use tryon::formats::sewn_obj::read_sewn_obj;
use tryon::garment::import::from_mesh;
use tryon::garment::{GarmentKind, GarmentMesh, Material, Triangulation};
use tryon::math::P3;
use tryon::mesh::Topology;

/// Colour of imported meshes without their own.
const GREY: [u8; 3] = [180, 180, 180];

/// Runs the command.
///
/// # Errors
/// The fault of the file, named by field, joint, vertex, face, panel or frame.
pub(crate) fn run(args: &ImportArgs) -> Result<ExitCode> {
    let path = &args.input;
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    match ending {
        "npz" => {
            let t = input::template(Some(path))?;
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
            if let Some(out) = &args.out {
                mesh(out, t.name(), m.vertices(), m.faces(), &[], GREY)?;
            }
        }
        "obj" | "glb" | "gltf" => {
            let (vertices, faces, uv, surface) = if ending == "obj" {
                let sewn = read_sewn_obj(path)?;
                if !sewn.stitches.is_empty() {
                    let name = path
                        .file_stem()
                        .and_then(|s| s.to_str())
                        .unwrap_or("garment");
                    let g =
                        from_mesh(&sewn, name, GarmentKind::Dress, Material::preset("cotton")?)?;
                    let (n, panels) = (g.garment.vertices, g.garment.panels.len());
                    let s = sewn.stitches.len();
                    println!(
                        "sewn garment: {panels} panels, {s} stitches ({} left open), {n} vertices",
                        g.open
                    );
                }
                let o = sewn.obj;
                let (v, t, f, _) = o.unwelded();
                (v, f, t, o.mesh)
            } else {
                let g = read_glb(path)?;
                (
                    g.mesh.vertices().to_vec(),
                    g.mesh.faces().to_vec(),
                    g.uv,
                    g.mesh,
                )
            };
            let topology = Topology::new(&surface)?;
            let (_, pieces) = topology.components();
            println!(
                "mesh: {} vertices, {} faces, {pieces} pieces, closed: {}, area {:.3} m²",
                surface.vertices().len(),
                surface.faces().len(),
                topology.is_closed(),
                surface.area()
            );
            if let Some(out) = &args.out {
                mesh(out, "garment", &vertices, &faces, &uv, GREY)?;
            }
        }
        "json" => json(args)?,
        "mhclo" => {
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
            if let Some(out) = &args.out {
                let (v, t, f, _) = o.unwelded();
                mesh(out, &m.name, &v, &f, &t, GREY)?;
            }
        }
        "mcap" | "" => recording(args)?,
        other => bail!(
            "{}: .{other} is not known; bodies are .npz, garments .obj, .glb or .json, recordings .mcap or a folder",
            path.display()
        ),
    }
    Ok(ExitCode::SUCCESS)
}

/// A sewing pattern, GarmentCode's or ours, or a measured fabric.
fn json(args: &ImportArgs) -> Result<()> {
    let path = &args.input;
    let text =
        std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let name = path
        .file_stem()
        .and_then(|s| s.to_str())
        .unwrap_or("garment");
    if text.contains("\"stretching\"") {
        let m = Material::from_measured(name, &parse_fabric(&text, path)?)?;
        println!(
            "fabric `{name}`: {:.0} g/m², warp {:.0}, weft {:.0}, shear {:.0} N/m, bending {:.1e} N·m",
            m.area_density * 1e3,
            m.stretch_warp,
            m.stretch_weft,
            m.shear,
            m.bending
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
    match &args.out {
        Some(out) if out.extension().is_some_and(|e| e == "json") => {
            std::fs::write(out, pattern.to_json())?
        }
        Some(out) => {
            let flat: Vec<P3> = g
                .render
                .uv
                .iter()
                .map(|p| P3::new(p[0], p[1], 0.0))
                .collect();
            mesh(out, name, &flat, &g.render.faces, &g.render.uv, GREY)?;
        }
        None => {}
    }
    Ok(())
}

fn recording(args: &ImportArgs) -> Result<()> {
    let mut source = open_recording(&args.input)?;
    let mut sink = args
        .out
        .as_ref()
        .map(|out| Sink::create(out, source.calibration()))
        .transpose()?;
    let bar = input::progress(source.len().map(|n| n as u64), "checking");
    let mut bad = 0u64;
    loop {
        match source.next_frame() {
            Ok(None) => break,
            Ok(Some(frame)) => {
                if let Some(sink) = &mut sink {
                    sink.write(&frame)?;
                }
            }
            Err(e) => {
                bad += 1;
                bar.suspend(|| eprintln!("tryon: {e}"));
            }
        }
        bar.inc(1);
    }
    if let Some(sink) = sink {
        sink.finish()?;
    }
    bar.finish_and_clear();
    let k = source.calibration().depth;
    println!(
        "recording: {} frames, {bad} of them bad, {}×{}",
        bar.position(),
        k.width,
        k.height
    );
    Ok(())
}
