//! Physiques far outside the embedded body's shape space: morphs of a base body, bends, bellies and worn coverings.

use super::settings::CoveringSettings;
use super::street_clothes::coat_thickness;
use tryon_body::import::template_from_smpl;
use tryon_body::parts::{BodyPart, BodySegment};
use tryon_body::{BodyError, BoneTransforms, Pose, RestBody, Template, skin};
use tryon_formats::PoseDirections;
use tryon_formats::npz::{SmplArrays, regress};
use tryon_geometry::math::{Body, P3, Rigid};
use tryon_geometry::mesh::smoothing::smoothed;
use tryon_geometry::par::Par;

/// A round belly: a bulge of the front of the trunk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Belly {
    /// Greatest displacement to the front, metres.
    pub depth: f32,
    /// Height of its middle, share of the stature.
    pub height: f32,
    /// Half its height and width, metres.
    pub radius: [f32; 2],
}

/// Something worn that hides the shape of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Covering {
    /// An open wide coat to the knees.
    WideCoat,
    /// Hair to the shoulder blades.
    LongHair,
}

/// Changes of a body, applied in the order of the fields.
#[derive(Clone, Debug, PartialEq)]
pub struct Physique {
    /// Bulge of the trunk.
    pub belly: Option<Belly>,
    /// Scale of everything below the hips along the vertical.
    pub legs: f32,
    /// Scale of the head and neck about the neck.
    pub head: f32,
    /// Scale of the whole body.
    pub scale: f32,
    /// Forward bend of the spine, radians; the head stays level.
    pub stoop: f64,
    /// Something worn.
    pub covering: Option<Covering>,
}

/// Share of the stoop of each joint of the spine.
const SPINE: [(&str, f64); 3] = [("spine1", 0.25), ("spine2", 0.4), ("spine3", 0.35)];

impl Physique {
    /// No change.
    pub const UNCHANGED: Self = Self {
        belly: None,
        legs: 1.0,
        head: 1.0,
        scale: 1.0,
        stoop: 0.0,
        covering: None,
    };

    /// A template of the changed body. `arrays` hold the base body; its regressor places the joints.
    ///
    /// # Errors
    /// Names the array, joint or vertex that does not match.
    pub fn template(&self, name: &str, arrays: &SmplArrays) -> Result<Template, BodyError> {
        let mut arrays = SmplArrays {
            shape_directions: Vec::new(),
            pose_directions: PoseDirections::default(),
            ..arrays.clone()
        };
        stand_on_floor(&mut arrays.vertices);
        arrays.joints = regress(&arrays.joint_regressor, &arrays.vertices);
        arrays.joint_regressor = Vec::new();
        let plain = template_from_smpl(name, &arrays)?;
        let base = plain.personalise(&Default::default());
        let mut body = Morph::new(&plain, &base);
        if let Some(belly) = &self.belly {
            body.bulge(belly);
        }
        body.stretch_legs(self.legs);
        body.scale_head(self.head);
        body.scale(self.scale);
        arrays.vertices = body.vertices.iter().map(|p| [p.x, p.y, p.z]).collect();
        arrays.joints = body.joints.iter().map(|p| [p.x, p.y, p.z]).collect();
        arrays.joints.truncate(arrays.joint_names.len());
        let mut template = template_from_smpl(name, &arrays)?;
        if self.stoop != 0.0 {
            stoop(&template, self.stoop, &mut arrays);
            template = template_from_smpl(name, &arrays)?;
        }
        if let Some(covering) = self.covering {
            let covered = cover(&template, covering);
            arrays.vertices = covered.iter().map(|p| [p.x, p.y, p.z]).collect();
            template = template_from_smpl(name, &arrays)?;
        }
        Ok(template)
    }
}

/// Moves the lowest vertex to height 0.
fn stand_on_floor(vertices: &mut [[f32; 3]]) {
    let low = vertices.iter().map(|v| v[1]).fold(f32::INFINITY, f32::min);
    if low.is_finite() {
        vertices.iter_mut().for_each(|v| v[1] -= low);
    }
}

/// A rest body that is changed: vertices and joints move alike.
struct Morph<'a> {
    template: &'a Template,
    vertices: Vec<P3>,
    joints: Vec<nalgebra::Point3<f64>>,
}

impl<'a> Morph<'a> {
    fn new(template: &'a Template, rest: &RestBody) -> Self {
        Self {
            template,
            vertices: rest.vertices.clone(),
            joints: rest.joints.clone(),
        }
    }

    /// Share of a vertex's weights on joints of which `is_part` holds.
    fn share(&self, vertex: usize, is_part: impl Fn(usize) -> bool) -> f32 {
        let w = self.template.weights();
        let joints = w.joints[vertex].iter().zip(&w.weights[vertex]);
        joints
            .filter(|(j, _)| is_part(usize::from(**j)))
            .map(|(_, w)| *w)
            .sum()
    }

    fn stature(&self) -> f32 {
        self.vertices.iter().map(|v| v.y).fold(0.0, f32::max)
    }

    fn joint(&self, name: &str) -> Option<nalgebra::Point3<f64>> {
        Some(self.joints[self.template.skeleton().index(name)?])
    }

