//! The chain of one person in front of one camera.

use super::body::PosedBody;
use super::choice::Choice;
use super::drawn_look::DrawnLook;
use super::error::MirrorError;
use super::offline_run::OfflineRun;
use super::outfit::{DressedOutfit, PutOn, Subject};
use super::painter::{CapturedView, DrawnOutfit, OutfitPainter};
use super::report::{MirrorFrame, StageTimer};
use super::wear::{SizeState, Wear};
use std::sync::Arc;
use tryon_body::{BodyShape, Template};
use tryon_garment::GarmentMesh;
use tryon_geometry::camera::{Calibration, ColorImage, RgbdFrame};
use tryon_geometry::math::{Camera, P3, Rigid, World};
use tryon_landmarks::Landmarker;
use tryon_tracking::{COLOR_INTERVAL, ColorEye, Status, TrackerConfig, TrackerModel, TrackerState};
use tryon_view::{Appearance, ImagePyramid, Print, RenderReport};

/// One person, one camera, one outfit: frames in, pictures out.
pub struct Mirror {
    choices: Vec<Choice>,
    tracker: TrackerModel,
    tracked: TrackerState,
    tracking_work: tryon_tracking::Workspace,
    color_eye: Option<ColorEye>,
    /// Frames so far.
    frames: u64,
    worn: Option<Worn>,
    shape: Arc<BodyShape>,
    posed: PosedBody,
    painter: OutfitPainter,
}

/// Garments on the subject and the look of each.
#[derive(Debug)]
struct Worn {
    wear: Wear,
    looks: Vec<DrawnLook>,
    /// The tracker's number of the subject who wears it.
    subject: u64,
}

impl Mirror {
    /// A chain in front of this camera. Nobody is tracked or dressed yet.
    pub fn new(template: Arc<Template>, calibration: &Calibration, choices: Vec<Choice>) -> Self {
        let painter = OutfitPainter::new(Arc::clone(&template));
        let tracker = TrackerModel::new(template, calibration.clone(), TrackerConfig::default());
        Self {
            choices,
            tracked: TrackerState::new(&tracker),
            tracker,
            tracking_work: tryon_tracking::Workspace::default(),
            color_eye: None,
            frames: 0,
            worn: None,
            shape: Arc::default(),
            posed: PosedBody::default(),
            painter,
        }
    }

    /// Also tracks by colour, in every fourth frame. The frame waits for it, so that a recording gives the same pictures
    /// each time.
    #[must_use]
    pub fn with_landmarker(mut self, landmarker: Landmarker) -> Self {
        let calibration = self.tracker.calibration().clone();
        self.color_eye = Some(ColorEye::new(landmarker, calibration));
        self
    }

    /// Takes one frame through tracking, dressing, cloth and compositing. The subject is dressed in the first frame in
    /// which the tracker is live, and once more when its size has settled and asks for other sizes. The picture is the
    /// plain one while nobody is tracked.
    ///
    /// # Errors
    /// A frame that does not fit the camera, or a garment that cannot be put on.
    pub fn step(&mut self, frame: &RgbdFrame) -> Result<MirrorFrame, MirrorError> {
        let mut timer = StageTimer::start();
        if let Some(eye) = &mut self.color_eye {
            if self.frames.is_multiple_of(COLOR_INTERVAL)
                && let Some(sighting) = eye.look(frame)?
            {
                self.tracked.see(sighting);
            }
            timer.lap("color");
        }
        self.frames += 1;
        let work = &mut self.tracking_work;
        let tracking = tryon_tracking::step(&self.tracker, &mut self.tracked, frame, work)?;
        timer.lap("tracking");

        let body = self.live_body();
        let subject = self.tracked.subject;
        (self.worn).take_if(|w| w.wear.outfit().is_past_mending() || w.subject != subject);
        if body.is_some() && self.follow()? {
            timer.lap("dressing");
        }

        let cloth = match &body {
            Some(body) => self.simulate(body, frame.time_ns)?,
            None => None,
        };
        if cloth.is_some() {
            timer.lap("cloth");
        }

        let (picture, render) = self.draw(frame, body.as_deref())?;
        timer.lap("composite");
        Ok(MirrorFrame {
            picture,
            is_dressed: cloth.is_some(),
            is_size_provisional: self.is_size_provisional(),
            stages_ms: timer.stages_ms,
            tracking,
            cloth,
            render,
        })
    }

    /// Sets the time between two measurements of garments off the person, seconds; 0 measures in every picture. See
    /// [`composite::Config::off_person_interval`](tryon_view::Config::off_person_interval).
    pub fn set_off_person_interval(&mut self, seconds: f64) {
        self.painter.set_off_person_interval(seconds);
    }

    /// Surface of the tracked body, live or not: camera frame, metres.
    pub fn posed_body(&mut self) -> &[P3] {
        self.tracking_work.posed(&self.tracker, &self.tracked).0
    }

    /// Pose of the camera in the world of the outfit.
    pub fn world_from_camera(&self) -> Rigid<World, Camera> {
        self.tracked.world_from_camera
    }

    /// Body model.
    pub fn template(&self) -> &Template {
        self.tracker.template()
    }

    /// Remarks about sizes and meshes; empty before the subject is dressed.
    pub fn notes(&self) -> &[String] {
        self.worn.as_ref().map_or(&[], |w| w.wear.notes())
    }

