//! Inputs that several commands share: bodies, garments, rough starts, and the progress bar over frames.

use crate::args::BodyArgs;
use anyhow::{Context, Result, ensure};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Deserialize;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use tryon::body::{Template, embedded, import::read_body};
use tryon::dressing::{
    GarmentFile, MeshGarment, MeshGarmentError, MeshGarmentSettings, SourceBody,
};
use tryon::formats::MeshFrame;
use tryon::formats::fabric_json::parse_fabric;
use tryon::formats::foreign_pattern::{is_foreign_pattern, refuse_foreign_pattern};
use tryon::formats::garmentcode::{is_garmentcode, parse_garmentcode};
use tryon::garment::import::from_garmentcode;
use tryon::garment::{FabricSample, Material, Pattern, Size, Triangulation};
use tryon::mirror::{CapturedWardrobe, Choice};

/// Body to track: that of `--body`, or the embedded one.
///
/// # Errors
/// As [`body_in`].
pub(crate) fn template(body: &BodyArgs) -> Result<Arc<Template>> {
    match body.file() {
        Some(path) => body_in(path, &body.stated()),
        None => Ok(embedded::template()),
    }
}

/// Body of an SMPL-layout npz whose unit and axes are as stated; what was found goes to stderr.
///
/// # Errors
/// Names the array, joint or vertex of the file that is at fault, and statements that the body contradicts.
pub(crate) fn body_in(path: &Path, frame: &MeshFrame) -> Result<Arc<Template>> {
    let body = read_body(path, frame)?;
    for note in &body.notes {
        eprintln!("{}: {note}", path.display());
    }
    Ok(Arc::new(body.template))
}

/// Sewing pattern from a file: our own JSON, or GarmentCode's, cut from cotton.
///
/// # Errors
/// Names the file and the panel, edge or seam at fault.
pub(crate) fn pattern(path: &Path) -> Result<Pattern> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    refuse_foreign_pattern(&bytes, path)?;
    let text =
        String::from_utf8(bytes).with_context(|| format!("{} is no text", path.display()))?;
    let name = path
        .file_stem()
        .and_then(|s| s.to_str())
        .unwrap_or("garment");
    if is_garmentcode(&text) {
        from_garmentcode(
            &parse_garmentcode(&text, path)?,
            name,
            Size::M,
            Material::preset("cotton")?,
        )
    } else {
        Pattern::from_json(&text)
    }
    .with_context(|| path.display().to_string())
}

/// Garments by library name, pattern file, mesh file or capture; with what is `given` for all of them.
///
/// # Errors
/// Names the unknown garment, size or fabric, or the fault in a file.
pub(crate) fn choices(names: &[String], given: &GivenChoice<'_>) -> Result<Vec<Choice>> {
    let size = given.size.map(str::parse::<Size>).transpose()?;
    let own = given.fabric.map(fabric).transpose()?.map(|f| f.material);
    let cotton = Material::preset("cotton")?;
    let material = own.as_ref().unwrap_or(&cotton);
    for file in names.iter().map(Path::new) {
        let is_file = is_mesh(file) || file.extension().is_some_and(|e| e == "json");
        ensure!(
            !is_file || file.exists(),
            "{}: no such garment file",
            file.display()
        );
    }
    let body = (given.body)
        .map(|(file, frame)| SourceBody::read_in(file, &frame))
        .transpose()
        .context("--garment-body")?;
    let mut chosen = Vec::new();
    for name in names {
        let path = Path::new(name);
        if let Some((folder, own)) = capture(path) {
            let garments = captured_garments(folder, own, material)?;
            chosen.extend(garments.into_iter().map(|g| Choice::mesh(g, size)));
        } else if name.ends_with(".json") || is_foreign_pattern(path) {
            chosen.push(Choice::Pattern(Box::new(pattern(path)?)));
        } else if is_mesh(path) {
            chosen.push(Choice::mesh(
                mesh_garment(path, body.clone(), given.frame, material)?,
                size,
            ));
        } else {
            chosen.push(Choice::library(name, size)?);
        }
    }
    Ok(match &own {
        Some(m) => chosen.into_iter().map(|c| c.in_fabric(m)).collect(),
        None => chosen,
    })
}

/// Choices for all garments; those without a value are found for each.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GivenChoice<'a> {
    /// Size, but of pattern files.
    pub(crate) size: Option<&'a str>,
    /// Body under the mesh files: its file, with unit and axes.
    pub(crate) body: Option<(&'a Path, MeshFrame)>,
    /// Unit and axes of the mesh files.
    pub(crate) frame: MeshFrame,
    /// Fabric: a preset's name or a file.
    pub(crate) fabric: Option<&'a str>,
}

