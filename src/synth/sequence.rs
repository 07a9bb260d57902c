//! Frames of a synthetic actor, with ground truth.

use super::actor::Actor;
use super::clip::{ClipError, Performance};
use super::imaging::{ColorGrain, ColorImaging};
use super::paint::{Paint, PaintedBody};
use super::posture::Posture;
use super::room::Room;
use super::room_view::RoomView;
use super::routine::Routine;
use super::stance::Rig;
use nalgebra::UnitQuaternion;
use std::sync::Arc;
use tryon_body::{BoneTransforms, Pose, RestBody, skin};
use tryon_formats::MotionClip;
use tryon_geometry::camera::{
    Calibration, ColorImage, DepthImage, Intrinsics, NoiseModel, RgbdFrame,
};
use tryon_geometry::math::{Camera, ColorCamera, P3, P3d, Rigid, V3d, World};
use tryon_geometry::par::Par;

/// Colour camera at its own place and time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeparateColor {
    /// Its pinhole.
    pub camera: Intrinsics,
    /// From the depth camera to it.
    pub color_from_depth: Rigid<ColorCamera, Camera>,
    /// Time from the exposure of depth to that of the same frame's colour, seconds.
    pub delay: f64,
}

/// Camera, room and routine.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Depth camera, and that of colour unless it has its own.
    pub camera: Intrinsics,
    /// Colour camera beside it; colour is registered to depth without one.
    pub color_camera: Option<SeparateColor>,
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
    /// Edges and grain of colour.
    pub imaging: ColorImaging,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for Setting {
    /// A Kinect v1 on a shelf, one metre high and tilted 3° down, 2.4 m from the actor.
    fn default() -> Self {
        Self {
            camera: Intrinsics::KINECT_V1,
            color_camera: None,
            world_from_camera: Self::tilted(1.0, 3.0, 0.0),
            home: P3d::new(0.0, 0.0, -2.4),
            turn: 0.0,
            room: Some(Room::default()),
            noise: NoiseModel::KinectV1,
            routine: Routine::TryOn,
            rate: 30.0,
            color: true,
            imaging: ColorImaging::default(),
            seed: 1,
        }
    }
}

impl Setting {
    /// A studio with the camera of the default, soft edges and a little grain.
    pub fn studio() -> Self {
        Self {
            room: Some(Room::studio()),
            imaging: ColorImaging {
                samples: 2,
                grain: 1.2,
            },
            ..Self::default()
        }
    }

    /// The same setting with a colour camera of 16:9 in the place of the depth camera, `rows` high, as tall a view and wider.
    #[must_use]
    pub fn with_wide_color(self, rows: u32) -> Self {
        let depth = self.camera;
        let zoom = f64::from(rows) / f64::from(depth.height);
        let columns = rows * 16 / 9;
        let camera = Intrinsics {
            width: columns,
            height: rows,
            fx: zoom * depth.fx,
            fy: zoom * depth.fy,
            cx: 0.5 * f64::from(columns - 1),
            cy: zoom * (depth.cy + 0.5) - 0.5,
        };
        let color_camera = Some(SeparateColor {
            camera,
            color_from_depth: Rigid::identity(),
            delay: 0.0,
        });
        Self {
            color_camera,
            ..self
        }
    }

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
    view: RoomView,
    /// View and delay of a separate colour camera.
    color_view: Option<(RoomView, f64)>,
    calibration: Calibration,
    grain: Option<ColorGrain>,
    performance: Option<Arc<Performance>>,
}

/// The room from a camera, with a chair under somebody who sits.
fn room_view(setting: &Setting, camera: Intrinsics, place: Rigid<World, Camera>) -> RoomView {
    let mut view = RoomView::new(setting.room.as_ref(), camera, place);
    if setting.routine == Routine::Hold(Posture::Sitting) {
        view.place_chair(&setting.home, setting.turn);
    }
    view
}

impl Sequence {
    /// Prepares everything that does not change from frame to frame.
    pub fn new(actor: Actor, setting: Setting) -> Self {
        let t = &actor.template;
        let mut rest = t.personalise(&actor.shape);
        let paint = Paint::new(&actor.appearance, t, &mut rest);
        let mut calibration = Calibration::registered(setting.camera);
        let color_view = setting.color_camera.map(|c| {
            calibration.color = Some(c.camera);
            calibration.color_from_depth = c.color_from_depth;
            let to_color = Rigid::new(*c.color_from_depth.inverse().iso());
            let place = setting.world_from_camera * to_color;
            (room_view(&setting, c.camera, place), c.delay)
        });
        Self {
            rig: Rig::new(t.skeleton(), &rest),
            paint,
            view: room_view(&setting, setting.camera, setting.world_from_camera),
            color_view,
            calibration,
            grain: ColorGrain::new(setting.imaging.grain, setting.seed),
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
    /// Statements about the clip, one a sentence: its frame rate, its first frame, what was recognised and turned.
    pub fn clip_notes(&self) -> &[String] {
        self.performance.as_ref().map_or(&[], |p| p.notes())
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
    /// Calibration of depth and colour.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Truth of frame `i`, at the time of its depth.
    pub fn truth(&self, i: u64) -> Truth {
        self.truth_at(
            i as f64 / self.setting.rate,
            &self.setting.world_from_camera,
        )
    }

    /// Truth at a time (s), in the frame of a camera.
    fn truth_at(&self, time: f64, world_from_camera: &Rigid<World, Camera>) -> Truth {
        let t = &self.actor.template;
        let camera_from_world = world_from_camera.inverse();
        let home = self.setting.home;
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
        let (depth, _) = self.view.draw(&self.body(&truth), None);
        (depth, truth)
    }

    /// Frame `i` and its truth.
    pub fn frame(&self, i: u64) -> (RgbdFrame, Truth) {
        let truth = self.truth(i);
        let Setting {
            camera,
            color,
            imaging,
            rate,
            seed,
            ..
        } = &self.setting;
        let is_registered = self.color_view.is_none();
        let registered = (*color && is_registered).then_some(*imaging);
        let (depth, mut pixels) = self.view.draw(&self.body(&truth), registered);
        if let Some((view, delay)) = self.color_view.as_ref().filter(|_| *color) {
            let then = self.truth_at(i as f64 / rate + delay, view.place());
            pixels = Some(view.draw_color(&self.body(&then), *imaging));
        }
        if let Some((pixels, grain)) = pixels.as_mut().zip(self.grain.as_ref()) {
            grain.add(pixels, *seed, i);
        }
        let depth: DepthImage = self.setting.noise.apply(camera, &depth, *seed, i);
        // The buffer has the size of the camera.
        let Intrinsics { width, height, .. } = self.calibration.color.unwrap_or(*camera);
        let color = pixels.and_then(|c| ColorImage::new(width, height, c).ok());
        let time_ns = (i as f64 * 1e9 / rate).round() as u64;
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

    fn body<'a>(&'a self, truth: &'a Truth) -> PaintedBody<'a> {
        PaintedBody {
            template: &self.actor.template,
            rest: &self.rest,
            paint: &self.paint,
            joints: &truth.joints,
            vertices: &truth.vertices,
        }
    }
}

#[cfg(test)]
#[path = "sequence_tests.rs"]
mod tests;
