//! The whole chain in one thread of thought: a frame in, a picture out. What the services do over the wire, without it.

use crate::input;
use anyhow::{Context, Result};
use std::path::Path;
use std::sync::Arc;
use tryon::body::measure::measure;
use tryon::body::{BoneTransforms, Pose, RestBody, Template, skin};
use tryon::camera::{Calibration, ColorImage, RgbdFrame};
use tryon::cloth::realtime;
use tryon::composite::{self, BodyView, GarmentView, Look};
use tryon::dressing::{DressOptions, MadeOn, MeshWear, Wear, dress_all, suggest};
use tryon::garment::{Pattern, Size, library};
use tryon::math::{P3, World};
use tryon::par::Par;
use tryon::tracking::{self, Status, TrackerConfig, TrackerModel, TrackerState};

/// A garment that was asked for.
#[derive(Debug, Clone)]
pub(crate) enum Choice {
    /// A garment of the library.
    Library {
        /// Its name.
        name: String,
        /// Chosen from the tracked body when absent.
        size: Option<Size>,
    },
    /// A pattern from a file, in the size that it was cut in.
    File(Box<Pattern>),
    /// A mesh from a file, made on another body.
    Mesh(Arc<MeshWear>),
}

impl Choice {
    /// Checks names and size at once, before any frame is read.
    ///
    /// # Errors
    /// Names the unknown garment or size, or what is wrong in a pattern file.
    pub(crate) fn parse(
        names: &[String],
        size: Option<&str>,
        body: Option<&Path>,
    ) -> Result<Vec<Self>> {
        let size = size.map(str::parse).transpose()?;
        let body = body
            .map(MadeOn::read)
            .transpose()
            .context("--garment-body")?;
        names
            .iter()
            .map(|name| {
                if name.ends_with(".json") {
                    return Ok(Self::File(Box::new(input::pattern(Path::new(name))?)));
                }
                if input::is_mesh(name) {
                    return Ok(Self::Mesh(Arc::new(input::mesh_garment(
                        Path::new(name),
                        body.clone(),
                    )?)));
                }
                library::pattern(name, size.unwrap_or_default())?;
                Ok(Self::Library {
                    name: name.clone(),
                    size,
                })
            })
            .collect()
    }
}

/// Time between frames when their clocks say nothing usable, s.
const FRAME_TIME: f64 = 1.0 / 30.0;
/// A longer gap than this is no time step for cloth: the camera paused, s.
const LONGEST_STEP: f64 = 0.2;

/// Garments on the body.
struct Worn {
    model: realtime::Model,
    state: realtime::State,
    work: realtime::Workspace,
    /// The body as these garments meet it.
    roomy: realtime::RoomyBody,
    looks: Vec<Look>,
}

