//! Dressing and stepping: the computing half of a session, between the wire and `tryon::mirror`.

use crate::library::{Library, rgb};
use std::sync::Arc;
use std::time::Instant;
use tryon::body::measure::{Measurements, measure};
use tryon::body::{BodyShape, Pose, RestBody, Template};
use tryon::cloth::StepReport;
use tryon::dressing::{self, FitProbe, Suggestion};
use tryon::geometry::math::{Camera, Rigid, World};
use tryon::mirror::{
    Choice, DressedOutfit, MirrorError, PosedBody, PutOn, SizeState, SizedGarment, Subject, Wear,
};
use tryon_kit::frames::stage;
use tryon_kit::telemetry::record_skipped;
use tryon_proto::convert::body::pose_from_wire;
use tryon_proto::convert::fit::fit_to_wire;
use tryon_proto::convert::frame::stages_from_wire;
use tryon_proto::convert::garment::{Positions, WornGarment, WornImage};
use tryon_proto::convert::geometry::rigid_from_wire;
use tryon_proto::convert::required;
use tryon_proto::v1::{self, BodyState, ClothDetail, GarmentChoice, TrackingStatus};

/// Interval between fit measurements [s of the stream].
const FIT_INTERVAL: f64 = 1.0;

/// Tracked body in the world.
pub(crate) struct Body {
    pub(crate) template: Arc<Template>,
    pub(crate) shape: Arc<BodyShape>,
    pose: Pose<World>,
    world_from_camera: Rigid<World, Camera>,
    pub(crate) state: BodyState,
}

impl Body {
    /// Body of a wire state.
    ///
    /// # Errors
    /// Names the field at fault.
    pub(crate) fn new(
        state: BodyState,
        shape: Arc<BodyShape>,
        template: Arc<Template>,
    ) -> Result<Self, String> {
        let fault = |e: tryon_proto::convert::WireError| e.within("body_state").to_string();
        let world =
            required(state.world_from_camera.as_ref(), "world_from_camera").map_err(fault)?;
        let world: Rigid<World, Camera> =
            rigid_from_wire(world, "world_from_camera").map_err(fault)?;
        let pose = required(state.pose.as_ref(), "pose").map_err(fault)?;
        let pose = pose_from_wire(pose, template.skeleton().dofs()).map_err(fault)?;
        stages_from_wire(&state.stages, "stages").map_err(fault)?;
        let pose = Pose {
            root: world * pose.root,
            angles: pose.angles,
        };
        Ok(Self {
            template,
            shape,
            pose,
            world_from_camera: world,
            state,
        })
    }
    fn time_ns(&self) -> u64 {
        self.state.frame.map_or(0, |f| f.capture_time_ns)
    }
    /// Its size has settled.
    fn is_sized(&self) -> bool {
        self.state.status() == TrackingStatus::Tracking
    }
    fn subject<'a>(&'a self, rest: &'a RestBody) -> Subject<'a> {
        Subject {
            template: &self.template,
            rest,
            pose: &self.pose,
            world_from_camera: self.world_from_camera,
        }
    }
}

/// An outfit on a tracked body.
pub(crate) struct Worn {
    wear: Wear,
    template: Arc<Template>,
    body: PosedBody,
    /// Garments are sewn from coarser cloth.
    is_coarse: bool,
    garments: Arc<[Arc<WornGarment>]>,
    fit: FitProbe,
    /// Room of each garment on the body; `None` for those made to measure.
    ease: Vec<Option<Suggestion>>,
    /// Time of the stream since the fit was measured (s).
    fit_age: f64,
    /// The body has changed since the room was measured.
    is_resized: bool,
    /// Measured fit that no message has yet.
    measured: Vec<v1::GarmentFit>,
}

/// A message to all readers, before it is coded for each of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Update {
    /// All but the garments.
    pub(crate) frame: v1::GarmentFrame,
    /// Positions of each garment; empty when there are none.
    pub(crate) positions: Positions,
}

impl From<v1::GarmentFrame> for Update {
    fn from(frame: v1::GarmentFrame) -> Self {
        Self {
            frame,
            positions: Positions::default(),
        }
    }
}