    /// Pushes the front of the trunk forward and, by a third of that, to the sides.
    fn bulge(&mut self, belly: &Belly) {
        let parts = self.template.parts();
        let middle = belly.height * self.stature();
        let back = self.joint("spine1").map_or(0.0, |p| p.z as f32);
        for i in 0..self.vertices.len() {
            let trunk = self.share(i, |j| parts.part(j) == BodyPart::Trunk);
            let p = &mut self.vertices[i];
            let (y, x) = ((p.y - middle) / belly.radius[0], p.x / belly.radius[1]);
            let front = ((p.z - back + 0.02) / 0.10).clamp(0.0, 1.0);
            let front = front * front * (3.0 - 2.0 * front);
            let bulge = belly.depth * trunk * front * (-y * y - x * x).exp();
            p.z += bulge;
            p.x *= 1.0 + bulge / 0.3;
        }
    }

    /// Scales heights below the hips; what is above moves with them.
    fn stretch_legs(&mut self, factor: f32) {
        let Some(hip) = self.joint("left_hip") else {
            return;
        };
        let parts = self.template.parts().clone();
        // Hands hang below the hips: arms move as a whole.
        let is_arm = |j: usize| matches!(parts.part(j), BodyPart::LeftArm | BodyPart::RightArm);
        let lift = (factor - 1.0) * hip.y as f32;
        let rise = |y: f32, arm: f32| {
            let own = if y < hip.y as f32 {
                (factor - 1.0) * y
            } else {
                lift
            };
            own + (lift - own) * arm
        };
        for i in 0..self.vertices.len() {
            let arm = self.share(i, is_arm);
            let p = &mut self.vertices[i];
            p.y += rise(p.y, arm);
        }
        for (j, p) in self.joints.iter_mut().enumerate() {
            p.y += f64::from(rise(p.y as f32, f32::from(u8::from(is_arm(j)))));
        }
    }

    /// Scales the head about the base of the neck.
    fn scale_head(&mut self, factor: f32) {
        let Some(neck) = self.joint("neck") else {
            return;
        };
        let parts = self.template.parts().clone();
        let is_head = |j: usize| matches!(parts.segment(j), BodySegment::Head | BodySegment::Neck);
        let centre = neck.cast::<f32>();
        for i in 0..self.vertices.len() {
            let share = self.share(i, is_head);
            let p = &mut self.vertices[i];
            *p += (*p - centre) * ((factor - 1.0) * share);
        }
        for (j, p) in self.joints.iter_mut().enumerate() {
            if is_head(j) {
                *p += (*p - neck) * f64::from(factor - 1.0);
            }
        }
    }

    fn scale(&mut self, factor: f32) {
        self.vertices.iter_mut().for_each(|p| p.coords *= factor);
        let factor = f64::from(factor);
        self.joints.iter_mut().for_each(|p| p.coords *= factor);
    }
}

/// Bends the spine by `angle` in all and makes that the rest pose.
fn stoop(template: &Template, angle: f64, arrays: &mut SmplArrays) {
    let skeleton = template.skeleton();
    let rest = template.personalise(&Default::default());
    let mut pose = Pose::<Body>::rest(skeleton, Rigid::identity());
    for (name, share) in SPINE {
        pose.set(skeleton, name, &[share * angle, 0.0, 0.0]);
    }
    pose.set(
        skeleton,
        "neck",
        &[CoveringSettings::default().neck * angle, 0.0, 0.0],
    );
    let mut bones = BoneTransforms::default();
    pose.bones(skeleton, &rest, &mut bones);
    let mut vertices = Vec::new();
    let weights = template.weights();
    skin(Par::Seq, &rest.vertices, weights, &bones, &mut vertices);
    arrays.vertices = vertices.iter().map(|p| [p.x, p.y, p.z]).collect();
    let joints = bones.joints.iter().take(arrays.joint_names.len());
    arrays.joints = joints.map(|p| [p.x, p.y, p.z]).collect();
}

/// The surface of a covering over a body.
fn cover(template: &Template, covering: Covering) -> Vec<P3> {
    let CoveringSettings {
        coat,
        hair,
        smoothing,
        ..
    } = CoveringSettings::default();
    let rest = template.personalise(&Default::default());
    let body = Morph::new(template, &rest);
    let height = body.stature();
    let joint = |name: &str| body.joint(name).map_or(P3::origin(), |p| p.cast::<f32>());
    let (head, knee) = (joint("head"), joint("left_knee"));
    let parts = template.parts();
    let thickness = |i: usize| -> f32 {
        let p = &rest.vertices[i];
        let of = |wanted: &[BodySegment]| body.share(i, |j| wanted.contains(&parts.segment(j)));
        use BodySegment::*;
        match covering {
            Covering::WideCoat => coat_thickness(template, &rest, i, coat, knee.y),
            Covering::LongHair => {
                let behind = ((head.z + 0.05 - p.z) / 0.03).clamp(0.0, 1.0);
                let crown = ((p.y - head.y - 0.11) / 0.03).clamp(0.0, 1.0);
                let skull = of(&[Head]) * behind.max(crown);
                let middle = (1.0 - (p.x / 0.16).abs()).clamp(0.0, 0.5) * 2.0;
                let upper = ((p.y - 0.70 * height) / 0.05).clamp(0.0, 1.0);
                let back = ((head.z - p.z) / 0.03).clamp(0.0, 1.0);
                let falls = of(&[Neck, Chest, Collar]) * middle * upper * back;
                hair[0] * skull + hair[1] * falls.max(of(&[Neck]) * back)
            }
        }
    };
    let mut depth: Vec<f32> = (0..rest.vertices.len()).map(thickness).collect();
    let around = template.topology().vertex_neighbours();
    for _ in 0..smoothing {
        depth = smoothed(Par::Seq, around, &depth);
    }
    let vertices = template.mesh().vertices();
    let normals = template.normals(vertices);
    let moved = vertices.iter().zip(&normals).zip(&depth);
    moved.map(|((p, n), d)| p + n * *d).collect()
}
