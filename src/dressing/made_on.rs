//! The body a mesh garment was made on: read from a file, or the embedded one put where the garment would fit it.

use crate::body::import::template_from_smpl;
use crate::body::{
    BodyError, BodyShape, BoneTransforms, Joint, Pose, RestBody, Skeleton, Template, embedded, rig,
    skin,
};
use crate::camera::{Calibration, DepthImage, Intrinsics, RgbdFrame};
use crate::formats::FormatError;
use crate::formats::npz::read_smpl;
use crate::formats::obj::read_obj;
use crate::garment::GarmentError;
use crate::math::{Body, Camera, P3, Rigid, V3, V3d, World, log_so3};
use crate::mesh::{Face, Topology, TriMesh, vertex_normals};
use crate::par::Par;
use crate::raster::{View, VisibilityBuffer, rasterise};
use crate::spatial::PointTree;
use crate::tracking::{
    TrackerConfig, TrackerModel, TrackerState, Workspace as TrackerWorkspace, step as track,
};
use nalgebra::{UnitQuaternion, Vector3};
use std::path::Path;
use std::sync::Arc;

/// Why a mesh garment cannot be worn.
#[derive(Debug, thiserror::Error)]
pub enum WearError {
    /// A file is at fault.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The cloth is at fault.
    #[error("piece {piece}: {why}")]
    Piece {
        /// Number of the piece, the largest is 0.
        piece: usize,
        /// What is wrong; vertices and faces are counted within the piece.
        why: GarmentError,
    },
    /// The body it was made on is at fault.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The body it was made on has no skeleton, and none was found for it.
    #[error("the body that the garment was made on: {0}")]
    NotFound(String),
    /// Nothing to wear.
    #[error("{0}")]
    Nothing(String),
}

/// From a file's own unit and frame to metres, y up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FileFrame {
    scale: f32,
    z_up: bool,
    shift: V3,
}

impl FileFrame {
    const METRES: Self = Self {
        scale: 1.0,
        z_up: false,
        shift: V3::new(0.0, 0.0, 0.0),
    };
    pub(super) fn metres(&self, p: &P3) -> P3 {
        let q = if self.z_up {
            P3::new(p.x, p.z, -p.y)
        } else {
            *p
        };
        q * self.scale + self.shift
    }
}

/// A body in the pose and place in which garments were made on it.
#[derive(Clone, Debug)]
pub struct MadeOn {
    /// Metres, y up, facing +z.
    pub(super) template: Arc<Template>,
    /// All vertices of its file, the file's own unit: MakeHuman's clothes hang on helpers beyond the skin too.
    pub(super) file: Vec<P3>,
    pub(super) frame: FileFrame,
    /// Where it comes from, for people.
    pub said: String,
}

/// Stature of a grown body, metres: what a file's unit is judged by.
const STATURE: [f32; 2] = [1.1, 2.4];

impl MadeOn {
    /// Reads a body: `.npz` in SMPL layout (its rest pose), or `.obj`: a body that stands upright with its arms away from
    /// its sides, y or z up, any unit of a power of ten. An OBJ's skeleton is found by tracking one picture of it; only
    /// its largest piece is skin.
    ///
    /// # Errors
    /// A fault of the file, or a mesh in which no person is found.
    pub fn read(path: &Path) -> Result<Self, WearError> {
        let name = path
            .file_name()
            .map_or_else(String::new, |n| n.to_string_lossy().into_owned());
        if path.extension().is_some_and(|e| e == "npz") {
            let template = template_from_smpl(&name, &read_smpl(path)?)?;
            let file = template.mesh().vertices().to_vec();
            return Ok(Self {
                template: Arc::new(template),
                file,
                frame: FileFrame::METRES,
                said: name,
            });
        }
        let mesh = read_obj(path)?.mesh;
        let unknown = |why: &str| WearError::NotFound(format!("{}: {why}", path.display()));
        let (lo, hi) = mesh.bounds().ok_or_else(|| unknown("it has no vertices"))?;
        let size = hi - lo;
        let z_up = size.z > size.y;
        let tall = if z_up { size.z } else { size.y };
        let scale = [1.0f32, 0.1, 0.01, 0.001]
            .into_iter()
            .find(|s| tall * s > STATURE[0] && tall * s < STATURE[1]);
        let scale = scale
            .ok_or_else(|| unknown(&format!("{tall} high is no person in m, dm, cm or mm")))?;
        let frame = FileFrame {
            scale,
            z_up,
            shift: V3::zeros(),
        };
        let skin = largest_piece(&mesh, &frame).map_err(BodyError::Mesh)?;
        let (template, fit) = rig_standing(skin).map_err(WearError::NotFound)?;
        let said = format!("{name}, skeleton found within {:.0} mm", fit * 1e3);
        Ok(Self {
            template: Arc::new(template),
            file: mesh.vertices().to_vec(),
            frame,
            said,
        })
    }
    /// Metres in a unit of the file.
    pub(super) fn unit(&self) -> f32 {
        self.frame.scale
    }
    /// Where garment vertices, or those of the body's own file, are beside the template.
    pub(super) fn metres(&self, p: &[P3]) -> Vec<P3> {
        p.iter().map(|p| self.frame.metres(p)).collect()
    }
    /// The body again where a garment lies whose file has a unit and place of its own: a bound garment keeps the body's.
    ///
    /// # Errors
    /// None with a body as it is.
    pub(super) fn beneath(self, garment: &[P3]) -> Result<Self, WearError> {
        let (_, frame) = fit_under(&self.template, garment, false)?;
        Ok(Self { frame, ..self })
    }
    /// The embedded body, scaled, moved and with its arms turned so that garment vertices lie just above its skin.
    /// Garments say little about the body they were made on: this is a guess.
    ///
    /// # Errors
    /// When no body fits into them.
    pub fn guess(garment: &[P3]) -> Result<Self, WearError> {
        let (template, frame) = fit_under(&embedded::template(), garment, true)?;
        let stature = template.mesh().bounds().map_or(0.0, |(lo, hi)| hi.y - lo.y);
        let up = frame.shift.y * 100.0;
        let said = format!(
            "a guess: our body, {:.0} cm tall, its floor {up:.0} cm below the file's zero",
            stature * 100.0
        );
        Ok(Self {
            template,
            file: Vec::new(),
            frame,
            said,
        })
    }
}

