//! Dressing and stepping: everything of a session that computes.

use crate::library::{self, Library};
use std::sync::Arc;
use std::time::Instant;
use tryon::body::measure::{Measurements, measure};
use tryon::body::{BodyShape, BoneTransforms, Pose, RestBody, Template, skin};
use tryon::cloth::realtime::{self, Input, Model, State, Workspace};
use tryon::dressing::{self, DressOptions, FitProbe, MeshWear, Suggestion, Wear};
use tryon::garment::{Pattern, library as patterns};
use tryon::math::{Camera, P3, Rigid, World};
use tryon::par::Par;
use tryon_kit::frames::stage;
use tryon_kit::telemetry::record_skipped;
use tryon_proto::convert::body::pose_from_wire;
use tryon_proto::convert::fit::fit_to_wire;
use tryon_proto::convert::frame::stages_from_wire;
use tryon_proto::convert::garment::{Positions, WornGarment};
use tryon_proto::convert::geometry::rigid_from_wire;
use tryon_proto::convert::required;
use tryon_proto::v1::{self, BodyState, GarmentChoice};

/// Longest and shortest step of the garments, seconds: a gap in the stream must not become one huge step.
const DT: (f64, f64) = (1.0 / 120.0, 1.0 / 10.0);

/// The fit of garments is measured this often, seconds.
const FIT_EVERY: f64 = 1.0;

/// A body as the garments need it.
pub(crate) struct Body {
    pub(crate) template: Arc<Template>,
    pub(crate) shape: Arc<BodyShape>,
    pose: Pose<World>,
    world_from_camera: Rigid<World, Camera>,
    pub(crate) state: BodyState,
}

impl Body {
    /// The body of a state, in the world.
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
}

/// An outfit on a body.
pub(crate) struct Worn {
    model: Model,
    state: State,
    work: Workspace,
    rest: RestBody,
    rest_of: Arc<BodyShape>,
    bones: BoneTransforms,
    posed: Vec<P3>,
    last_ns: u64,
    garments: Arc<[Arc<WornGarment>]>,
    fit: FitProbe,
    /// What is cut from a pattern, garment by garment.
    patterns: Vec<Option<Pattern>>,
    /// How each pattern is cut for the body.
    cuts: Vec<Option<Suggestion>>,
    /// Seconds of the stream since the fit was measured.
    fit_age: f64,
}

/// A message to all readers, before it is coded for each of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Said {
    /// All but the garments.
    pub(crate) frame: v1::GarmentFrame,
    /// Positions of each garment; empty when there are none.
    pub(crate) positions: Positions,
}

impl From<v1::GarmentFrame> for Said {
    fn from(frame: v1::GarmentFrame) -> Self {
        Self {
            frame,
            positions: Positions::default(),
        }
    }
}

/// A garment that was chosen.
enum Chosen<'a> {
    Cut(Box<Pattern>),
    Made(&'a MeshWear),
}

impl Chosen<'_> {
    fn name(&self) -> &str {
        match self {
            Self::Cut(p) => &p.name,
            Self::Made(m) => &m.name,
        }
    }
}

/// How each pattern is cut for a body.
fn cuts(patterns: &[Option<Pattern>], measures: &Measurements) -> Vec<Option<Suggestion>> {
    patterns
        .iter()
        .map(|p| p.as_ref().map(|p| dressing::judge(p, measures)))
        .collect()
}

