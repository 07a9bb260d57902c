//! Unit, axes and handedness of a body's arrays, from its joints and its skin; and the arrays in metres, y up, facing +z.

use super::joint_names::{NamedJoints, centroid_below};
use super::stature::{check_volume, unit_note, unit_of_stature};
use crate::human_joints::{JointTree, SideBasis};
use crate::pose_features::turn_features;
use nalgebra::{Matrix3, Point3, Vector3, center};
use tryon_formats::PoseDirections;
use tryon_formats::mesh_frame::{MeshAxis, MeshFrame, upright_rotation};
use tryon_formats::npz::SmplArrays;

/// Cosine from an axis up to which a body stands along it: a lean of 25°.
const ALONG: f64 = 0.9;
/// Component ahead of the feet's skin from the ankles, over the stature: people have 0.02 to 0.03.
const TOES: f64 = 0.008;

/// Map of a file's arrays to the project's frame.
pub(super) struct BodyFrame {
    /// Rotation, or a reflection for a mirrored body.
    pub(super) matrix: Matrix3<f64>,
    /// Metres in a unit of the file.
    pub(super) unit: f64,
    is_mirrored: bool,
    is_inside_out: bool,
    /// Statements about what was recognised and changed.
    pub(super) notes: Vec<String>,
}

impl BodyFrame {
    /// Recognises the frame of a body; what is stated is checked against it.
    ///
    /// # Errors
    /// One sentence with the option that says what the body does not.
    pub(super) fn find(
        arrays: &SmplArrays,
        named: &NamedJoints,
        stated: &MeshFrame,
    ) -> Result<Self, String> {
        let (up, lateral) = directions(arrays, named);
        let up = axis(stated.options.up, up, stated.up)?;
        let facing = facing(arrays, named, Vector3::from(up.vector()), lateral, stated)?;
        let rotation = upright_rotation(up, facing)
            .ok_or_else(|| format!("its {up} up and {facing} ahead lie along one axis"))?;
        let stature = extent(arrays, Vector3::from(up.vector()));
        let unit = unit_of_stature(stature, stated)?;
        let mut notes = Vec::from_iter(unit_note(stature, unit));
        if (up, facing) != (MeshAxis::Y, MeshAxis::Z) {
            notes.push(format!(
                "{up} up, facing {facing}: turned to y up, facing z"
            ));
        }
        let volume = volume(arrays) * unit.powi(3);
        let is_inverted = volume < 0.0;
        let is_mirrored = is_inverted && named.basis == SideBasis::AgainstNames;
        match (is_inverted, named.basis) {
            (true, SideBasis::AgainstNames) => notes.push(
                "mirrored (its left is named right, its faces look inwards): mirrored back".into(),
            ),
            (true, _) => notes.push("its faces look inwards: turned over".into()),
            (false, SideBasis::AgainstNames) => {
                notes.push("joints named left are on the right of its way ahead: named anew".into())
            }
            (false, _) => {}
        }
        check_volume(volume.abs(), stature * unit)?;
        let mirror = Vector3::new(if is_mirrored { -1.0 } else { 1.0 }, 1.0, 1.0);
        Ok(Self {
            matrix: Matrix3::from_diagonal(&mirror) * rotation,
            unit,
            is_mirrored,
            is_inside_out: is_inverted && !is_mirrored,
            notes,
        })
    }

    /// The sides of the joints change places.
    pub(super) fn is_mirrored(&self) -> bool {
        self.is_mirrored
    }

    /// The arrays in metres, y up, facing +z.
    pub(super) fn apply(&self, mut arrays: SmplArrays) -> SmplArrays {
        let is_identity = self.matrix == Matrix3::identity() && self.unit == 1.0;
        if !is_identity {
            let map = self.matrix * self.unit;
            let single = |p: &mut [f32; 3]| {
                *p = (map * Vector3::from(p.map(f64::from)))
                    .map(|c| c as f32)
                    .into()
            };
            arrays.vertices.iter_mut().for_each(single);
            arrays
                .shape_directions
                .iter_mut()
                .flatten()
                .for_each(single);
            arrays
                .joints
                .iter_mut()
                .for_each(|p| *p = (map * Vector3::from(*p)).into());
            let directions = &mut arrays.pose_directions;
            directions.of_second_shape.iter_mut().for_each(single);
            self.turn_pose_directions(directions, arrays.parents.len());
        }
        if self.is_inside_out {
            arrays.faces.iter_mut().for_each(|f| f.swap(1, 2));
        }
        arrays
    }

