//! Frames of a synthetic actor, with ground truth.

use super::clip::{ClipError, Performance};
use super::furniture::{NEAR, Piece};
use super::paint::{Colors, Paint};
use super::posture::Posture;
use super::room::{Background, Room};
use super::routine::Routine;
use super::settings::LightSettings;
use super::stance::Rig;
use nalgebra::UnitQuaternion;
use std::sync::Arc;
use tryon_body::{BodyShape, BoneTransforms, Pose, RestBody, Template, skin};
use tryon_formats::MotionClip;
use tryon_geometry::camera::{
    Calibration, ColorImage, DepthImage, Intrinsics, NoiseModel, RgbdFrame,
};
use tryon_geometry::math::{Camera, P3, P3d, Rigid, V3, V3d, World};
use tryon_geometry::mesh::vertex_normals;
use tryon_geometry::par::Par;
use tryon_geometry::raster::{Cull, Options, View, VisibilityBuffer, barycentrics, rasterise_with};

/// Person in front of the camera.
#[derive(Clone, Debug)]
pub struct Actor {
    /// Body and joints.
    pub template: Arc<Template>,
    /// Shape of this person.
    pub shape: BodyShape,
    /// Chooses skin, hair and clothes.
    pub appearance: u64,
}

impl Default for Actor {
    /// The embedded body as it is.
    fn default() -> Self {
        Self {
            template: tryon_body::embedded::template(),
            shape: BodyShape::default(),
            appearance: 0,
        }
    }
}

/// Camera, room and routine.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Depth and (registered) colour camera.
    pub camera: Intrinsics,
    /// Pose of the camera; the world's floor is y = 0.
    pub world_from_camera: Rigid<World, Camera>,
    /// Start of the actor on the floor, world.
    pub home: P3d,
    /// Turn of the actor about the vertical through `home`, radians; 0 faces the camera.
    pub turn: f64,
    /// Walls and floor; `None` for a person alone in the dark.
    pub room: Option<Room>,
    /// Noise of the depth image.
    pub noise: NoiseModel,
    /// Motion of the actor.
    pub routine: Routine,
    /// Frames a second.
    pub rate: f64,
    /// Renders colour too.
    pub color: bool,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for Setting {
    /// A Kinect v1 on a shelf, one metre high and tilted 3° down, 2.4 m from the actor.
    fn default() -> Self {
        Self {
            camera: Intrinsics::KINECT_V1,
            world_from_camera: Self::tilted(1.0, 3.0, 0.0),
            home: P3d::new(0.0, 0.0, -2.4),
            turn: 0.0,
            room: Some(Room::default()),
            noise: NoiseModel::KinectV1,
            routine: Routine::TryOn,
            rate: 30.0,
            color: true,
            seed: 1,
        }
    }
}

impl Setting {
    /// A camera `height` metres above the floor looking along −z, tilted down and then rolled (clockwise as seen
    /// from behind it), degrees.
    pub fn tilted(height: f64, down: f64, roll: f64) -> Rigid<World, Camera> {
        let tilt = UnitQuaternion::from_axis_angle(&V3d::x_axis(), -down.to_radians());
        let roll = UnitQuaternion::from_axis_angle(&V3d::z_axis(), roll.to_radians());
        let turn: Rigid<Camera, Camera> = Rigid::from_parts(V3d::zeros(), tilt * roll);
        Rigid::<World, Camera>::level(height) * turn
    }
    /// The same scene with the camera mounted upright: columns and rows swapped, rolled by a quarter turn.
    #[must_use]
    pub fn portrait(self) -> Self {
        let k = self.camera;
        let camera = Intrinsics {
            width: k.height,
            height: k.width,
            fx: k.fy,
            fy: k.fx,
            cx: k.cy,
            cy: k.cx,
        };
        Self { camera, ..self }
    }
}

/// Ground truth of a frame.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Somebody is in the room (perhaps outside the picture).
    pub present: bool,
    /// Pose of the template.
    pub pose: Pose<Camera>,
    /// Posed joints in the order of the skeleton, camera frame, metres.
    pub joints: Vec<P3d>,
    /// Posed vertices, camera frame, metres; empty when nobody is present.
    pub vertices: Vec<P3>,
}

/// An actor in a setting: frames are functions of their number.
#[derive(Clone, Debug)]
pub struct Sequence {
    actor: Actor,
    setting: Setting,
    rest: RestBody,
    rig: Rig,
    paint: Paint,
    background: Background,
    calibration: Calibration,
    performance: Option<Arc<Performance>>,
}