/// Puts garments on; takes about a second.
pub(crate) fn dress(
    body: &Body,
    choices: &[GarmentChoice],
    library: &Library,
) -> Result<Worn, String> {
    let start = Instant::now();
    let rest = body.template.personalise(&body.shape);
    let measures = measure(&body.template, &rest).map_err(|e| e.to_string())?;
    let mut worn = Vec::with_capacity(choices.len());
    for c in choices {
        let chosen = match (library.mesh(&c.garment), library::size(&c.size)) {
            (Some(m), _) => Chosen::Made(m),
            (None, size) => {
                let size = match size {
                    Some(s) => s,
                    None => {
                        dressing::suggest(&c.garment, &measures)
                            .map_err(|e| e.to_string())?
                            .size
                    }
                };
                Chosen::Cut(Box::new(
                    patterns::pattern(&c.garment, size).map_err(|e| e.to_string())?,
                ))
            }
        };
        worn.push((chosen, c));
    }
    let list: Vec<Wear<'_>> = worn
        .iter()
        .map(|(w, _)| match w {
            Chosen::Cut(p) => Wear::Pattern(p),
            Chosen::Made(m) => Wear::Mesh(m),
        })
        .collect();
    // A shopper may see herself in a size that does not fit; the fit says so.
    let config = realtime::Config::tracked().seen_from(&body.world_from_camera);
    let options = DressOptions {
        config,
        any_size: true,
        ..DressOptions::default()
    };
    let dressed = dressing::dress_all(&body.template, &rest, &body.pose, &list, &options);
    let dressed = dressed.map_err(|e| e.to_string())?;
    // The outfit comes back in the order of its layers, and a mesh may have become several garments.
    let (mut garments, mut patterns) = (Vec::new(), Vec::new());
    for g in &dressed.model.outfit.garments {
        let (chosen, c) = worn
            .iter()
            .find(|(w, _)| w.name() == g.name)
            .ok_or("a garment has lost its name")?;
        let (size, pattern) = match chosen {
            Chosen::Cut(p) => (g.size.to_string(), Some((**p).clone())),
            Chosen::Made(_) => (String::new(), None),
        };
        let color = c
            .color_rgb
            .unwrap_or_else(|| library::own_color(&c.garment));
        patterns.push(pattern);
        garments.push(Arc::new(WornGarment {
            garment: c.garment.clone(),
            size,
            vertices: g.vertices,
            drawn: g.render.vertex.clone(),
            faces: g.render.faces.clone(),
            uvs: g.render.uv.clone(),
            look: v1::GarmentLook {
                color_rgb: color,
                accent_rgb: color,
                stripe_width: 0.0,
            },
        }));
    }
    metrics::histogram!("tryon_stage_ms", "stage" => "cloth.dress")
        .record(start.elapsed().as_secs_f64() * 1e3);
    Ok(Worn {
        garments: garments.into(),
        cuts: cuts(&patterns, &measures),
        patterns,
        fit: FitProbe::new(&body.template, &dressed.model).map_err(|e| e.to_string())?,
        fit_age: FIT_EVERY,
        model: dressed.model,
        state: dressed.state,
        work: Workspace::default(),
        rest,
        rest_of: body.shape.clone(),
        bones: BoneTransforms::default(),
        posed: Vec::new(),
        last_ns: body.time_ns(),
    })
}

impl Worn {
    /// One step to the pose of `body`.
    pub(crate) fn step(&mut self, body: &Body) -> Result<Said, String> {
        let start = Instant::now();
        if !Arc::ptr_eq(&self.rest_of, &body.shape) {
            self.rest = body.template.personalise(&body.shape);
            self.rest_of = body.shape.clone();
            let measures = measure(&body.template, &self.rest).map_err(|e| e.to_string())?;
            self.cuts = cuts(&self.patterns, &measures);
        }
        body.pose
            .bones(body.template.skeleton(), &self.rest, &mut self.bones);
        skin(
            Par::Rayon,
            &self.rest.vertices,
            body.template.weights(),
            &self.bones,
            &mut self.posed,
        );
        let skinned = stage("cloth.body", start);
        let dt = body.time_ns().saturating_sub(self.last_ns) as f64 * 1e-9;
        self.last_ns = body.time_ns();
        let begun = Instant::now();
        let input = Input {
            body: &self.posed,
            dt: dt.clamp(DT.0, DT.1),
        };
        let report = realtime::step(&self.model, &mut self.state, &input, &mut self.work)
            .map_err(|e| e.to_string())?;
        let skipped = [
            ("sleeping vertices", report.sleeping),
            ("contact searches", report.searches_skipped),
        ];
        record_skipped("cloth", skipped);
        let mut placed = self.placed(body);
        if let Some(why) = report.kept_last_good {
            placed.frame.detail = why;
        }
        placed
            .frame
            .stages
            .extend([skinned, stage("cloth.step", begun)]);
        self.fit_age += dt;
        if self.fit_age >= FIT_EVERY {
            self.fit_age = 0.0;
            let begun = Instant::now();
            let maps = self
                .fit
                .measure(&self.model, &self.state, &self.posed)
                .map_err(|e| e.to_string())?;
            let named = self.garments.iter().zip(&maps).zip(&self.cuts);
            placed.frame.fit = named
                .map(|((g, m), cut)| fit_to_wire(&g.garment, &g.size, m, cut.as_ref()))
                .collect();
            placed.frame.stages.push(stage("cloth.fit", begun));
        }
        Ok(placed)
    }

    /// What does not change of every garment, for keyframes.
    pub(crate) fn garments(&self) -> &Arc<[Arc<WornGarment>]> {
        &self.garments
    }

    fn placed(&self, body: &Body) -> Said {
        let frame = v1::GarmentFrame {
            frame: body.state.frame,
            world_from_camera: body.state.world_from_camera,
            stages: body.state.stages.clone(),
            ..Default::default()
        };
        Said {
            frame,
            positions: Arc::new(
                self.state
                    .garments
                    .iter()
                    .map(|g| g.positions.clone())
                    .collect(),
            ),
        }
    }
}