/// Room that each garment of an outfit leaves on a body.
fn ease(outfit: &DressedOutfit, measures: &Measurements) -> Vec<Option<Suggestion>> {
    (0..outfit.model.outfit.garments.len())
        .map(|k| {
            let garment = outfit.worn()[outfit.source(k)?].finished()?;
            Some(dressing::assess(&garment, measures))
        })
        .collect()
}

/// Message of the exposure of a body, without garments.
pub(crate) fn frame_of(body: &Body) -> v1::GarmentFrame {
    v1::GarmentFrame {
        frame: body.state.frame,
        world_from_camera: body.state.world_from_camera,
        stages: body.state.stages.clone(),
        ..Default::default()
    }
}

/// Puts garments on, in sizes that do not fit too: the fit says so. Takes about a second.
pub(crate) fn dress(
    body: &Body,
    choices: &[GarmentChoice],
    library: &Library,
    is_coarse: bool,
) -> Result<Worn, String> {
    let start = Instant::now();
    let rest = body.template.personalise(&body.shape);
    let chosen: Vec<Choice> = choices.iter().map(|c| library.choice(c)).collect();
    let how = PutOn {
        any_size: true,
        is_coarse,
    };
    let wear = Wear::put_on(chosen, &body.subject(&rest), body.is_sized(), how).map_err(reason)?;
    let outfit = wear.outfit();
    let garments = (0..outfit.model.outfit.garments.len())
        .map(|k| worn_garment(outfit, k, choices))
        .collect::<Result<Vec<_>, _>>()?;
    metrics::histogram!("tryon_stage_ms", "stage" => "cloth.dress")
        .record(start.elapsed().as_secs_f64() * 1e3);
    Ok(Worn {
        garments: garments.into(),
        ease: ease(outfit, wear.measures()),
        fit: FitProbe::new(&body.template, &outfit.model).map_err(|e| e.to_string())?,
        fit_age: FIT_INTERVAL,
        is_resized: false,
        measured: Vec::new(),
        is_coarse,
        wear,
        template: body.template.clone(),
        body: PosedBody::new(body.shape.clone(), rest),
    })
}

/// Reason of a failure, as a client reads it.
fn reason(e: MirrorError) -> String {
    match e {
        MirrorError::Dress(e) => e.to_string(),
        e => e.to_string(),
    }
}

/// Garment `k` of the outfit as keyframes describe it.
fn worn_garment(
    outfit: &DressedOutfit,
    k: usize,
    choices: &[GarmentChoice],
) -> Result<Arc<WornGarment>, String> {
    let mesh = &outfit.model.outfit.garments[k];
    let source = outfit.source(k).ok_or("a garment has lost its name")?;
    let choice = &choices[source];
    let worn = &outfit.worn()[source];
    let color = choice.color_rgb.unwrap_or_else(|| rgb(worn.color()));
    // A colour that somebody chose replaces it.
    let image = worn.image().filter(|_| choice.color_rgb.is_none());
    let image = image.map(|image| WornImage::new((**image).clone()));
    let image = image.transpose().map_err(|e| e.to_string())?;
    Ok(Arc::new(WornGarment {
        garment: choice.garment.clone(),
        size: worn
            .finished()
            .map_or_else(String::new, |g| g.size.to_string()),
        vertices: mesh.vertices,
        drawn: mesh.render.vertex.clone(),
        faces: mesh.render.faces.clone(),
        uvs: mesh.render.uv.clone(),
        look: v1::GarmentLook {
            color_rgb: color,
            print: choice.print,
            fabric: mesh.material.name.clone(),
        },
        image: image.map(Arc::new),
        trims: mesh.render.trims.clone(),
    }))
}

impl Worn {
    /// Moves the garments to the pose of `body`: in a step of the simulation, or as skin carries them.
    pub(crate) fn follow(&mut self, body: &Body, is_simulated: bool) -> Result<Update, String> {
        let start = Instant::now();
        self.is_resized |= self.body.pose(&body.template, &body.shape, &body.pose);
        let posed = stage("cloth.body", start);
        let subject = body.subject(self.body.rest());
        if self
            .wear
            .follow(&subject, body.is_sized())
            .map_err(reason)?
        {
            self.fit_age = FIT_INTERVAL;
        }
        let mut update = if is_simulated {
            self.step(body)?
        } else {
            self.skin(body)?
        };
        update.frame.stages.push(posed);
        update
            .frame
            .set_cloth_detail(match (is_simulated, self.is_coarse) {
                (false, _) => ClothDetail::Skinned,
                (true, true) => ClothDetail::Coarse,
                (true, false) => ClothDetail::Full,
            });
        Ok(update)
    }