/// Fabric by a preset's name or from a file: measured as by Wang et al. 2011, or a material.
///
/// # Errors
/// Lists the presets, or names the fault in the file.
pub(crate) fn fabric(name: &str) -> Result<FabricSample> {
    let path = Path::new(name);
    if !name.ends_with(".json") {
        return Ok(FabricSample::named(name)?);
    }
    let text =
        std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let stem = path
        .file_stem()
        .and_then(|s| s.to_str())
        .unwrap_or("fabric");
    let material = if text.contains("\"stretching\"") && !text.contains("\"measured\"") {
        Material::from_measured(stem, &parse_fabric(&text, path)?)?
    } else {
        serde_json::from_str(&text).with_context(|| path.display().to_string())?
    };
    material
        .check()
        .with_context(|| path.display().to_string())?;
    Ok(FabricSample::of_material(material))
}

/// Folder of a capture, and the name of the one garment of it where the path is `FOLDER/NAME`.
fn capture(path: &Path) -> Option<(&Path, Option<&str>)> {
    if CapturedWardrobe::is_in(path) {
        return Some((path, None));
    }
    let (folder, own) = (path.parent()?, path.file_name()?.to_str()?);
    let is_garment = !path.exists() && CapturedWardrobe::is_in(folder);
    is_garment.then_some((folder, Some(own)))
}

/// Garments of a capture, of `material`: all, or one by name.
fn captured_garments(
    folder: &Path,
    own: Option<&str>,
    material: &Material,
) -> Result<Vec<MeshGarment>> {
    let captured = CapturedWardrobe::read(folder, &embedded::template())?;
    let names = captured.names();
    let is_wanted = |k: &usize| own.is_none_or(|own| names[*k] == own);
    let wanted: Vec<usize> = (0..names.len()).filter(is_wanted).collect();
    ensure!(
        !wanted.is_empty(),
        "{} has no garment {}; there are {}",
        folder.display(),
        own.unwrap_or_default(),
        names.join(", ")
    );
    let edge = Triangulation::default().edge_length;
    let title = folder.file_name().unwrap_or_default().to_string_lossy();
    let garment = |k: usize| {
        let name = format!("{title}_{}", names[k]);
        let made = captured.garment(k, &name, material, edge);
        made.with_context(|| format!("{}: {}", folder.display(), names[k]))
    };
    wanted.into_iter().map(garment).collect()
}

fn is_mesh(path: &Path) -> bool {
    const ENDINGS: [&str; 4] = ["obj", "glb", "gltf", "mhclo"];
    path.extension()
        .and_then(|e| e.to_str())
        .is_some_and(|e| ENDINGS.contains(&e.to_ascii_lowercase().as_str()))
}

/// Mesh garment of `material`, made on `body`, which is guessed when absent.
pub(crate) fn mesh_garment(
    path: &Path,
    body: Option<SourceBody>,
    frame: MeshFrame,
    material: &Material,
) -> Result<MeshGarment> {
    let settings = MeshGarmentSettings::with_edge(Triangulation::default().edge_length);
    let file = GarmentFile { path, body, frame };
    MeshGarment::read_on(file, material, &settings).map_err(|e| match e {
        MeshGarmentError::Format(names_file) => names_file.into(),
        other => anyhow::Error::new(other).context(path.display().to_string()),
    })
}

/// Rough start in the camera frame, part of recordings with ground truth.
#[derive(Debug, Deserialize)]
pub(crate) struct RoughStart {
    /// Position of the root joint, metres.
    pub(crate) root_position: [f64; 3],
    /// Turn about the vertical, degrees; 0 faces the camera.
    pub(crate) facing_yaw_deg: f64,
}

/// Reads a rough start.
///
/// # Errors
/// When the file cannot be read, is no JSON of this form, or holds a number that is not finite.
pub(crate) fn rough_start(path: &Path) -> Result<RoughStart> {
    let text =
        std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let start: RoughStart = serde_json::from_str(&text)
        .with_context(|| format!("{} is no rough start", path.display()))?;
    let finite = start
        .root_position
        .iter()
        .chain([&start.facing_yaw_deg])
        .all(|v| v.is_finite());
    anyhow::ensure!(
        finite,
        "{}: root_position and facing_yaw_deg must be finite",
        path.display()
    );
    Ok(start)
}

/// Reads a JSON file.
///
/// # Errors
/// A file that cannot be read or is no JSON.
pub(crate) fn json(path: &Path) -> Result<serde_json::Value> {
    let text =
        std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is no JSON", path.display()))
}

/// Progress bar over frames; silent when standard error is no terminal.
pub(crate) fn progress(frames: Option<u64>, what: &'static str) -> ProgressBar {
    let (bar, template) = match frames {
        Some(n) => (
            ProgressBar::new(n),
            "{prefix} {bar:32} {pos}/{len} frames, {per_sec}, {eta} left {msg}",
        ),
        None => (
            ProgressBar::new_spinner(),
            "{prefix} {spinner} {pos} frames, {per_sec} {msg}",
        ),
    };
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = bar.with_style(style).with_prefix(what);
    // Shown before the first one is done, which takes longest.
    bar.enable_steady_tick(Duration::from_secs(1));
    bar
}

/// Creates a folder for results.
///
/// # Errors
/// When the system refuses.
pub(crate) fn create_dir(dir: &Path) -> Result<()> {
    std::fs::create_dir_all(dir)
        .with_context(|| format!("cannot create the folder {}", dir.display()))
}