    /// Offsets turn with the body, and so do the features that they belong to.
    fn turn_pose_directions(&self, directions: &mut PoseDirections, joints: usize) {
        let count = directions.feature.count();
        let columns = count * joints.saturating_sub(1);
        if directions.of_pose.is_empty() || columns == 0 {
            return;
        }
        let map = (self.matrix * self.unit).cast::<f32>();
        for vertex in directions.of_pose.chunks_exact_mut(3 * columns) {
            for of_joint in vertex.chunks_exact_mut(count) {
                turn_features(directions.feature, &self.matrix, of_joint);
            }
            for k in 0..columns {
                let at = [k, columns + k, 2 * columns + k];
                let offset = map * Vector3::from(at.map(|i| vertex[i]));
                for (i, value) in at.into_iter().zip(offset.iter()) {
                    vertex[i] = *value;
                }
            }
        }
    }
}

/// Up, from the ankles to the head, and to the left, in the file's frame.
fn directions(arrays: &SmplArrays, named: &NamedJoints) -> (Vector3<f64>, Vector3<f64>) {
    let at = |j: usize| Point3::from(arrays.joints[j]);
    let joints = &named.joints;
    let ankles = center(&at(joints.legs[0].end()), &at(joints.legs[1].end()));
    let shoulders = center(&at(joints.arms[0].root()), &at(joints.arms[1].root()));
    let top = joints.head.map_or(shoulders, at);
    let lateral = (at(joints.legs[0].root()) - at(joints.legs[1].root()))
        + (at(joints.arms[0].root()) - at(joints.arms[1].root()));
    (top - ankles, lateral)
}

/// The axis along a direction, checked against the stated one.
fn axis(
    option: &str,
    direction: Vector3<f64>,
    stated: Option<MeshAxis>,
) -> Result<MeshAxis, String> {
    let (found, cosine) = MeshAxis::nearest(direction.into()).ok_or("its head lies at its feet")?;
    if cosine < ALONG {
        return Err(format!(
            "its direction for `{option}` ({:.2}, {:.2}, {:.2}) is {:.0}° from the nearest axis, {found}; turn the body upright",
            direction.x,
            direction.y,
            direction.z,
            cosine.acos().to_degrees()
        ));
    }
    match stated {
        Some(said) if said != found => Err(format!(
            "`{option} {said}`, but the body's joints show {found}: say `{option} {found}`, or nothing"
        )),
        _ => Ok(found),
    }
}

/// The axis ahead: square to the side, the way that the skin of the feet lies from the ankles.
fn facing(
    arrays: &SmplArrays,
    named: &NamedJoints,
    up: Vector3<f64>,
    lateral: Vector3<f64>,
    stated: &MeshFrame,
) -> Result<MeshAxis, String> {
    let option = stated.options.facing;
    let found = axis(
        option,
        lateral.cross(&up),
        stated.facing.filter(|_| named.basis != SideBasis::Names),
    )?;
    if named.basis != SideBasis::Names {
        return Ok(found);
    }
    // Names alone tell the sides, and so the way ahead; feet may still deny it.
    let places: Vec<Point3<f64>> = arrays.joints.iter().map(|p| Point3::from(*p)).collect();
    let tree = JointTree {
        parents: &arrays.parents,
        places: &places,
        names: &[],
    };
    let feet = named.joints.legs.iter().filter_map(|leg| {
        let skin = centroid_below(leg.end(), arrays, &tree)?;
        Some((skin - places[leg.end()]).dot(&Vector3::from(found.vector())))
    });
    let toes = feet.sum::<f64>() / 2.0 / extent(arrays, up).max(f64::MIN_POSITIVE);
    match stated.facing {
        None if toes < TOES => Err(format!(
            "faces {found} by the names of its joints, but its feet do not show it ({:.1} % of the stature ahead of the ankles, expected {:.1} %); say `{option} {found}` if it does",
            100.0 * toes,
            100.0 * TOES
        )),
        Some(said) if said != found => Err(format!(
            "`{option} {said}`, but by the names of its joints it faces {found}"
        )),
        _ => Ok(found),
    }
}

/// Extent of the skin along a direction.
fn extent(arrays: &SmplArrays, up: Vector3<f64>) -> f64 {
    let heights = arrays
        .vertices
        .iter()
        .map(|v| Vector3::from(v.map(f64::from)).dot(&up));
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
        (l.min(x), h.max(x))
    });
    (high - low).max(0.0)
}

/// Signed volume inside the skin by the divergence theorem, in the file's unit; positive where faces look outwards.
fn volume(arrays: &SmplArrays) -> f64 {
    let at = |v: u32| Vector3::from(arrays.vertices[v as usize].map(f64::from));
    let origin = arrays.vertices.first().map_or(Vector3::zeros(), |_| at(0));
    let six = arrays.faces.iter().map(|f| {
        let [a, b, c] = f.map(|v| at(v) - origin);
        a.dot(&b.cross(&c))
    });
    six.sum::<f64>() / 6.0
}
