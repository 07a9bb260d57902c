//! The body that a mesh garment was made on: read from a file, or the embedded one fitted under the garment.

use super::error::MeshGarmentError;
use super::file_frame::{FileAxes, FileFrame};
use super::frame_search::{fits, guess, locate};
use super::rig_standing::rig_standing;
use super::settings::{AvatarSettings, GuessSettings};
use std::path::Path;
use std::sync::Arc;
use tryon_body::import::{StandingFrame, read_body};
use tryon_body::{BodyError, SkinSearch, Template, embedded};
use tryon_formats::mesh_frame::MeshFrame;
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
        let axes = FileAxes {
            unit: standing.metres_per_unit,
            up: standing.up,
            facing: standing.facing,
        };
        let frame = axes.frame();
        let skin = framed(&skin, frame, standing.is_inside_out).map_err(BodyError::Mesh)?;
        let (template, fit) = rig_standing(skin).map_err(|why| {
            unknown(format!(
                "{why}; it was taken as {axes}: say `{}` and `{}` if it is another way",
                stated.options.up, stated.options.facing
            ))
        })?;
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
    pub fn guess(
        garment: &[P3],
        stated: &MeshFrame,
        settings: &GuessSettings,
    ) -> Result<Self, MeshGarmentError> {
        let found = guess(&embedded::template(), garment, stated, settings)?;
        let (template, frame) = (found.template, found.frame);
        let stature = template.mesh().bounds().map_or(0.0, |(lo, hi)| hi.y - lo.y);
        let description = format!(
            "a guess: our body, {:.0} cm tall, its floor {:.0} cm below the file's zero; the file is {}",
            stature * 100.0,
            frame.shift.y * 100.0,
            found.axes
        );
        Ok(Self {
            template,
            file: Vec::new(),
            frame,
            is_known: false,
            description,
        })
    }
    /// The person that a mesh shows, in the unit and axes of its file; `None` if it shows none.
    ///
    /// # Errors
    /// A mesh at fault.
    pub(super) fn of_avatar(
        mesh: &TriMesh,
        stated: &MeshFrame,
        settings: &AvatarSettings,
    ) -> Result<Option<Self>, MeshGarmentError> {
        let guess_settings = GuessSettings::default();
        let Ok(found) = guess(
            &embedded::template(),
            mesh.vertices(),
            stated,
            &guess_settings,
        ) else {
            return Ok(None);
        };
        let skin = largest_component(mesh).map_err(BodyError::Mesh)?;
        let skin = framed(&skin, found.frame, false).map_err(BodyError::Mesh)?;
        let rigged = rig_standing(skin).ok();
        let Some((template, fit)) = rigged.filter(|(_, fit)| *fit < settings.residual) else {
            return Ok(None);
        };
        Ok(Some(Self {
            template: Arc::new(template),
            file: mesh.vertices().to_vec(),
            frame: found.frame,
            is_known: true,
            description: format!(
                "the person in the file ({}), skeleton found within {:.0} mm",
                found.axes,
                fit * 1e3
            ),
        }))
    }
    /// True for points of the file that lie at or below the skin, such as eyes.
    pub(super) fn is_part_of_skin(&self, points: &[P3], settings: &AvatarSettings) -> bool {
        let body = self.template.mesh().vertices();
        let skin = SkinSearch::new(&self.template, body, 0.0);
        let is_at_skin = |p: &&P3| {
            let p = self.frame.to_metres(p);
            let near = skin.nearest(&p, &V3::zeros(), 1.0);
            near.is_some_and(|(v, _)| skin.height(&p, v) < settings.skin)
        };
        2 * points.iter().filter(is_at_skin).count() > points.len()
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
    /// The same body under a garment whose file has a unit, axes and place of its own.
    ///
    /// # Errors
    /// As [`Self::guess`].
    pub(super) fn under(
        self,
        garment: &[P3],
        stated: &MeshFrame,
        settings: &GuessSettings,
    ) -> Result<Self, MeshGarmentError> {
        let (frame, axes) = locate(&self.template, garment, stated, settings)?;
        let description = format!("{}; the garment's file is {axes}", self.description);
        Ok(Self {
            frame,
            description,
            ..self
        })
    }
    /// The same body under a garment that is made in the body's frame, unless it lies over the body in another one only.
    ///
    /// # Errors
    /// As [`Self::guess`].
    pub(super) fn wearing(
        self,
        garment: &[P3],
        stated: &MeshFrame,
        settings: &GuessSettings,
    ) -> Result<Self, MeshGarmentError> {
        if *stated == MeshFrame::default() && fits(&self.template, garment, self.frame, settings) {
            return Ok(self);
        }
        self.under(garment, stated, settings)
    }
    /// From its file to metres.
    pub(super) fn frame(&self) -> FileFrame {
        self.frame
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

/// A mesh in metres, y up, facing +z, its faces turned over if they look inwards.
fn framed(mesh: &TriMesh, frame: FileFrame, is_inside_out: bool) -> Result<TriMesh, MeshError> {
    let vertices = mesh.vertices().iter().map(|p| frame.to_metres(p)).collect();
    let faces = mesh.faces().iter().map(|f| match is_inside_out {
        true => [f[0], f[2], f[1]],
        false => *f,
    });
    TriMesh::new(vertices, faces.collect())
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