    /// Garments as skin carries them; their fit is kept.
    fn skin(&mut self, body: &Body) -> Result<Update, String> {
        let begun = Instant::now();
        let positions = self.wear.outfit().skinned(self.body.vertices());
        let mut frame = frame_of(body);
        frame.stages.push(stage("cloth.skin", begun));
        Ok(Update {
            frame,
            positions: Arc::new(positions.map_err(|e| e.to_string())?),
        })
    }

    fn step(&mut self, body: &Body) -> Result<Update, String> {
        let begun = Instant::now();
        let step =
            (self.wear.step(self.body.vertices(), body.time_ns())).map_err(|e| e.to_string())?;
        let mut update = self.update(body, step.report);
        update.frame.stages.push(stage("cloth.step", begun));

        self.fit_age += step.gap;
        update.frame.fit = std::mem::take(&mut self.measured);
        Ok(update)
    }

    /// Sewn from coarser cloth.
    pub(crate) fn is_coarse(&self) -> bool {
        self.is_coarse
    }

    /// The size of the body has settled and asks for other sizes than the worn ones.
    pub(crate) fn is_misfit(&self) -> bool {
        self.wear.sizes() == SizeState::Misfit
    }

    /// True once it must be dressed anew.
    pub(crate) fn is_past_mending(&self) -> bool {
        self.wear.outfit().is_past_mending()
    }

    /// Sizes of the choices, once those of the body have settled and are worn; empty for garments made to measure.
    pub(crate) fn settled_sizes(&self) -> Option<Vec<String>> {
        let size = |g: &SizedGarment| g.size().map_or_else(String::new, |s| s.to_string());
        let is_settled = self.wear.sizes() == SizeState::Settled;
        is_settled.then(|| self.wear.outfit().worn().iter().map(size).collect())
    }

    /// The outfit after the last step, and the template of its body.
    pub(crate) fn outfit(&self) -> (&DressedOutfit, &Arc<Template>) {
        (self.wear.outfit(), &self.template)
    }

    /// Immutable part of every garment, for keyframes.
    pub(crate) fn garments(&self) -> &Arc<[Arc<WornGarment>]> {
        &self.garments
    }

    /// The fit is to be measured.
    pub(crate) fn is_fit_due(&self) -> bool {
        self.fit_age >= FIT_INTERVAL
    }

    /// Measures the fit to the body of the last message; the next one has it.
    pub(crate) fn measure_fit(&mut self) -> Result<(), String> {
        let begun = Instant::now();
        self.fit_age = 0.0;
        if std::mem::take(&mut self.is_resized) {
            let measures = measure(&self.template, self.body.rest()).map_err(|e| e.to_string())?;
            self.ease = ease(self.wear.outfit(), &measures);
        }
        let outfit = self.wear.outfit();
        let maps = self
            .fit
            .measure(&outfit.model, &outfit.state, self.body.vertices())
            .map_err(|e| e.to_string())?;
        self.measured = (self.garments.iter().zip(&maps).zip(&self.ease))
            .map(|((g, map), ease)| v1::GarmentFit {
                provisional: self.wear.sizes() == SizeState::Provisional,
                ..fit_to_wire(&g.garment, &g.size, map, ease.as_ref())
            })
            .collect();
        metrics::histogram!("tryon_stage_ms", "stage" => "cloth.fit")
            .record(begun.elapsed().as_secs_f64() * 1e3);
        Ok(())
    }

    fn update(&self, body: &Body, report: StepReport) -> Update {
        record_skipped(
            "cloth",
            [
                ("sleeping vertices", report.sleeping),
                ("contact searches", report.searches_skipped),
            ],
        );
        let mut frame = frame_of(body);
        frame.detail = report.kept_last_good.unwrap_or_default();
        let garments = self.wear.outfit().state.garments.iter();
        Update {
            frame,
            positions: Arc::new(garments.map(|g| g.positions.clone()).collect()),
        }
    }
}
