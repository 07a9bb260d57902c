//! A body's file in SMPL's layout, checked and brought to metres, y up, facing +z.

use super::file_error::BodyFileError;
use super::file_frame::BodyFrame;
use super::joint_names::{NamedJoints, name_joints};
use super::template_from_smpl;
use crate::Template;
use crate::human_joints::SideBasis;
use nalgebra::Matrix3;
use std::path::Path;
use tryon_formats::mesh_frame::MeshFrame;
use tryon_formats::npz::{SmplArrays, read_smpl};
use tryon_geometry::math::P3;

/// Most boundary edges over all edges: nostrils and eye sockets may be open, a doll of loose patches is not.
const OPEN: f64 = 0.02;

/// A body of a file.
#[derive(Clone, Debug)]
pub struct BodyFile {
    /// Metres, y up, facing +z.
    pub template: Template,
    /// Vertices as in the file, in its unit and axes.
    pub file_vertices: Vec<P3>,
    /// Metres in a unit of the file.
    pub metres_per_unit: f64,
    /// Rotation from the file's axes to y up, facing +z; a reflection for a mirrored body.
    pub matrix: Matrix3<f64>,
    /// Statements about what was recognised, changed or left out, one a sentence.
    pub notes: Vec<String>,
}

/// Reads a body in SMPL's layout (SMPL, SMPL+H, SMPL-X, STAR, MakeHuman and others): unit, axes, handedness and the joints'
/// parts are recognised from the body; `stated` overrules the unit and is checked against the rest.
///
/// # Errors
/// Names the file, and the array, joint or measure at fault with the option that says it.
pub fn read_body(path: &Path, stated: &MeshFrame) -> Result<BodyFile, BodyFileError> {
    let arrays = read_smpl(path)?;
    let name = path
        .file_stem()
        .map_or_else(|| "body".into(), |n| n.to_string_lossy());
    body_of_arrays(&name, arrays, stated).map_err(|why| BodyFileError::At {
        file: path.to_owned(),
        why: Box::new(why),
    })
}

/// As [`read_body`], from arrays in any frame.
///
/// # Errors
/// As [`read_body`].
pub fn body_of_arrays(
    name: &str,
    mut arrays: SmplArrays,
    stated: &MeshFrame,
) -> Result<BodyFile, BodyFileError> {
    if !arrays.has_names {
        arrays.joint_names.clear();
    }
    let named = name_joints(&arrays)?;
    let frame = BodyFrame::find(&arrays, &named, stated).map_err(BodyFileError::Frame)?;
    let file_vertices = arrays.vertices.iter().map(|v| P3::from(*v)).collect();
    let mut arrays = frame.apply(arrays);
    let mut notes = frame.notes.clone();
    if !arrays.pose_directions.of_second_shape.is_empty() && arrays.shape_directions.len() < 2 {
        notes.push(
            "`posedirs` has offsets of a second shape coefficient that `shapedirs` lacks: left out"
                .into(),
        );
    }
    notes.extend(adopt_names(&mut arrays, named, frame.is_mirrored()));
    let template = template_from_smpl(name, &arrays)?;
    notes.extend(openness(&template)?);
    Ok(BodyFile {
        template,
        file_vertices,
        metres_per_unit: frame.unit,
        matrix: frame.matrix,
        notes,
    })
}

/// Sets the joints' names; the file's own stay where they name a person's joints as SMPL does.
fn adopt_names(arrays: &mut SmplArrays, named: NamedJoints, is_mirrored: bool) -> Option<String> {
    let swapped = |name: &String| match (name.strip_prefix("left_"), name.strip_prefix("right_")) {
        (Some(part), _) => format!("right_{part}"),
        (_, Some(part)) => format!("left_{part}"),
        _ => name.clone(),
    };
    let names: Vec<String> = match is_mirrored {
        true => named.names.iter().map(swapped).collect(),
        false => named.names,
    };
    let is_same = |k: &usize| arrays.joint_names.get(*k) == names.get(*k);
    if arrays.has_names && named.parts.iter().all(is_same) {
        return None;
    }
    let told = match named.basis {
        SideBasis::Ahead | SideBasis::AgainstNames => "left by the way its feet point",
        SideBasis::Both => "left by its names and feet",
        SideBasis::Names => "left by its names",
    };
    let count = names.len();
    arrays.joint_names = names;
    Some(format!(
        "{count} joints named by the tree and their places, {told}"
    ))
}

/// A note about an open surface.
///
/// # Errors
/// A surface with too much of a boundary.
fn openness(template: &Template) -> Result<Option<String>, BodyFileError> {
    let topology = template.topology();
    if topology.is_closed() {
        return Ok(None);
    }
    let boundary = tryon_geometry::mesh::boundary_edges(template.mesh().faces()).len();
    let share = boundary as f64 / topology.edges().len().max(1) as f64;
    if share > OPEN {
        return Err(BodyFileError::Frame(format!(
            "its surface is open along {:.0} % of its edges, expected at most {:.0} %: weld its vertices",
            100.0 * share,
            100.0 * OPEN
        )));
    }
    Ok(Some(format!("its surface has holes of {boundary} edges")))
}