    /// Outfit of the subject; `None` before the subject is dressed.
    pub fn outfit(&self) -> Option<&DressedOutfit> {
        self.worn.as_ref().map(|w| w.wear.outfit())
    }

    /// Look of each garment of the outfit; empty before the subject is dressed.
    pub fn looks(&self) -> &[DrawnLook] {
        self.worn.as_ref().map_or(&[], |w| &w.looks)
    }

    /// Picture of the last frame with the outfit as the offline solver moved it, on the body that it met.
    ///
    /// # Errors
    /// A vertex that is not finite.
    pub fn picture_of(
        &self,
        painter: &mut OutfitPainter,
        frame: &RgbdFrame,
        run: &OfflineRun<'_>,
    ) -> Result<ColorImage, MirrorError> {
        let (outfit, state) = (run.outfit(), run.solver().state());
        let drawn = DrawnOutfit {
            garments: outfit.garments(),
            looks: self.looks(),
            positions: &outfit.drawn_positions(&state.positions()),
            body: &state.obstacle_positions(),
        };
        let view = CapturedView {
            frame,
            calibration: self.tracker.calibration(),
            camera_from_world: self.tracked.world_from_camera.inverse(),
        };
        Ok(painter.paint(&view, Some(&drawn), None)?.0)
    }

    /// The body that cloth meets, camera frame, metres; `None` while nobody is live.
    fn live_body(&mut self) -> Option<Vec<P3>> {
        if !matches!(self.tracked.status, Status::Calibrating | Status::Tracking) {
            return None;
        }
        if *self.shape != self.tracked.shape {
            self.shape = Arc::new(self.tracked.shape.clone());
        }
        let template = self.tracker.template();
        self.posed.pose(template, &self.shape, &self.tracked.pose);
        Some(self.posed.vertices().to_vec())
    }

    /// Moves the worn garments with the subject, and puts the choices on where nothing is worn or in other sizes. True when
    /// they were put on now.
    fn follow(&mut self) -> Result<bool, MirrorError> {
        let is_sized = self.tracked.status == Status::Tracking;
        let world_from_camera = self.tracked.world_from_camera;
        let pose = self.tracked.pose.transformed(&world_from_camera);
        let subject = Subject {
            template: self.tracker.template(),
            rest: self.posed.rest(),
            pose: &pose,
            world_from_camera,
        };

        if let Some(worn) = &mut self.worn {
            worn.wear.follow(&subject, is_sized)?;
        }
        let fits = (self.worn.as_ref()).is_some_and(|w| w.wear.sizes() != SizeState::Misfit);
        if fits || self.choices.is_empty() {
            return Ok(false);
        }
        let choices = self.choices.clone();
        let mut wear = Wear::put_on(choices, &subject, is_sized, PutOn::default())?;
        wear.follow(&subject, is_sized)?;
        self.worn = Some(Worn {
            looks: looks(wear.outfit()),
            wear,
            subject: self.tracked.subject,
        });
        Ok(true)
    }

    fn is_size_provisional(&self) -> bool {
        let worn = self.worn.as_ref();
        worn.is_some_and(|w| w.wear.sizes() == SizeState::Provisional)
    }

    fn simulate(
        &mut self,
        body_camera: &[P3],
        time_ns: u64,
    ) -> Result<Option<tryon_cloth::StepReport>, MirrorError> {
        let Some(worn) = &mut self.worn else {
            return Ok(None);
        };
        let mut body = Vec::new();
        let world_from_camera = &self.tracked.world_from_camera;
        world_from_camera.points_f32(body_camera, &mut body);
        Ok(Some(worn.wear.step(&body, time_ns)?.report))
    }

    fn draw(
        &mut self,
        frame: &RgbdFrame,
        body: Option<&[P3]>,
    ) -> Result<(ColorImage, RenderReport), MirrorError> {
        let worn = self.worn.as_ref().filter(|_| body.is_some());
        let positions = worn.map_or_else(Vec::new, |w| w.wear.outfit().drawn_positions());
        let outfit = worn.map(|worn| DrawnOutfit {
            garments: &worn.wear.outfit().model.outfit.garments,
            looks: &worn.looks,
            positions: &positions,
            body: worn.wear.outfit().state.collision_body().vertices(),
        });
        let view = CapturedView {
            frame,
            calibration: self.tracker.calibration(),
            camera_from_world: self.tracked.world_from_camera.inverse(),
        };
        Ok(self.painter.paint(&view, outfit.as_ref(), body)?)
    }
}

/// Look of each garment.
fn looks(outfit: &DressedOutfit) -> Vec<DrawnLook> {
    let look = |(k, mesh): (usize, &GarmentMesh)| {
        let source = outfit.source(k).map(|s| &outfit.worn()[s]);
        let appearance = source.map_or_else(Appearance::default, |garment| Appearance {
            base: garment.color(),
            pattern: garment.image().map_or(Print::Solid, |image| {
                Print::Image(Arc::new(ImagePyramid::new(image)))
            }),
            ..Appearance::default()
        });
        DrawnLook::of(&mesh.render, &mesh.material.name, appearance)
    };
    (outfit.model.outfit.garments.iter().enumerate())
        .map(look)
        .collect()
}
