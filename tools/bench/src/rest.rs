//! Sleeping cloth under test: a subject who stands, waves one arm or walks off.

use super::{EvaluateError, OutfitSpec, Row};
use rand::{Rng, SeedableRng};
use std::sync::Arc;
use std::time::Instant;
use tryon_body::{BodyShape, BoneTransforms, Pose, RestBody, Template, skin};
use tryon_cloth::{Config, Input, State, StepReport, Workspace, step};
use tryon_dressing::Dressed;
use tryon_garment::Size;
use tryon_geometry::math::order_statistics::{median, percentile};
use tryon_geometry::math::{Body, P3, Rigid, V3, World};
use tryon_geometry::par::Par;

/// Steps a second.
const RATE: u32 = 30;
/// Steps before anything moves: long enough to fall asleep.
const QUIET: usize = 60;

/// Motion of the subject after two seconds at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// None.
    Standing,
    /// Left forearm waved once in two seconds, 0.6 rad to each side, and the upper arm by a third of that.
    Waving,
    /// Left arm lifted by 0.9 rad and lowered within two seconds; it drags the hem of the shirt.
    Lifting,
    /// Walk at 0.6 m/s.
    WalkingOff,
}

/// Cost and result of one run, without its rest at the beginning.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RestReport {
    /// Run time of each step of 1/30 s (ms).
    pub ms: Vec<f64>,
    /// Share of sleeping vertices in each step.
    pub asleep: Vec<f64>,
    /// Depth of the deepest vertex under the skin (m).
    pub penetration: f64,
    /// Report of the last step.
    pub last: StepReport,
    /// Vertices after each step, shape `(steps, garments, vertices)`, metres.
    pub positions: Vec<Vec<Vec<P3>>>,
}

fn fault(why: impl ToString) -> EvaluateError {
    EvaluateError::new("standing", why)
}

/// Dressed subject at rest.
pub struct RestingSubject {
    template: Arc<Template>,
    rest: RestBody,
    standing: Pose<World>,
    /// Outfit on the body.
    pub dressed: Dressed,
}

impl RestingSubject {
    /// Dresses the embedded body in size M. `arms` is the angle of straight arms below the horizontal (rad); `None`
    /// leaves them as in the rest pose, off the trunk.
    ///
    /// # Errors
    /// A garment that is not known or cannot be put on.
    pub fn new(outfit: &OutfitSpec, arms: Option<f64>) -> Result<Self, EvaluateError> {
        let template = tryon_body::embedded::template();
        let rest = template.personalise(&BodyShape::default());
        let mut standing = Pose::rest(template.skeleton(), Rigid::<World, Body>::identity());
        if let Some(angle) = arms {
            standing.lower_arms(template.skeleton(), &rest, angle);
        }
        let dressed = outfit
            .dress(&template, &rest, &standing, |_| Ok(Size::M))
            .map_err(fault)?;
        Ok(Self {
            template,
            rest,
            standing,
            dressed,
        })
    }
    /// Skin at a time since the motion began (s), world coordinates (m).
    pub fn body(&self, motion: Motion, time: f64) -> Vec<P3> {
        let skeleton = self.template.skeleton();
        let mut pose = self.standing.clone();
        let phase = std::f64::consts::PI * time.max(0.0);
        let turns = match motion {
            Motion::Waving => [0.2 * phase.sin(), 0.3 * (1.0 - (2.0 * phase).cos())],
            Motion::Lifting => [0.45 * (1.0 - phase.cos()), 0.0],
            Motion::Standing | Motion::WalkingOff => [0.0; 2],
        };
        for (joint, turn) in ["left_shoulder", "left_elbow"].iter().zip(turns) {
            // The last angle: about z of the shoulder, the only one of the elbow.
            if let Some(j) = skeleton.index(joint) {
                let end = skeleton.dof_offset(j) + skeleton.joints()[j].motion.dofs();
                pose.angles[end - 1] += turn;
            }
        }
        let mut bones = BoneTransforms::default();
        pose.bones(skeleton, &self.rest, &mut bones);
        let (mut body, weights) = (Vec::new(), self.template.weights());
        skin(Par::Rayon, &self.rest.vertices, weights, &bones, &mut body);
        if motion == Motion::WalkingOff {
            let by = V3::new(0.0, 0.0, (0.6 * time.max(0.0)) as f32);
            body.iter_mut().for_each(|p| *p += by);
        }
        body
    }
    /// Two seconds at rest, then `steps` steps of a motion, with the settings of `config`. Each body is displaced as a
    /// whole by up to `noise` (m) and by a wave of that height along it.
    ///
    /// # Errors
    /// A step that is refused.
    pub fn run(
        &mut self,
        config: &Config,
        motion: Motion,
        steps: usize,
        noise: f32,
    ) -> Result<RestReport, EvaluateError> {
        let before = self.dressed.model.replace_config(*config);
        let mut state: State = self.dressed.state.clone();
        let (mut work, mut report) = (Workspace::default(), RestReport::default());
        let dt = 1.0 / f64::from(RATE);
        let total: usize = state.garments.iter().map(|g| g.positions.len()).sum();
        let mut rng = rand_pcg::Pcg32::seed_from_u64(17);
        for index in 0..QUIET + steps {
            let mut body = self.body(motion, (index as f64 - QUIET as f64) * dt);
            let mut some = || noise * rng.random_range(-1.0f32..1.0);
            let (whole, wave) = (
                V3::new(some(), some(), some()),
                V3::new(some(), some(), some()),
            );
            body.iter_mut()
                .for_each(|p| *p += whole + wave * (7.0 * p.y).sin());
            let started = Instant::now();
            let input = Input { body: &body, dt };
            let r = step(&self.dressed.model, &mut state, &input, &mut work).map_err(fault)?;
            if index >= QUIET {
                report.ms.push(started.elapsed().as_secs_f64() * 1e3);
                report.asleep.push(r.sleeping as f64 / total.max(1) as f64);
                report.penetration = report.penetration.max(r.penetration_left);
                report
                    .positions
                    .push(state.garments.iter().map(|g| g.positions.clone()).collect());
            }
            report.last = r;
        }
        self.dressed.model.replace_config(before);
        Ok(report)
    }
}

