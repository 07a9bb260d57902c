//! The body that a mesh garment was made on: read from a file, or the embedded one fitted under the garment.

use super::body_guess::{guess, locate};
use super::error::MeshGarmentError;
use super::file_frame::FileFrame;
use super::rig_standing::rig_standing;
use super::settings::GuessSettings;
use nalgebra::Matrix3;
use std::path::Path;
use std::sync::Arc;
use tryon_body::import::{StandingFrame, read_body};
use tryon_body::{BodyError, Template, embedded};
use tryon_formats::mesh_frame::{MeshFrame, upright_rotation};
use tryon_formats::obj::read_obj;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Face, MeshError, Topology, TriMesh};

/// A body in the pose and place in which garments were made on it.
#[derive(Clone, Debug)]
pub struct SourceBody {
    /// Metres, y up, facing +z.
    pub(super) template: Arc<Template>,
    /// All vertices of its file, in the file's unit: MakeHuman's clothes are bound to helpers beyond the skin too.
    pub(super) file: Vec<P3>,
    frame: FileFrame,
    /// False for a guess: a guess has no size.
    pub(super) is_known: bool,
    /// Its origin in words, for people.
    pub description: String,
}

impl SourceBody {
    /// As [`Self::read_in`], in a frame that the body itself shows.
    ///
    /// # Errors
    /// As [`Self::read_in`].
    pub fn read(path: &Path) -> Result<Self, MeshGarmentError> {
        Self::read_in(path, &MeshFrame::default())
    }
    /// Reads a body: `.npz` in SMPL layout (its rest pose), or `.obj`: a body that stands upright with its arms away from
    /// its sides. Unit and axes are recognised from the body, or `stated`. An OBJ's skeleton is found by [`rig_standing`];
    /// only its largest component is skin.
    ///
    /// # Errors
    /// A fault of the file, a body whose frame is unclear, or a mesh in which no person is found.
    pub fn read_in(path: &Path, stated: &MeshFrame) -> Result<Self, MeshGarmentError> {
        let name = path
            .file_name()
            .map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        let described = |notes: &[String]| match notes.is_empty() {
            true => name.clone(),
            false => format!("{name} ({})", notes.join("; ")),
        };
        if path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("npz"))
        {
            let body = read_body(path, stated)?;
            return Ok(Self {
                description: described(&body.notes),
                // Garments made on it have the frame of its file.
                file: body.file_vertices,
                frame: FileFrame {
                    scale: body.metres_per_unit as f32,
                    rotation: body.matrix.cast(),
                    shift: V3::zeros(),
                },
                template: Arc::new(body.template),
                is_known: true,
            });
        }
        let mesh = read_obj(path)?.mesh;
        let unknown =
            |why: String| MeshGarmentError::NotFound(format!("{}: {why}", path.display()));
        let skin = largest_component(&mesh).map_err(BodyError::Mesh)?;
        let standing = StandingFrame::find(&skin, stated).map_err(unknown)?;
        let rotation =
            upright_rotation(standing.up, standing.facing).unwrap_or_else(Matrix3::identity);
        let frame = FileFrame {
            scale: standing.metres_per_unit as f32,
            rotation: rotation.cast(),
            shift: V3::zeros(),
        };
        let vertices = skin.vertices().iter().map(|p| frame.to_metres(p)).collect();
        let faces = skin.faces().iter().map(|f| match standing.is_inside_out {
            true => [f[0], f[2], f[1]],
            false => *f,
        });
        let skin = TriMesh::new(vertices, faces.collect()).map_err(BodyError::Mesh)?;
        let (template, fit) = rig_standing(skin).map_err(|why| unknown(format!("{why}; its frame was taken as {} up, facing {}: say `--up` and `--facing` if it is another", standing.up, standing.facing)))?;
        Ok(Self {
            template: Arc::new(template),
            file: mesh.vertices().to_vec(),
            frame,
            is_known: true,
            description: format!(
                "{}, skeleton found within {:.0} mm",
                described(&standing.notes),
                fit * 1e3
            ),
        })
    }
    /// The embedded body, scaled, moved and with its arms turned so that garment vertices lie just above its skin: a
    /// garment constrains the body inside it only loosely.
    ///
    /// # Errors
    /// When no body fits into them.
    pub fn guess(garment: &[P3]) -> Result<Self, MeshGarmentError> {
        Self::guess_with(garment, &GuessSettings::default())
    }
    /// As [`Self::guess`], with other settings.
    ///
    /// # Errors
    /// As [`Self::guess`].
    pub fn guess_with(garment: &[P3], settings: &GuessSettings) -> Result<Self, MeshGarmentError> {
        let (template, frame) = guess(&embedded::template(), garment, settings)?;
        let stature = template.mesh().bounds().map_or(0.0, |(lo, hi)| hi.y - lo.y);
        let description = format!(
            "a guess: our body, {:.0} cm tall, its floor {:.0} cm below the file's zero",
            stature * 100.0,
            frame.shift.y * 100.0
        );
        Ok(Self {
            template,
            file: Vec::new(),
            frame,
            is_known: false,
            description,
        })
    }
    /// A body in its rest pose: a template that stands upright, y up, metres.
    pub fn of_template(template: Arc<Template>) -> Self {
        Self {
            file: template.mesh().vertices().to_vec(),
            frame: FileFrame::metres(),
            is_known: true,
            description: template.name().to_owned(),
            template,
        }
    }
    /// The same body under a garment whose file has a unit and place of its own.
    pub(super) fn under(self, garment: &[P3], settings: &GuessSettings) -> Self {
        let frame = locate(&self.template, garment, settings);
        Self { frame, ..self }
    }
    /// Metres in a unit of the file.
    pub(super) fn unit(&self) -> f32 {
        self.frame.scale
    }
    /// Points of the garment's or the body's file in the frame of the template, metres.
    pub(super) fn to_metres(&self, p: &[P3]) -> Vec<P3> {
        p.iter().map(|p| self.frame.to_metres(p)).collect()
    }
}

fn largest_component(mesh: &TriMesh) -> Result<TriMesh, MeshError> {
    let (label, count) = Topology::new(mesh)?.components();
    let mut sizes = vec![0usize; count];
    label.iter().for_each(|l| sizes[*l as usize] += 1);
    let largest = (0..count)
        .max_by_key(|c| (sizes[*c], std::cmp::Reverse(*c)))
        .unwrap_or(0) as u32;
    let mut index = vec![u32::MAX; label.len()];
    let mut vertices = Vec::new();
    for (i, _) in label.iter().enumerate().filter(|(_, l)| **l == largest) {
        index[i] = vertices.len() as u32;
        vertices.push(mesh.vertices()[i]);
    }
    let own = |f: &&Face| label[f[0] as usize] == largest;
    let faces = mesh.faces().iter().filter(own);
    let faces = faces.map(|f| f.map(|v| index[v as usize])).collect();
    TriMesh::new(vertices, faces)
}