/// The room, with a chair under somebody who sits.
fn background(setting: &Setting) -> Background {
    let (camera, place) = (&setting.camera, &setting.world_from_camera);
    let mut room = Room::draw(setting.room.as_ref(), camera, place);
    if setting.routine == Routine::Hold(Posture::Sitting) {
        let at = setting.home.cast::<f32>();
        let chair = Piece::Chair
            .surface()
            .placed([at.x, 0.0, at.z], setting.turn as f32);
        chair.seen_from(place).draw(camera, &mut room.depth);
    }
    room
}

impl Sequence {
    /// Prepares everything that does not change from frame to frame.
    pub fn new(actor: Actor, setting: Setting) -> Self {
        let t = &actor.template;
        let rest = t.personalise(&actor.shape);
        Self {
            rig: Rig::new(t.skeleton(), &rest),
            paint: Paint::new(t, &rest, Colors::pick(actor.appearance)),
            background: background(&setting),
            calibration: Calibration::registered(setting.camera),
            rest,
            performance: None,
            actor,
            setting,
        }
    }
    /// Plays a motion clip instead of the routine: the calibration pose for a second, a second of blending, the
    /// clip; then it holds its last frame. Scaled by leg length, turned to face the camera at its start.
    ///
    /// # Errors
    /// Names the joint that the clip lacks.
    pub fn with_clip(mut self, clip: MotionClip) -> Result<Self, ClipError> {
        self.performance = Some(Arc::new(Performance::new(clip)?));
        Ok(self)
    }
    /// Time before a clip plays, seconds: calibration pose and blend.
    pub fn clip_lead(&self) -> f64 {
        self.rig.settings.hold + self.rig.settings.blend
    }
    /// Camera, room and routine.
    pub fn setting(&self) -> &Setting {
        &self.setting
    }
    /// Person in front of the camera.
    pub fn actor(&self) -> &Actor {
        &self.actor
    }
    /// The personalised rest body.
    pub fn rest(&self) -> &RestBody {
        &self.rest
    }
    /// Colour is registered to depth.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Truth of frame `i`.
    pub fn truth(&self, i: u64) -> Truth {
        let t = &self.actor.template;
        let camera_from_world = self.setting.world_from_camera.inverse();
        let (time, home) = (i as f64 / self.setting.rate, self.setting.home);
        let stance = match &self.performance {
            Some(p) => p.stance(&self.rig, home, time),
            None => self.setting.routine.stance(&self.rig, home, time),
        };
        let in_world = self.rig.pose(&stance);
        let turn = UnitQuaternion::from_axis_angle(&V3d::y_axis(), self.setting.turn);
        let turned: Rigid<World, World> = Rigid::from_parts(home.coords - turn * home.coords, turn);
        let pose = Pose {
            root: camera_from_world * turned * in_world.root,
            angles: in_world.angles,
        };
        let mut bones = BoneTransforms::default();
        pose.bones(t.skeleton(), &self.rest, &mut bones);
        let present = self.performance.is_some() || self.setting.routine.has_person();
        let mut vertices = Vec::new();
        if present {
            let (rest, weights) = (&self.rest.vertices, t.weights());
            skin(Par::Seq, rest, weights, &bones, &mut vertices);
        }
        Truth {
            present,
            pose,
            joints: bones.joints,
            vertices,
        }
    }

    /// Depth of frame `i` before noise (metres along the optical axis, row-major, infinity for no surface), and its truth.
    pub fn surface_depth(&self, i: u64) -> (Vec<f32>, Truth) {
        let truth = self.truth(i);
        let mut depth = self.background.depth.clone();
        if truth.present {
            self.draw(&truth, &mut depth, None);
        }
        (depth, truth)
    }

    /// Frame `i` and its truth.
    pub fn frame(&self, i: u64) -> (RgbdFrame, Truth) {
        let truth = self.truth(i);
        let camera = &self.setting.camera;
        let mut depth = self.background.depth.clone();
        let mut color = self.setting.color.then(|| self.background.color.clone());
        if truth.present {
            if let Some(color) = &mut color {
                self.cast_shadow(&truth, color);
            }
            self.draw(&truth, &mut depth, color.as_deref_mut());
        }
        let depth: DepthImage = self
            .setting
            .noise
            .apply(camera, &depth, self.setting.seed, i);
        // The buffer has the background's size, which is the camera's.
        let color = color.and_then(|c| ColorImage::new(camera.width, camera.height, c).ok());
        let time_ns = (i as f64 * 1e9 / self.setting.rate).round() as u64;
        (
            RgbdFrame {
                sequence: i,
                time_ns,
                depth,
                color,
            },
            truth,
        )
    }