fn largest_piece(mesh: &TriMesh, frame: &FileFrame) -> Result<TriMesh, crate::mesh::MeshError> {
    let (label, count) = Topology::new(mesh)?.components();
    let mut sizes = vec![0usize; count];
    label.iter().for_each(|l| sizes[*l as usize] += 1);
    let largest = (0..count)
        .max_by_key(|c| (sizes[*c], std::cmp::Reverse(*c)))
        .unwrap_or(0) as u32;
    let mut index = vec![u32::MAX; label.len()];
    let mut vertices = Vec::new();
    for (i, l) in label.iter().enumerate().filter(|(_, l)| **l == largest) {
        debug_assert_eq!(*l, largest);
        index[i] = vertices.len() as u32;
        vertices.push(frame.metres(&mesh.vertices()[i]));
    }
    let own = |f: &&Face| label[f[0] as usize] == largest;
    let faces = mesh
        .faces()
        .iter()
        .filter(own)
        .map(|f| f.map(|v| index[v as usize]))
        .collect();
    TriMesh::new(vertices, faces)
}

/// Pictures that the tracker gets of a standing body.
const LOOKS: u64 = 45;

/// A skeleton and weights for a bare standing body that faces +z (metres, y up): the embedded template is tracked onto a
/// picture of it. Returns how far the fitted template is from the body's vertices too, mean, metres.
///
/// # Errors
/// Why no person is found in the mesh.
pub fn rig_standing(mesh: TriMesh) -> Result<(Template, f64), String> {
    let camera = Intrinsics::KINECT_V1;
    let (low, high) = mesh.bounds().ok_or("the body has no vertices")?;
    // A camera in front, at half its height, far enough for all of it; y down, z towards the body.
    let away = 1.1 * f64::from((high.y - low.y).max(0.8 * (high.x - low.x))) * camera.fy
        / f64::from(camera.height);
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let middle = V3d::new(
        0.0,
        0.5 * f64::from(low.y + high.y),
        f64::from(high.z) + away,
    );
    let world_from_camera: Rigid<World, Camera> = Rigid::from_parts(middle, half_turn);
    let camera_from_world = world_from_camera.inverse();
    let mut seen = Vec::new();
    camera_from_world.points_f32(mesh.vertices(), &mut seen);
    let mut picture = VisibilityBuffer::default();
    rasterise(
        &View::Perspective { camera, near: 0.1 },
        &seen,
        mesh.faces(),
        &mut picture,
    );
    let depth = picture
        .depth
        .iter()
        .map(|z| {
            if z.is_finite() {
                (z * 1e3).round() as u16
            } else {
                0
            }
        })
        .collect();
    let depth = DepthImage::new(camera.width, camera.height, depth).map_err(|e| e.to_string())?;

    let model = TrackerModel::new(
        embedded::template(),
        Calibration::registered(camera),
        TrackerConfig::default(),
    );
    let (mut state, mut work) = (TrackerState::new(&model), TrackerWorkspace::default());
    for sequence in 0..LOOKS {
        let frame = RgbdFrame {
            sequence,
            time_ns: sequence * 33_333_333,
            depth: depth.clone(),
            color: None,
        };
        track(&model, &mut state, &frame, &mut work).map_err(|e| e.to_string())?;
    }
    if !state.status.is_live() {
        return Err(format!(
            "the tracker does not find a person in the mesh: {:?}",
            state.status
        ));
    }
    let t = model.template();
    let person = t.personalise(&state.shape);
    let pose: Pose<World> = Pose {
        root: world_from_camera * state.pose.root,
        angles: state.pose.angles.clone(),
    };
    let mut bones = BoneTransforms::default();
    pose.bones(t.skeleton(), &person, &mut bones);
    let mut fitted = RestBody::default();
    skin(
        Par::Seq,
        &person.vertices,
        t.weights(),
        &bones,
        &mut fitted.vertices,
    );
    let tree = PointTree::new(&fitted.vertices);
    let far = mesh
        .vertices()
        .iter()
        .map(|p| tree.nearest(p, 1.0).map_or(1.0, |n| f64::from(n.1).sqrt()));
    let fit = far.sum::<f64>() / mesh.vertices().len() as f64;
    Ok((
        rig("body", mesh, t, &bones, &fitted).map_err(|e| e.to_string())?,
        fit,
    ))
}

