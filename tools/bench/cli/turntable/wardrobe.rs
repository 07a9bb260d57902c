//! Garments of the turntable: the library, pattern files and meshes.

use super::Case;
use anyhow::Result;
use std::path::Path;
use tryon::body::measure::Measurements;
use tryon::dressing::{GarmentFile, GarmentSource, MeshGarment, MeshGarmentSettings, suggest};
use tryon::formats::garmentcode::{is_garmentcode, parse_garmentcode};
use tryon::garment::import::from_garmentcode;
use tryon::garment::{Material, Pattern, Size, Triangulation, library};

/// A garment to put on.
pub(super) enum Garment {
    Pattern(Box<Pattern>),
    Mesh(Box<MeshGarment>),
}

impl Garment {
    /// Loads a garment by name or file; a library garment in the case's size, or the suggested one for "auto".
    pub(super) fn load(case: &Case<'_>, name: &str, measures: &Measurements) -> Result<Self> {
        if name.ends_with(".json") {
            return Ok(Self::Pattern(Box::new(imported(Path::new(name))?)));
        }
        let is_mesh = |e: &&str| name.ends_with(*e);
        if [".obj", ".glb", ".gltf", ".mhclo"].iter().any(is_mesh) {
            let fabric = Material::preset("cotton")?;
            let edge = case
                .args
                .edge
                .unwrap_or(Triangulation::default().edge_length);
            let settings = MeshGarmentSettings::with_edge(edge);
            let file = GarmentFile::new(Path::new(name), case.source.cloned());
            let mesh = MeshGarment::read_on(file, &fabric, &settings)?;
            mesh.notes.iter().for_each(|n| println!("  {n}"));
            return Ok(Self::Mesh(Box::new(mesh)));
        }
        let chosen = match case.size {
            "auto" => {
                let s = suggest(name, measures)?;
                println!("{}: {name}: {}", case.body, s.reason);
                s.size
            }
            s => s.parse()?,
        };
        Ok(Self::Pattern(Box::new(library::pattern(name, chosen)?)))
    }

    pub(super) fn wear(&self) -> GarmentSource<'_> {
        match self {
            Self::Pattern(p) => GarmentSource::Pattern(p),
            Self::Mesh(m) => GarmentSource::Mesh(m),
        }
    }
}

/// A pattern file: GarmentCode's or our own.
fn imported(path: &Path) -> Result<Pattern> {
    let text = std::fs::read_to_string(path)?;
    if !is_garmentcode(&text) {
        return Ok(Pattern::from_json(&text)?);
    }
    let name = path.file_stem().and_then(|s| s.to_str());
    let material = Material::preset("cotton")?;
    let raw = parse_garmentcode(&text, path)?;
    Ok(from_garmentcode(
        &raw,
        name.unwrap_or("garment"),
        Size::M,
        material,
    )?)
}
