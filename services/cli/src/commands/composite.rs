//! `tryon composite`: garment meshes into one captured picture.

use crate::args::CompositeArgs;
use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::ExitCode;
use tryon::formats::gltf::read_glb;
use tryon::formats::image::{read_color, read_png_depth, write_png_rgb};
use tryon::formats::obj::read_obj;
use tryon::formats::{depth_to_mm, read_camera};
use tryon::geometry::camera::RgbdFrame;
use tryon::geometry::math::P3;
use tryon::geometry::mesh::Face;
use tryon::mirror::library_appearance;
use tryon::view::{Appearance, GarmentView, Input, Model, State, Workspace, render};

/// A garment mesh for drawing.
struct Loaded {
    vertices: Vec<P3>,
    uv: Vec<[f32; 2]>,
    faces: Vec<Face>,
    appearance: Appearance,
}

/// Runs the command.
///
/// # Errors
/// Bad input, named by file and field, face or vertex; or a picture that cannot be written.
pub(crate) fn run(args: &CompositeArgs) -> Result<ExitCode> {
    let (calibration, depth_scale) = read_camera(&args.camera)?;
    let mut depth = read_png_depth(&args.depth)?;
    depth_to_mm(&mut depth, depth_scale);
    let color = read_color(&args.color)?;
    let garments = args
        .garments
        .iter()
        .map(|p| load(p))
        .collect::<Result<Vec<_>>>()?;
    let frame = RgbdFrame {
        sequence: 0,
        time_ns: 0,
        depth,
        color: Some(color),
    };
    let views: Vec<GarmentView<'_>> = garments
        .iter()
        .map(|g| GarmentView {
            vertices: &g.vertices,
            faces: &g.faces,
            uv: &g.uv,
            normals: &[],
            places: &[],
            appearance: &g.appearance,
        })
        .collect();
    let input = Input {
        frame: &frame,
        calibration: &calibration,
        garments: &views,
        body: None,
        output: None,
    };
    let (picture, report) = render(
        &Model::default(),
        &mut State::default(),
        &input,
        &mut Workspace::default(),
    )
    .with_context(|| format!("cannot draw {}", args.color.display()))?;
    write_png_rgb(&args.out, &picture)?;
    println!(
        "{}: {} garment pixels, {} hidden behind the person, {} tiles untouched",
        args.out.display(),
        report.pixels_drawn,
        report.pixels_occluded,
        report.tiles_skipped
    );
    Ok(ExitCode::SUCCESS)
}

fn load(path: &Path) -> Result<Loaded> {
    let name = path
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    let appearance = library_appearance(&name);
    match path.extension().and_then(|e| e.to_str()) {
        Some("obj") => {
            let (vertices, uv, faces, _) = read_obj(path)?.unwelded();
            Ok(Loaded {
                vertices,
                uv,
                faces,
                appearance,
            })
        }
        Some("glb" | "gltf") => {
            let mesh = read_glb(path)?;
            Ok(Loaded {
                vertices: mesh.mesh.vertices().to_vec(),
                uv: mesh.uv,
                faces: mesh.mesh.faces().to_vec(),
                appearance,
            })
        }
        _ => bail!("{}: a garment is an .obj or a .glb file", path.display()),
    }
}