/// A template stood in another way: scaled, arms turned.
fn stood(
    template: &Template,
    rest: &RestBody,
    scale: f64,
    arms: Option<f64>,
) -> (Vec<P3>, BoneTransforms) {
    let sk = template.skeleton();
    let mut pose = Pose::rest(sk, Rigid::<World, Body>::identity());
    if let Some(down) = arms {
        for (side, s) in [("left", 1.0), ("right", -1.0)] {
            let at = |n: &str| sk.index(&format!("{side}_{n}"));
            let (Some(j), Some(c)) = (at("shoulder"), at("elbow")) else {
                continue;
            };
            let wanted = Vector3::new(s * down.cos(), -down.sin(), 0.0);
            if let Some(q) =
                UnitQuaternion::rotation_between(&(rest.joints[c] - rest.joints[j]), &wanted)
            {
                pose.set(sk, &format!("{side}_shoulder"), log_so3(&q).as_slice());
            }
        }
    }
    let mut bones = BoneTransforms::default();
    pose.bones(sk, rest, &mut bones);
    let mut out = Vec::new();
    skin(
        Par::Rayon,
        &rest.vertices,
        template.weights(),
        &bones,
        &mut out,
    );
    out.iter_mut().for_each(|p| *p *= scale as f32);
    bones.joints.iter_mut().for_each(|p| *p *= scale);
    (out, bones)
}

/// A garment whose middle lies farther than this from the upright through the file's zero, metres, is moved there first.
const ASIDE: f32 = 0.4;
/// Garment vertices that are looked at while guessing.
const SAMPLES: usize = 500;
/// Skin further away than this says no more, metres.
const FAR: f32 = 0.08;
/// A garment whose vertices are this share of [`FAR`] from the nearest body on average is not worn by it: one that hangs in
/// the air has all of it.
const NOT_WORN: f32 = 0.9;
/// A vertex inside the body counts as much as one this many times as far outside.
const INSIDE: f32 = 4.0;
/// Cloth lies about this far above skin, metres.
const ABOVE: f32 = 0.008;

/// Bodies differ in stature by this share (standard deviation) …
const USUAL: f64 = 0.05;
/// Files put the floor within this of where it is expected, metres …
const FLOOR: f64 = 0.03;
/// … and one so far off has to fit its garment better by this, metres.
const UNUSUAL: f32 = 0.002;