/// What became of one frame.
#[derive(Debug)]
pub(crate) struct Outcome {
    /// The picture; the captured one while nobody is dressed.
    pub(crate) picture: ColorImage,
    /// Garments are in the picture.
    pub(crate) dressed: bool,
    /// Milliseconds by stage.
    pub(crate) stages: Vec<(&'static str, f64)>,
    /// Work left out, by kind.
    pub(crate) skipped: Vec<(&'static str, f64)>,
    /// Mean distance of the body to the readings, millimetres.
    pub(crate) residual_mm: f64,
    /// Deepest garment vertex under the skin, metres.
    pub(crate) penetration: f64,
}

/// One session.
pub(crate) struct Chain {
    choices: Vec<Choice>,
    tracker: Arc<TrackerModel>,
    tracked: TrackerState,
    tracking_work: tracking::Workspace,
    worn: Option<Worn>,
    compositor: composite::Model,
    composite_state: composite::State,
    composite_work: composite::Workspace,
    limbs: composite::Limbs,
    last_ns: Option<u64>,
    /// What was said about sizes.
    pub(crate) notes: Vec<String>,
}

impl Chain {
    /// A session in front of this camera.
    pub(crate) fn new(
        template: Arc<Template>,
        calibration: &Calibration,
        choices: Vec<Choice>,
    ) -> Self {
        let limbs = composite::Limbs::of(&template);
        let tracker = TrackerModel::new(template, calibration.clone(), TrackerConfig::default());
        let tracked = TrackerState::new(&tracker);
        Self {
            choices,
            tracker: Arc::new(tracker),
            tracked,
            tracking_work: tracking::Workspace::default(),
            worn: None,
            compositor: composite::Model::default(),
            composite_state: composite::State::default(),
            composite_work: composite::Workspace::default(),
            limbs,
            last_ns: None,
            notes: Vec::new(),
        }
    }

    /// Posed surface of the tracked body in the camera's frame.
    pub(crate) fn body(&self) -> (Vec<P3>, &Template) {
        let template = self.tracker.template();
        let rest = template.personalise(&self.tracked.shape);
        let mut vertices = Vec::new();
        pose_surface(template, &rest, &self.tracked.pose, &mut vertices);
        (vertices, template)
    }

    /// One frame through tracking, dressing, cloth and compositing.
    ///
    /// # Errors
    /// A frame that does not fit the camera, or a garment that cannot be put on.
    pub(crate) fn frame(&mut self, frame: &RgbdFrame) -> Result<Outcome> {
        let mut clock = std::time::Instant::now();
        let mut stages = Vec::new();
        let mut lap = |name: &'static str, stages: &mut Vec<(&'static str, f64)>| {
            let now = std::time::Instant::now();
            stages.push((name, now.duration_since(clock).as_secs_f64() * 1e3));
            clock = now;
        };
        let report = tracking::step(
            &self.tracker,
            &mut self.tracked,
            frame,
            &mut self.tracking_work,
        )?;
        lap("tracking", &mut stages);
        let mut skipped = vec![
            (
                "hidden template points",
                report.skipped.hidden_points as f64,
            ),
            (
                "pictures that show nothing new",
                report.skipped.frames as f64,
            ),
        ];

        let dt = self.time_step(frame.time_ns);
        let template = Arc::clone(self.tracker.template());
        let mut body_camera = Vec::new();
        let mut penetration = 0.0;
        if self.tracked.status == Status::Tracking {
            body_camera.extend_from_slice(self.tracking_work.posed(&self.tracker, &self.tracked).0);
            if self.worn.is_none() && !self.choices.is_empty() {
                let rest = template.personalise(&self.tracked.shape);
                self.worn = Some(self.put_on(&template, &rest)?);
                lap("dressing", &mut stages);
            }
            if let Some(worn) = &mut self.worn {
                let mut body = Vec::new();
                self.tracked
                    .world_from_camera
                    .points_f32(&body_camera, &mut body);
                let input = realtime::Input { body: &body, dt };
                let r = realtime::step(&worn.model, &mut worn.state, &input, &mut worn.work)?;
                penetration = r.penetration_left;
                skipped.push(("sleeping cloth vertices", r.sleeping as f64));
                lap("cloth", &mut stages);
            }
        }
        let live = self.tracked.status == Status::Tracking;
        if let Some(worn) = self.worn.as_mut().filter(|_| live) {
            body_camera = worn.roomy.make_room(Par::Rayon, &body_camera).to_vec();
        }
        let picture = self.picture(frame, live.then_some(body_camera.as_slice()), &mut skipped)?;
        lap("composite", &mut stages);
        Ok(Outcome {
            picture,
            dressed: live && self.worn.is_some(),
            stages,
            skipped,
            residual_mm: report.residual_mm,
            penetration,
        })
    }

    fn time_step(&mut self, time_ns: u64) -> f64 {
        let last = self.last_ns.replace(time_ns);
        let dt = last
            .and_then(|l| time_ns.checked_sub(l))
            .map_or(FRAME_TIME, |ns| ns as f64 * 1e-9);
        if dt > 0.0 && dt <= LONGEST_STEP {
            dt
        } else {
            FRAME_TIME
        }
    }

    fn put_on(&mut self, template: &Template, rest: &RestBody) -> Result<Worn> {
        let measures = measure(template, rest)?;
        enum Chosen {
            Pattern(Box<Pattern>),
            Mesh(Arc<MeshWear>),
        }
        let mut chosen: Vec<Chosen> = Vec::new();
        for c in &self.choices {
            chosen.push(match c {
                Choice::File(pattern) => Chosen::Pattern(pattern.clone()),
                Choice::Mesh(mesh) => {
                    self.notes
                        .extend(mesh.notes.iter().map(|n| format!("{}: {n}", mesh.name)));
                    Chosen::Mesh(mesh.clone())
                }
                Choice::Library {
                    name,
                    size: Some(size),
                } => Chosen::Pattern(Box::new(library::pattern(name, *size)?)),
                Choice::Library { name, size: None } => {
                    let s = suggest(name, &measures)?;
                    self.notes
                        .push(format!("{name}: {} ({})", s.size, s.reason));
                    Chosen::Pattern(Box::new(library::pattern(name, s.size)?))
                }
            });
        }
        let wear: Vec<Wear<'_>> = chosen
            .iter()
            .map(|c| match c {
                Chosen::Pattern(p) => Wear::Pattern(p),
                Chosen::Mesh(m) => Wear::Mesh(m),
            })
            .collect();
        let pose: Pose<World> = Pose {
            root: self.tracked.world_from_camera * self.tracked.pose.root,
            angles: self.tracked.pose.angles.clone(),
        };
        let config = realtime::Config::tracked().seen_from(&self.tracked.world_from_camera);
        let roomy = realtime::RoomyBody::new(template, &config)?;
        let options = DressOptions {
            config,
            ..DressOptions::default()
        };
        let dressed = dress_all(template, rest, &pose, &wear, &options)
            .context("the garments cannot be put on")?;
        let looks = dressed
            .model
            .outfit
            .garments
            .iter()
            .map(|g| look(&g.name))
            .collect();
        Ok(Worn {
            model: dressed.model,
            state: dressed.state,
            work: realtime::Workspace::default(),
            roomy,
            looks,
        })
    }

    fn picture(
        &mut self,
        frame: &RgbdFrame,
        body: Option<&[P3]>,
        skipped: &mut Vec<(&'static str, f64)>,
    ) -> Result<ColorImage> {
        let camera_from_world = self.tracked.world_from_camera.inverse();
        let mut drawn: Vec<Vec<P3>> = Vec::new();
        if let (Some(worn), Some(_)) = (&self.worn, body) {
            for (mesh, state) in worn.model.outfit.garments.iter().zip(&worn.state.garments) {
                let (mut world, mut camera) = (Vec::new(), Vec::new());
                mesh.render_positions(&state.positions, &mut world);
                camera_from_world.points_f32(&world, &mut camera);
                drawn.push(camera);
            }
        }
        let garments: Vec<GarmentView<'_>> = match &self.worn {
            Some(worn) => drawn
                .iter()
                .zip(&worn.model.outfit.garments)
                .zip(&worn.looks)
                .map(|((vertices, mesh), look)| GarmentView {
                    vertices,
                    faces: &mesh.render.faces,
                    uv: &mesh.render.uv,
                    normals: &[],
                    look,
                })
                .collect(),
            None => Vec::new(),
        };
        let input = composite::Input {
            frame,
            calibration: self.tracker.calibration(),
            garments: &garments,
            body: body.map(|vertices| BodyView {
                vertices,
                faces: self.tracker.template().mesh().faces(),
                limbs: &self.limbs,
            }),
            output: None,
        };
        let (picture, report) = composite::render(
            &self.compositor,
            &mut self.composite_state,
            &input,
            &mut self.composite_work,
        )?;
        skipped.push(("picture tiles without garment", report.tiles_skipped as f64));
        skipped.push(("garment faces hidden by others", report.faces_hidden as f64));
        skipped.push(("garments hidden by others", report.garments_hidden as f64));
        skipped.push((
            "normals of unseen garment vertices",
            report.normals_skipped as f64,
        ));
        skipped.push(("hands away from garments", report.hands.skipped as f64));
        Ok(picture)
    }
}

fn pose_surface<F>(template: &Template, rest: &RestBody, pose: &Pose<F>, out: &mut Vec<P3>) {
    let mut bones = BoneTransforms::default();
    pose.bones(template.skeleton(), rest, &mut bones);
    skin(Par::Rayon, &rest.vertices, template.weights(), &bones, out);
}

/// How a garment of the library is drawn.
pub(crate) fn look(garment: &str) -> Look {
    Look {
        base: library::dye(garment),
        ..Look::default()
    }
}
