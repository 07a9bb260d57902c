//! Outfits worn through whole motions: crossings of cloth with cloth, speed of cloth at rest, stretch and run time.

use super::{EvaluateError, OutfitSpec, Row};
use clap::ValueEnum;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use tryon_body::{Pose, RestBody, Template, embedded, measure};
use tryon_cloth::{Input, State, Workspace, step};
use tryon_dressing::{Dressed, suggest};
use tryon_formats::open_recording;
use tryon_geometry::math::order_statistics::percentile;
use tryon_geometry::math::{Camera, P3, Rigid, World};
use tryon_geometry::spatial::intersections;
use tryon_synth::{Actor, Routine, Sequence, Setting};
use tryon_tracking::{Status, TrackerConfig, TrackerModel, TrackerState};

/// Pictures a second.
const RATE: f64 = 30.0;
/// Pictures of somebody who stands.
const STANDING: u64 = 150;
/// Last pictures of a motion whose cloth may be at rest.
const AT_REST: usize = 30;

/// Motion that an outfit is worn through.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WornMotion {
    /// Five seconds in the calibration pose, with breath and sway.
    Standing,
    /// The built-in routine of a try-on.
    Calm,
    /// A dance, as it is tracked.
    Charleston,
    /// Jumping jacks, as they are tracked.
    Jacks,
}

impl WornMotion {
    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Standing => "standing",
            Self::Calm => "calm",
            Self::Charleston => "charleston",
            Self::Jacks => "jacks",
        }
    }
}

/// Body of a person and its motion.
pub struct Wearer {
    motion: WornMotion,
    template: Arc<Template>,
    rest: RestBody,
    /// Pose of the first body.
    first: Pose<World>,
    /// Skin of each picture, world (m).
    bodies: Vec<Vec<P3>>,
}

fn fault(why: impl ToString) -> EvaluateError {
    EvaluateError::new("worn", why)
}

fn in_world(place: Rigid<World, Camera>, pose: &Pose<Camera>) -> Pose<World> {
    Pose {
        root: place * pose.root,
        angles: pose.angles.clone(),
    }
}

impl Wearer {
    /// Plays or tracks a motion; recordings lie below `data`.
    ///
    /// # Errors
    /// A recording that cannot be read, or shows nobody.
    pub fn new(motion: WornMotion, data: &Path) -> Result<Self, EvaluateError> {
        let sequence = |name: &str| Self::tracked(motion, &data.join("sequences").join(name));
        match motion {
            WornMotion::Standing => Ok(Self::synthetic(motion, Routine::Still, STANDING)),
            WornMotion::Calm => {
                let routine = Routine::TryOn;
                let pictures = (routine.period() * RATE) as u64;
                Ok(Self::synthetic(motion, routine, pictures))
            }
            WornMotion::Charleston => sequence("charleston_m_heavy_tof_room"),
            WornMotion::Jacks => sequence("jacks_f_avg_kinect1_room"),
        }
    }

    fn synthetic(motion: WornMotion, routine: Routine, pictures: u64) -> Self {
        let setting = Setting {
            routine,
            rate: RATE,
            color: false,
            room: None,
            ..Setting::default()
        };
        let place = setting.world_from_camera;
        let sequence = Sequence::new(Actor::default(), setting);
        let bodies = (0..pictures).map(|i| {
            let mut body = Vec::new();
            place.points_f32(&sequence.truth(i).vertices, &mut body);
            body
        });
        Self {
            motion,
            template: sequence.actor().template.clone(),
            rest: sequence.rest().clone(),
            first: in_world(place, &sequence.truth(0).pose),
            bodies: bodies.collect(),
        }
    }

    fn tracked(motion: WornMotion, recording: &Path) -> Result<Self, EvaluateError> {
        let mut source = open_recording(recording).map_err(fault)?;
        let template = embedded::template();
        let calibration = source.calibration().clone();
        let model = TrackerModel::new(template.clone(), calibration, TrackerConfig::default());
        let mut state = TrackerState::new(&model);
        let mut work = tryon_tracking::Workspace::default();
        let (mut bodies, mut begun) = (Vec::new(), None);
        while let Some(frame) = source.next_frame().map_err(fault)? {
            tryon_tracking::step(&model, &mut state, &frame, &mut work).map_err(fault)?;
            if state.status != Status::Tracking {
                continue;
            }
            let (place, mut body) = (state.world_from_camera, Vec::new());
            place.points_f32(work.posed(&model, &state).0, &mut body);
            bodies.push(body);
            let start = || {
                (
                    template.personalise(&state.shape),
                    in_world(place, &state.pose),
                )
            };
            begun.get_or_insert_with(start);
        }
        let (rest, first) = begun.ok_or_else(|| fault("nobody is tracked"))?;
        Ok(Self {
            motion,
            template,
            rest,
            first,
            bodies,
        })
    }