    fn draw(&self, truth: &Truth, depth: &mut [f32], color: Option<&mut [u8]>) {
        let t = &self.actor.template;
        let faces = t.mesh().faces();
        let view = View::Perspective {
            camera: self.setting.camera,
            near: NEAR,
        };
        let mut buffer = VisibilityBuffer::default();
        let options = Options {
            par: Par::Seq,
            cull: Cull::Back,
            ..Options::default()
        };
        let vertices = &truth.vertices;
        rasterise_with(options, &view, vertices, faces, &mut buffer);
        let mut normals = Vec::new();
        if color.is_some() {
            let around = t.topology().vertex_faces();
            vertex_normals(Par::Seq, vertices, faces, around, &mut normals);
        }
        let settings = LightSettings::default();
        let camera_from_world = self.setting.world_from_camera.inverse();
        let light = |d: [f64; 3]| {
            camera_from_world
                .vector(&V3d::from(d))
                .normalize()
                .cast::<f32>()
        };
        let (key, fill, up) = (
            light(settings.key),
            light(settings.fill),
            light([0.0, 1.0, 0.0]),
        );
        let mut color = color;
        let width = buffer.width as usize;
        for (i, (&id, &z)) in buffer.face.iter().zip(&buffer.depth).enumerate() {
            if id == VisibilityBuffer::NONE || z >= depth[i] {
                continue;
            }
            depth[i] = z;
            let Some(color) = color.as_deref_mut() else {
                continue;
            };
            let f = faces[id as usize];
            let corners = f.map(|k| vertices[k as usize]);
            let w = barycentrics(&view, corners, (i % width) as f32, (i / width) as f32)
                .unwrap_or([1.0, 0.0, 0.0]);
            let mix = |a: V3, b: V3, c: V3| a * w[0] + b * w[1] + c * w[2];
            let [n0, n1, n2] = f.map(|k| normals[k as usize]);
            let [r0, r1, r2] = f.map(|k| self.rest.base[k as usize].coords);
            let (n, rest) = (mix(n0, n1, n2), mix(r0, r1, r2));
            let nearest = if w[0] >= w[1] && w[0] >= w[2] {
                0
            } else {
                1 + usize::from(w[2] > w[1])
            };
            let base = self.paint.color(f[nearest], &P3::from(rest));
            let n = n / n.norm().max(f32::EPSILON);
            let [ambient, sky, key_share, fill_share] = settings.shade;
            let shade = ambient
                + sky * n.dot(&up)
                + key_share * n.dot(&key).max(0.0)
                + fill_share * n.dot(&fill).max(0.0);
            for (c, b) in color[3 * i..3 * i + 3].iter_mut().zip(base) {
                *c = (f32::from(b) * shade).min(255.0) as u8;
            }
        }
    }

    /// Darkens the floor under feet and body.
    fn cast_shadow(&self, truth: &Truth, color: &mut [u8]) {
        let skeleton = self.actor.template.skeleton();
        let over = |name: &str| {
            let p = self
                .setting
                .world_from_camera
                .point(&truth.joints[skeleton.index(name).unwrap_or(0)]);
            [p.x as f32, p.z as f32]
        };
        let LightSettings {
            shadow,
            shadow_depth,
            ..
        } = LightSettings::default();
        let spots = [
            (over("left_foot"), shadow[0], shadow_depth[0]),
            (over("right_foot"), shadow[0], shadow_depth[0]),
            (over("pelvis"), shadow[1], shadow_depth[1]),
        ];
        for &(i, at) in &self.background.floor {
            let mut light = 1.0f32;
            for (c, radius, strength) in spots {
                let r2 = ((at[0] - c[0]).powi(2) + (at[1] - c[1]).powi(2)) / (radius * radius);
                if r2 < 1.0 {
                    light *= 1.0 - strength * (1.0 - r2) * (1.0 - r2);
                }
            }
            if light < 1.0 {
                for c in &mut color[3 * i as usize..3 * i as usize + 3] {
                    *c = (f32::from(*c) * light) as u8;
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "sequence_tests.rs"]
mod tests;
