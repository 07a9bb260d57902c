//! `tryon import`: what was made elsewhere, checked and converted.

use super::{export::mesh, record::Sink};
use crate::args::ImportArgs;
use crate::input;
use anyhow::{Result, bail};
use std::process::ExitCode;
use tryon::formats::gltf::read_glb;
use tryon::formats::obj::read_obj;
use tryon::formats::open_recording;
use tryon::garment::{GarmentMesh, Pattern, Triangulation};
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
            println!("shape directions: {}", t.shape_space().map_or(0, |s| s.vertices.len()));
            println!("closed: {}, volume {:.4} m³", t.topology().is_closed(), m.volume());
            if let Some(out) = &args.out {
                mesh(out, t.name(), m.vertices(), m.faces(), &[], GREY)?;
            }
        }
        "obj" | "glb" | "gltf" => {
            let (vertices, faces, uv, surface) = if ending == "obj" {
                let o = read_obj(path)?;
                let (v, t, f, _) = o.unwelded();
                (v, f, t, o.mesh)
            } else {
                let g = read_glb(path)?;
                (g.mesh.vertices().to_vec(), g.mesh.faces().to_vec(), g.uv, g.mesh)
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
        "json" => {
            let text = std::fs::read_to_string(path)?;
            let pattern = Pattern::from_json(&text)?;
            let g = GarmentMesh::sew(&pattern, &Triangulation::default())?;
            println!(
                "garment: {} panels, {} seams, {} vertices",
                pattern.panels.len(),
                pattern.seams.len(),
                g.vertices
            );
            if let Some(out) = &args.out {
                std::fs::write(out, pattern.to_json())?;
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

fn recording(args: &ImportArgs) -> Result<()> {
    let mut source = open_recording(&args.input)?;
    let mut sink = args.out.as_ref().map(|out| Sink::create(out, source.calibration())).transpose()?;
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
    println!("recording: {} frames, {bad} of them bad, {}×{}", bar.position(), k.width, k.height);
    Ok(())
}