    /// Wears an outfit in the suggested sizes through the motion.
    ///
    /// # Errors
    /// A garment that is not known, or cannot be put on or simulated.
    pub fn wear(&self, outfit: &OutfitSpec) -> Result<WornReport, EvaluateError> {
        let measures = measure::measure(&self.template, &self.rest).map_err(fault)?;
        let size = |garment: &str| {
            let suggested = suggest(garment, &measures).map_err(|e| e.to_string())?;
            Ok(suggested.size)
        };
        let dressed = outfit.dress(&self.template, &self.rest, &self.first, size);
        let Dressed {
            model, mut state, ..
        } = dressed.map_err(fault)?;
        let faces: Vec<_> = model.outfit.garments.iter().map(|g| &g.faces).collect();
        let cloth = ClothFaces::new(&faces, &state);
        let mut report = WornReport {
            vertices: cloth.owner.len(),
            ..WornReport::default()
        };
        let (mut work, dt) = (Workspace::default(), 1.0 / RATE);
        for (i, body) in self.bodies.iter().enumerate() {
            let started = Instant::now();
            let r = step(&model, &mut state, &Input { body, dt }, &mut work).map_err(fault)?;
            report.ms.push(started.elapsed().as_secs_f64() * 1e3);
            report.stages_ms[0] += r.stages_ms.maps + r.stages_ms.contact;
            report.stages_ms[1] += r.stages_ms.solve;
            report.strain.push(r.p99_strain);
            report.faults += usize::from(r.kept_last_good.is_some());
            report.crossings.push(cloth.crossings(&state));
            if i + AT_REST >= self.bodies.len() {
                let speeds = state.garments.iter().flat_map(|g| &g.velocities);
                report.speeds.extend(speeds.map(|v| f64::from(v.norm())));
            }
        }
        Ok(report)
    }

    /// Row of an outfit's report.
    pub fn row(&self, outfit: &OutfitSpec, report: &WornReport) -> Row {
        report.row(self.motion.name(), &outfit.garments.join("+"))
    }
}

/// Faces of all garments, their vertices numbered through.
struct ClothFaces {
    faces: Vec<[u32; 3]>,
    /// Garment of each vertex.
    owner: Vec<usize>,
}

impl ClothFaces {
    fn new(faces: &[&Vec<[u32; 3]>], state: &State) -> Self {
        let (mut all, mut owner) = (Vec::new(), Vec::new());
        for (k, (own, g)) in faces.iter().zip(&state.garments).enumerate() {
            let first = owner.len() as u32;
            all.extend(own.iter().map(|f| f.map(|v| v + first)));
            owner.resize(owner.len() + g.positions.len(), k);
        }
        Self { faces: all, owner }
    }

    /// Edges through faces of their own garment, and of another one.
    fn crossings(&self, state: &State) -> [usize; 2] {
        let garments = state.garments.iter();
        let positions: Vec<P3> = garments.flat_map(|g| g.positions.clone()).collect();
        let mut found = [0; 2];
        for i in intersections(&self.faces, &positions) {
            let [edge, face] = [i.edge[0], self.faces[i.face as usize][0]];
            found[usize::from(self.owner[edge as usize] != self.owner[face as usize])] += 1;
        }
        found
    }
}

/// Cost and quality of one outfit in one motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WornReport {
    /// Vertices of all garments.
    pub vertices: usize,
    /// Run time of each step (ms).
    pub ms: Vec<f64>,
    /// Sums of the contact's and the solver's time (ms).
    pub stages_ms: [f64; 2],
    /// Edges through faces of their own garment and of another one, in each picture.
    pub crossings: Vec<[usize; 2]>,
    /// 99th percentile of the edges' stretch in each picture.
    pub strain: Vec<f64>,
    /// Speeds of all vertices in the last second (m/s).
    pub speeds: Vec<f64>,
    /// Steps that kept the last good state.
    pub faults: usize,
}

impl WornReport {
    /// Row of a benchmark; its time is the mean.
    fn row(&self, scene: &str, method: &str) -> Row {
        let pictures = self.crossings.len().max(1) as f64;
        let all = || self.crossings.iter().map(|[own, others]| own + others);
        let sum = |k: usize| self.crossings.iter().map(|c| c[k]).sum::<usize>() as f64;
        let quantile = |v: &[f64], p| percentile(&mut v.to_vec(), p).unwrap_or(f64::NAN);
        let [contact, solve] = self.stages_ms.map(|ms| format!("{:.1}", ms / pictures));
        Row::new(scene, method, self.ms.iter().sum::<f64>() / pictures)
            .with("vertices", self.vertices)
            .with("contact_ms", contact)
            .with("solve_ms", solve)
            .with("faults", self.faults)
            .error("own_crossings", sum(0) / pictures)
            .error("layer_crossings", sum(1) / pictures)
            .error("most_crossings", all().max().unwrap_or(0) as f64)
            .error(
                "pictures_with_any_percent",
                all().filter(|n| *n > 0).count() as f64 / pictures * 100.0,
            )
            .error("p99_stretch_percent", quantile(&self.strain, 99) * 100.0)
            .error("p95_speed_mm_s", quantile(&self.speeds, 95) * 1e3)
    }
}
