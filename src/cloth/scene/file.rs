//! Scene files: JSON beside OBJ meshes and sampled motions, or complete in themselves.

use super::collider_file::ColliderFile;
use super::description::{Scene, SceneError};
use crate::live::Sheet;
use crate::settings::SceneSettings;
use serde::Deserialize;
use std::path::Path;
use tryon_formats::FormatError;
use tryon_formats::obj::{parse_obj, read_obj};
use tryon_garment::{Bending, IsotropicSolid, Material};
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::TriMesh;

#[derive(Deserialize)]
struct SceneFile {
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
    material: MaterialFile,
    #[serde(default)]
    colliders: Vec<ColliderFile>,
    gravity: [f64; 3],
    duration_s: f64,
    output_fps: f64,
}

#[derive(Deserialize)]
struct MaterialFile {
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

/// Longest scene (s) and highest rate (1/s): beyond them a field is a mistake, and a result would not fit a disk.
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
    let file: SceneFile = serde_json::from_str(text).map_err(|e| fault("json", e.to_string()))?;
    file.check().map_err(|(field, why)| fault(field, why))?;
    let obj = match (&file.mesh, &file.mesh_obj, folder) {
        (Some(name), None, Some(folder)) => read_obj(&folder.join(name))?,
        (None, Some(obj), _) => parse_obj(obj, &origin.join("mesh_obj"))?,
        (Some(_), None, None) => {
            return Err(fault("mesh", "no files are read here: use mesh_obj".into()));
        }
        _ => return Err(fault("mesh", "one of mesh and mesh_obj is needed".into())),
    };
    // A scene is simulated as it is written.
    if obj.dropped > 0 {
        return Err(fault("mesh", obj.notes.join("; ")));
    }
    let mesh = obj.mesh;
    file.check_pins(mesh.vertices().len())
        .map_err(|(field, why)| fault(field, why))?;
    let material = file.material.fabric();
    let collider = |(i, c): (usize, &ColliderFile)| {
        c.read(folder)
            .map_err(|why| fault(&format!("colliders[{i}]"), why))
    };
    let colliders = file.colliders.iter().enumerate().map(collider);
    Ok(Scene {
        colliders: colliders.collect::<Result<_, _>>()?,
        sheet: sheet(&mesh, &material)?,
        material,
        faces: mesh.faces().to_vec(),
        start: mesh.vertices().to_vec(),
        pinned_to: file.carrier().map_err(|(field, why)| fault(field, why))?,
        pins: file.pinned_vertices,
        gravity: V3d::from(file.gravity),
        duration: file.duration_s,
        rate: file.output_fps,
        settings: SceneSettings::default(),
    })
}

/// Field and fault.
type FieldFault = (&'static str, String);

impl SceneFile {
    fn check(&self) -> Result<(), FieldFault> {
        let (duration, rate) = (self.duration_s, self.output_fps);
        if !(duration > 0.0 && duration <= LONGEST) {
            let why = format!("{duration} is not in 0 to {LONGEST} s");
            return Err(("duration_s", why));
        }
        if !(rate > 0.0 && rate <= HIGHEST_RATE) {
            return Err((
                "output_fps",
                format!("{rate} is not in 0 to {HIGHEST_RATE}"),
            ));
        }
        if !self.gravity.iter().all(|g| g.is_finite()) {
            return Err(("gravity", "must be finite".into()));
        }
        Ok(())
    }
    fn check_pins(&self, vertices: usize) -> Result<(), FieldFault> {
        let mut pins = self.pinned_vertices.iter();
        match pins.find(|v| **v as usize >= vertices) {
            Some(v) => Err((
                "pinned_vertices",
                format!("{v}: the mesh has {vertices} vertices"),
            )),
            None => Ok(()),
        }
    }
    /// Collider that carries the pins.
    fn carrier(&self) -> Result<Option<usize>, FieldFault> {
        match self.pinned_to.as_deref() {
            None | Some("world") => Ok(None),
            Some("body") if !self.colliders.is_empty() => Ok(Some(0)),
            Some(other) => Err((
                "pinned_to",
                format!("`{other}`: `body` needs a collider, else `world`"),
            )),
        }
    }
}

impl MaterialFile {
    /// Fabric without damping. The membrane is given as force per width, so any thickness makes the same sheet.
    fn fabric(&self) -> Material {
        let solid = IsotropicSolid {
            young: self.young_membrane / self.thickness,
            poisson: self.poisson,
            density: self.area_density / self.thickness,
        };
        Material {
            bending: Bending::uniform(self.bending_rigidity),
            friction: self.friction,
            damping: 0.0,
            ..Material::isotropic(&self.name, solid, self.thickness, "scene file")
        }
    }
}

/// Sheet whose rest shape is the mesh.
fn sheet(mesh: &TriMesh, material: &Material) -> Result<Sheet, SceneError> {
    let rest: Vec<[[f64; 2]; 3]> = (0..mesh.faces().len())
        .map(|f| flat(mesh.corners(f).map(|p| p.coords.cast())))
        .collect();
    let (vertices, faces) = (mesh.vertices(), mesh.faces());
    Ok(Sheet::new(
        vertices.len(),
        faces,
        &rest,
        material,
        Some(vertices),
    )?)
}

/// A triangle laid flat: its first edge along x.
pub(super) fn flat([a, b, c]: [V3d; 3]) -> [[f64; 2]; 3] {
    let (e, d) = (b - a, c - a);
    let l = e.norm().max(f64::MIN_POSITIVE);
    let x = d.dot(&e) / l;
    [[0.0, 0.0], [l, 0.0], [x, e.cross(&d).norm() / l]]
}
