//! Scenes as plain data: one sheet, pins, moving primitives. What `tryon simulate` runs and benchmarks compare.

mod baseline;
mod collider;
mod run;
mod small;

pub use collider::{Collider, Primitive};
pub use run::{Method, RunConfig, RunReport, run, write_positions};

use super::{ClothError, Sheet};
use crate::formats::FormatError;
use crate::formats::obj::{parse_obj, read_obj};
use crate::garment::Material;
use crate::math::{P3, V3d};
use crate::mesh::Face;
use serde::Deserialize;
use std::path::Path;

/// A scene that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A file of the scene cannot be read.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A field holds something that cannot be used.
    #[error("{scene}: {field}: {why}")]
    Field {
        /// The scene file.
        scene: String,
        /// The field.
        field: String,
        /// What is wrong.
        why: String,
    },
    /// The sheet or its simulation is at fault.
    #[error(transparent)]
    Cloth(#[from] ClothError),
}

/// A scene, checked.
#[derive(Debug)]
pub struct Scene {
    /// The cloth.
    pub sheet: Sheet,
    /// Its triangles.
    pub faces: Vec<Face>,
    /// Start positions, metres, world (y up); the rest shape.
    pub start: Vec<P3>,
    /// Vertices that are held.
    pub pins: Vec<u32>,
    /// Collider that carries the pins; `None` holds them in place.
    pub pinned_to: Option<usize>,
    /// Solid bodies.
    pub colliders: Vec<Collider>,
    /// m/s².
    pub gravity: V3d,
    /// Length, s.
    pub duration: f64,
    /// Frames a second of the output.
    pub rate: f64,
}

impl Scene {
    /// Frames of the output, the start included.
    pub fn frames(&self) -> usize {
        (self.duration * self.rate).round() as usize + 1
    }
}

#[derive(Deserialize)]
struct File {
    /// OBJ file beside the scene.
    #[serde(default)]
    mesh: Option<String>,
    /// OBJ text, instead of a file.
    #[serde(default)]
    mesh_obj: Option<String>,
    #[serde(default)]
    pinned_vertices: Vec<u32>,
    #[serde(default)]
    pinned_to: Option<String>,
    material: FileMaterial,
    #[serde(default)]
    colliders: Vec<collider::FileCollider>,
    gravity: [f64; 3],
    duration_s: f64,
    output_fps: f64,
}

#[derive(Deserialize)]
struct FileMaterial {
    #[serde(default)]
    name: String,
    #[serde(rename = "area_density_kg_m2")]
    area_density: f64,
    #[serde(rename = "thickness_m")]
    thickness: f64,
    #[serde(rename = "young_membrane_N_m")]
    young_membrane: f64,
    poisson: f64,
    #[serde(rename = "bending_rigidity_N_m")]
    bending_rigidity: f64,
    friction: f64,
}

/// Longest scene, s, and highest rate: beyond them a field is a mistake, and a result would not fit a disk.
const LONGEST: f64 = 600.0;
const HIGHEST_RATE: f64 = 1000.0;

/// Reads a scene file and the meshes beside it.
///
/// # Errors
/// Names the field, file, face or vertex at fault.
pub fn load(path: &Path) -> Result<Scene, SceneError> {
    let text = std::fs::read_to_string(path).map_err(|e| FormatError::io(path, e))?;
    parse(&text, path, Some(path.parent().unwrap_or(Path::new("."))))
}

/// Reads scene text; `origin` is named in errors. Without a folder the scene must be complete in itself: `mesh_obj`
/// instead of `mesh`, `motion` instead of `motion_csv`.
///
/// # Errors
/// As [`load`], and when a scene without a folder names a file.
pub fn parse(text: &str, origin: &Path, folder: Option<&Path>) -> Result<Scene, SceneError> {
    let fault = |field: &str, why: String| SceneError::Field {
        scene: origin.display().to_string(),
        field: field.to_owned(),
        why,
    };
    let file: File = serde_json::from_str(text).map_err(|e| fault("json", e.to_string()))?;
    if !(file.duration_s > 0.0 && file.duration_s <= LONGEST) {
        return Err(fault(
            "duration_s",
            format!("{} is not in 0 to {LONGEST} s", file.duration_s),
        ));
    }
    if !(file.output_fps > 0.0 && file.output_fps <= HIGHEST_RATE) {
        return Err(fault(
            "output_fps",
            format!("{} is not in 0 to {HIGHEST_RATE}", file.output_fps),
        ));
    }
    if !file.gravity.iter().all(|g| g.is_finite()) {
        return Err(fault("gravity", "must be finite".into()));
    }
    let mesh = match (&file.mesh, &file.mesh_obj, folder) {
        (Some(name), None, Some(folder)) => read_obj(&folder.join(name))?.mesh,
        (None, Some(obj), _) => parse_obj(obj, &origin.join("mesh_obj"))?.mesh,
        (Some(_), None, None) => {
            return Err(fault("mesh", "no files are read here: use mesh_obj".into()));
        }
        _ => return Err(fault("mesh", "one of mesh and mesh_obj is needed".into())),
    };
    if let Some(v) = file
        .pinned_vertices
        .iter()
        .find(|v| **v as usize >= mesh.vertices().len())
    {
        return Err(fault(
            "pinned_vertices",
            format!("{v}: the mesh has {} vertices", mesh.vertices().len()),
        ));
    }
    let colliders = file
        .colliders
        .iter()
        .enumerate()
        .map(|(i, c)| {
            Collider::read(c, folder).map_err(|why| fault(&format!("colliders[{i}]"), why))
        })
        .collect::<Result<Vec<_>, _>>()?;
    let pinned_to = match file.pinned_to.as_deref() {
        None | Some("world") => None,
        Some("body") if !colliders.is_empty() => Some(0),
        Some(other) => {
            return Err(fault(
                "pinned_to",
                format!("`{other}`: `body` needs a collider, else `world`"),
            ));
        }
    };
    let m = &file.material;
    // The membrane is given as force per width, so any thickness makes the same sheet.
    let mut material = Material::isotropic(
        &m.name,
        m.young_membrane / m.thickness,
        m.poisson,
        m.area_density / m.thickness,
        m.thickness,
        "scene file",
    );
    (material.bending, material.friction, material.damping) = (m.bending_rigidity, m.friction, 0.0);
    let rest: Vec<[[f64; 2]; 3]> = (0..mesh.faces().len())
        .map(|f| flat(&mesh.corners(f)))
        .collect();
    let sheet = Sheet::new(
        mesh.vertices().len(),
        mesh.faces(),
        &rest,
        &material,
        Some(mesh.vertices()),
    )?;
    Ok(Scene {
        sheet,
        faces: mesh.faces().to_vec(),
        start: mesh.vertices().to_vec(),
        pins: file.pinned_vertices,
        pinned_to,
        colliders,
        gravity: V3d::from(file.gravity),
        duration: file.duration_s,
        rate: file.output_fps,
    })
}

/// A triangle laid flat: its first edge along x.
fn flat(corners: &[P3; 3]) -> [[f64; 2]; 3] {
    let [a, b, c] = corners.map(|p| p.coords.cast::<f64>());
    let (e, d) = (b - a, c - a);
    let l = e.norm().max(f64::MIN_POSITIVE);
    let x = d.dot(&e) / l;
    [[0.0, 0.0], [l, 0.0], [x, e.cross(&d).norm() / l]]
}
