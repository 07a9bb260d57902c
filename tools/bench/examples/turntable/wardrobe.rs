//! Garments of the turntable: the library, pattern files and meshes.

use crate::args::Args;
use std::path::Path;
use tryon::body::measure::Measurements;
use tryon::dressing::{GarmentSource, MeshGarment, MeshGarmentSettings, suggest};
use tryon::garment::{Pattern, Triangulation, library};

/// A garment to put on.
pub(crate) enum Garment {
    Pattern(Box<Pattern>),
    Mesh(Box<MeshGarment>),
}

impl Garment {
    /// Loads a garment by name or file; a library garment in `size`, or the suggested one for "auto".
    pub(crate) fn load(
        a: &Args,
        name: &str,
        body: &str,
        size: &str,
        measures: &Measurements,
    ) -> Self {
        if name.ends_with(".json") {
            return Self::Pattern(Box::new(imported(name)));
        }
        let is_mesh = |e: &&str| name.ends_with(*e);
        if [".obj", ".glb", ".gltf", ".mhclo"].iter().any(is_mesh) {
            let fabric = tryon::garment::Material::preset("cotton").expect("preset");
            let edge = a.edge.unwrap_or(Triangulation::default().edge_length);
            let settings = MeshGarmentSettings::with_edge(edge);
            let body = a.garment_body.clone();
            let mesh = MeshGarment::read_on(Path::new(name), body, &fabric, &settings);
            let mesh = mesh.expect("a garment");
            mesh.notes.iter().for_each(|n| println!("  {n}"));
            return Self::Mesh(Box::new(mesh));
        }
        let chosen = match size {
            "auto" => {
                let s = suggest(name, measures).expect("a size");
                println!("{body}: {name}: {}", s.reason);
                s.size
            }
            s => s.parse().expect("a size"),
        };
        Self::Pattern(Box::new(library::pattern(name, chosen).expect("a pattern")))
    }

    pub(crate) fn wear(&self) -> GarmentSource<'_> {
        match self {
            Self::Pattern(p) => GarmentSource::Pattern(p),
            Self::Mesh(m) => GarmentSource::Mesh(m),
        }
    }
}

/// A pattern file: GarmentCode's or our own.
fn imported(file: &str) -> Pattern {
    let path = Path::new(file);
    let text = std::fs::read_to_string(path).expect("readable");
    if !tryon::formats::garmentcode::is_garmentcode(&text) {
        return Pattern::from_json(&text).expect("a pattern");
    }
    let raw = tryon::formats::garmentcode::parse_garmentcode(&text, path).expect("a pattern");
    let material = tryon::garment::Material::preset("cotton").expect("preset");
    let name = path
        .file_stem()
        .and_then(|s| s.to_str())
        .unwrap_or("garment");
    tryon::garment::import::from_garmentcode(&raw, name, tryon::garment::Size::M, material)
        .expect("a pattern")
}