/// Finds where a body would have stood in a garment: its scale and the turn of its arms (both only if `free`), and the
/// garment's own frame, which gets all of the shift.
///
/// # Errors
/// When nothing of a body lies near the garment (only if `free`).
fn fit_under(
    template: &Arc<Template>,
    garment: &[P3],
    free: bool,
) -> Result<(Arc<Template>, FileFrame), WearError> {
    let (lo, hi) = garment.iter().fold(
        (P3::from([f32::MAX; 3]), P3::from([f32::MIN; 3])),
        |(l, h), p| (l.inf(p), h.sup(p)),
    );
    let largest = (hi - lo).amax();
    /// A garment's largest extent, metres.
    const EXTENT: [f32; 2] = [0.22, 2.2];
    let unit = [1.0f32, 0.1, 0.01, 0.001]
        .into_iter()
        .find(|s| largest * s > EXTENT[0] && largest * s < EXTENT[1]);
    let unit = FileFrame {
        scale: unit.unwrap_or(1.0),
        z_up: false,
        shift: V3::zeros(),
    };
    // A file may hold a person who stands anywhere in a room.
    let middle = nalgebra::center(&lo, &hi).coords * unit.scale;
    let aside = V3::new(middle.x, 0.0, middle.z);
    let unit = FileFrame {
        shift: if aside.norm() > ASIDE {
            -aside
        } else {
            V3::zeros()
        },
        ..unit
    };
    let points: Vec<P3> = garment
        .iter()
        .step_by(garment.len().div_ceil(SAMPLES).max(1))
        .map(|p| unit.metres(p))
        .collect();
    let rest = template.personalise(&BodyShape::default());
    let tall = rest.vertices.iter().map(|p| p.y).fold(0.0, f32::max);
    // Scale, arms below the horizontal, garment up and to the front.
    let cost = |q: &[f64; 4]| -> f32 {
        let (vertices, _) = stood(template, &rest, q[0], free.then_some(q[1]));
        let mut normals = Vec::new();
        vertex_normals(
            Par::Rayon,
            &vertices,
            template.mesh().faces(),
            template.topology().vertex_faces(),
            &mut normals,
        );
        let tree = PointTree::new(&vertices);
        let shift = V3::new(0.0, q[2] as f32, q[3] as f32);
        let sum: f32 = points
            .iter()
            .map(|p| {
                let p = p + shift;
                let Some((near, d2)) = tree.nearest(&p, 10.0) else {
                    return FAR * INSIDE;
                };
                let inside = (p - vertices[near]).dot(&normals[near]) < 0.0;
                if inside {
                    (INSIDE * d2.sqrt()).min(FAR * INSIDE)
                } else {
                    (d2.sqrt() - ABOVE).abs().min(FAR)
                }
            })
            .sum();
        // A short body in a loose garment looks as good as a tall one in a tight one: the usual is likelier.
        // And a floor is where the file has it, or half a stature below its zero.
        let floor = q[2].abs().min((q[2] - q[0] * f64::from(tall) / 2.0).abs());
        let unusual = ((q[0] - 1.0) / USUAL).powi(2) + (floor / FLOOR).powi(2);
        sum / points.len().max(1) as f32 + UNUSUAL * unusual as f32
    };
    // Files put the floor at zero, or the middle of the body: then what is lower than the floor tells.
    let starts = [
        [1.0, 0.75, f64::from(tall) / 2.0, 0.0],
        [1.0, 0.75, 0.0, 0.0],
    ];
    /// Below the floor, metres.
    const UNDERGROUND: f32 = -0.05;
    let starts = &starts[..if lo.y * unit.scale < UNDERGROUND {
        1
    } else {
        2
    }];
    let mut best = starts
        .iter()
        .map(|s| (cost(s), *s))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap_or_default();
    let mut step = [
        if free { 0.04 } else { 0.0 },
        if free { 0.2 } else { 0.0 },
        0.04,
        0.02,
    ];
    for _ in 0..5 {
        for k in (0..4).filter(|k| step[*k] > 0.0) {
            for way in [-1.0, 1.0] {
                loop {
                    let mut q = best.1;
                    q[k] += way * step[k];
                    let inside = (0.8..1.15).contains(&q[0]) && (-0.3..1.4).contains(&q[1]);
                    let c = if inside { cost(&q) } else { f32::MAX };
                    if c >= best.0 {
                        break;
                    }
                    best = (c, q);
                }
            }
        }
        step.iter_mut().for_each(|s| *s *= 0.5);
    }
    let q = best.1;
    let frame = FileFrame {
        shift: unit.shift + V3::new(0.0, q[2] as f32, q[3] as f32),
        ..unit
    };
    if !free {
        return Ok((template.clone(), frame));
    }
    if best.0 > NOT_WORN * FAR {
        let why = "no body fits into it: is it worn, upright, y up, and facing +z?";
        return Err(WearError::NotFound(why.into()));
    }
    let (vertices, bones) = stood(template, &rest, q[0], Some(q[1]));
    let joints = template.skeleton().joints().iter().enumerate();
    let joints = joints
        .map(|(j, joint)| Joint {
            rest: bones.joints[j],
            ..joint.clone()
        })
        .collect();
    let made = template
        .mesh()
        .with_vertices(vertices)
        .map_err(BodyError::Mesh)
        .and_then(|m| {
            Template::new(
                "guessed",
                m,
                Skeleton::new(joints)?,
                template.weights().clone(),
                None,
            )
        });
    Ok((Arc::new(made?), frame))
}