impl RestReport {
    /// Row of a benchmark: median time of a step, and how far the cloth is from that of a run that never sleeps.
    fn row(&self, scene: &str, method: &str, truth: &Self) -> Row {
        let ms = median(&mut self.ms.clone()).unwrap_or(0.0);
        let [rms, p99, most] = self.apart(truth).map(|m| m * 1e3);
        Row::new(scene, method, ms)
            .with("asleep", format!("{:.2}", self.mean_asleep()))
            .error("rms_mm", rms)
            .error("p99_mm", p99)
            .error("most_mm", most)
            .error("penetration_mm", self.penetration * 1e3)
    }
    /// Mean share of the vertices that slept.
    pub fn mean_asleep(&self) -> f64 {
        self.asleep.iter().sum::<f64>() / self.asleep.len().max(1) as f64
    }
    /// Distance between the cloth of two runs after the last step: root mean square, 99th percentile, largest (m).
    pub fn apart(&self, other: &Self) -> [f64; 3] {
        let (Some(a), Some(b)) = (self.positions.last(), other.positions.last()) else {
            return [0.0; 3];
        };
        let mut far: Vec<f64> = a
            .iter()
            .flatten()
            .zip(b.iter().flatten())
            .map(|(p, q)| f64::from((p - q).norm()))
            .collect();
        let n = far.len().max(1);
        let rms = (far.iter().map(|d| d * d).sum::<f64>() / n as f64).sqrt();
        let [p99, most] = [99, 100].map(|p| percentile(&mut far, p).unwrap_or(0.0));
        [rms, p99, most]
    }
}

/// Measures an outfit on an exact body and on one with 1.5 mm of noise, in every motion: a row for cloth that never sleeps
/// and one for cloth that does. `arms` as in [`RestingSubject::new`]; `done` receives the rows.
///
/// # Errors
/// As [`RestingSubject::new`] and [`RestingSubject::run`].
pub fn measure_rest(
    outfit: &OutfitSpec,
    arms: Option<f64>,
    steps: usize,
    mut done: impl FnMut(Row),
) -> Result<(), EvaluateError> {
    use Motion::{Lifting, Standing, WalkingOff, Waving};
    let mut subject = RestingSubject::new(outfit, arms)?;
    let bodies = [
        ("exact", outfit.config, 0.0),
        ("tracked", Config::tracked(), 1.5e-3),
    ];
    for (body, config, noise) in bodies {
        let never = Config {
            sleep: false,
            ..config
        };
        for motion in [Standing, Waving, Lifting, WalkingOff] {
            let scene = format!("{body} {motion:?}");
            let truth = subject.run(&never, motion, steps, noise)?;
            done(truth.row(&scene, "never asleep", &truth));
            let asleep = subject.run(&config, motion, steps, noise)?;
            done(asleep.row(&scene, "by region", &truth));
        }
    }
    Ok(())
}
