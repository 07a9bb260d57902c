//! Someone who stands, waves one arm and walks off, to see what of her clothes need not be computed.

use super::EvaluateError;
use crate::body::{BodyShape, BoneTransforms, Pose, RestBody, Template, skin};
use crate::cloth::realtime::{Config, Input, State, StepReport, Workspace, step};
use crate::dressing::{DressOptions, Dressed, dress};
use crate::garment::{Size, library};
use crate::math::{Body, P3, Rigid, V3, V3d, World, log_so3};
use crate::par::Par;
use nalgebra::UnitQuaternion;
use rand::{Rng, SeedableRng};
use std::sync::Arc;
use std::time::Instant;

/// Time of a call, s.
const DT: f64 = 1.0 / 30.0;
/// Calls before anything moves: long enough to fall asleep.
const QUIET: usize = 60;

/// What is worn.
#[derive(Clone, Debug, PartialEq)]
pub struct Wearing {
    /// Names of the library's garments, size M.
    pub garments: Vec<String>,
    /// Length of the triangles' edges, metres.
    pub edge: f64,
    /// The solver while dressing.
    pub config: Config,
    /// Angle of straight arms below the horizontal, rad; as in the rest pose (off the trunk) if there is none.
    pub arms: Option<f64>,
}

/// What the person does after she has stood still for two seconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doing {
    /// Nothing.
    Standing,
    /// Waves the left forearm once in two seconds, 0.6 rad to each side, and the upper arm by a third of that.
    Waving,
    /// Lifts the left arm by 0.9 rad and lowers it within two seconds, which drags the shirt's hem along.
    Lifting,
    /// Walks off at 0.6 m/s.
    WalkingOff,
}

/// How it went while she did that.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RestReport {
    /// Each call, for 1/30 s, ms.
    pub ms: Vec<f64>,
    /// Share of the vertices that slept in each call.
    pub asleep: Vec<f64>,
    /// Deepest vertex under the skin, metres.
    pub penetration: f64,
    /// The last call's report.
    pub last: StepReport,
    /// Where cloth is after each call, shape `[calls][garments][vertices]`, metres.
    pub positions: Vec<Vec<Vec<P3>>>,
}

/// A dressed person.
pub struct Standing {
    template: Arc<Template>,
    rest: RestBody,
    standing: Pose<World>,
    /// The outfit on her.
    pub dressed: Dressed,
}

impl Standing {
    /// Dresses the embedded body.
    ///
    /// # Errors
    /// A garment that is not known or cannot be put on.
    pub fn new(wearing: &Wearing) -> Result<Self, EvaluateError> {
        let fault = |why: String| EvaluateError::Scene {
            scene: "standing".into(),
            why,
        };
        let template = crate::body::embedded::template();
        let rest = template.personalise(&BodyShape::default());
        let patterns = wearing
            .garments
            .iter()
            .map(|g| library::pattern(g, Size::M));
        let patterns = patterns
            .collect::<Result<Vec<_>, _>>()
            .map_err(|e| fault(e.to_string()))?;
        let mut options = DressOptions {
            config: wearing.config.clone(),
            ..DressOptions::default()
        };
        options.triangulation.edge_length = wearing.edge;
        let mut standing = Pose::rest(template.skeleton(), Rigid::<World, Body>::identity());
        if let Some(angle) = wearing.arms {
            lower_arms(&template, &rest, angle, &mut standing);
        }
        let dressed = dress(&template, &rest, &standing, &patterns, &options)
            .map_err(|e| fault(e.to_string()))?;
        Ok(Self {
            template,
            rest,
            standing,
            dressed,
        })
    }
    /// Her skin at a time since she began doing something, s, in world coordinates, metres.
    pub fn body(&self, doing: Doing, time: f64) -> Vec<P3> {
        let skeleton = self.template.skeleton();
        let mut pose = self.standing.clone();
        let phase = std::f64::consts::PI * time.max(0.0);
        let turns = match doing {
            Doing::Waving => [0.2 * phase.sin(), 0.3 * (1.0 - (2.0 * phase).cos())],
            Doing::Lifting => [0.45 * (1.0 - phase.cos()), 0.0],
            Doing::Standing | Doing::WalkingOff => [0.0; 2],
        };
        for (joint, turn) in ["left_shoulder", "left_elbow"].iter().zip(turns) {
            // The last angle: about z of the shoulder, the only one of the elbow.
            let last = |j: usize| {
                (skeleton.dof_offset(j) + skeleton.joints()[j].motion.dofs()).checked_sub(1)
            };
            if let Some(angle) = skeleton
                .index(joint)
                .and_then(last)
                .and_then(|k| pose.angles.get_mut(k))
            {
                *angle += turn;
            }
        }
        let mut bones = BoneTransforms::default();
        pose.bones(skeleton, &self.rest, &mut bones);
        let mut body = Vec::new();
        skin(
            Par::Rayon,
            &self.rest.vertices,
            self.template.weights(),
            &bones,
            &mut body,
        );
        if doing == Doing::WalkingOff {
            let by = V3::new(0.0, 0.0, (0.6 * time.max(0.0)) as f32);
            body.iter_mut().for_each(|p| *p += by);
        }
        body
    }
    /// She stands still for two seconds and then does something for `calls` calls, with the settings of `config`; every
    /// body is off by up to `noise` metres, the whole of it, with a wave along it.
    ///
    /// # Errors
    /// A step that is refused.
    pub fn run(
        &mut self,
        config: &Config,
        doing: Doing,
        calls: usize,
        noise: f32,
    ) -> Result<RestReport, EvaluateError> {
        let fault = |why: String| EvaluateError::Scene {
            scene: "standing".into(),
            why,
        };
        let before = std::mem::replace(&mut self.dressed.model.config, config.clone());
        let mut state: State = self.dressed.state.clone();
        let (mut work, mut report) = (Workspace::default(), RestReport::default());
        let total: usize = state.garments.iter().map(|g| g.positions.len()).sum();
        let mut rng = rand_pcg::Pcg32::seed_from_u64(17);
        for call in 0..QUIET + calls {
            let mut body = self.body(doing, (call as f64 - QUIET as f64) * DT);
            let mut some = || noise * rng.random_range(-1.0f32..1.0);
            let (whole, wave) = (
                V3::new(some(), some(), some()),
                V3::new(some(), some(), some()),
            );
            body.iter_mut()
                .for_each(|p| *p += whole + wave * (7.0 * p.y).sin());
            let started = Instant::now();
            let input = Input {
                body: &body,
                dt: DT,
            };
            let r = step(&self.dressed.model, &mut state, &input, &mut work)
                .map_err(|e| fault(e.to_string()))?;
            if call >= QUIET {
                report.ms.push(started.elapsed().as_secs_f64() * 1e3);
                report.asleep.push(r.sleeping as f64 / total.max(1) as f64);
                report.penetration = report.penetration.max(r.penetration_left);
                report
                    .positions
                    .push(state.garments.iter().map(|g| g.positions.clone()).collect());
            }
            report.last = r;
        }
        self.dressed.model.config = before;
        Ok(report)
    }
}

/// Turns the upper arms to `angle` rad below the horizontal, to the sides; a template without them keeps its pose.
pub fn lower_arms(template: &Template, rest: &RestBody, angle: f64, pose: &mut Pose<World>) {
    let skeleton = template.skeleton();
    for (side, s) in [("left", 1.0), ("right", -1.0)] {
        let [shoulder, elbow] =
            ["shoulder", "elbow"].map(|n| skeleton.index(&format!("{side}_{n}")));
        let (Some(shoulder), Some(elbow)) = (shoulder, elbow) else {
            continue;
        };
        let down = V3d::new(s * angle.cos(), -angle.sin(), 0.0);
        let turn =
            UnitQuaternion::rotation_between(&(rest.joints[elbow] - rest.joints[shoulder]), &down);
        let at = skeleton.dof_offset(shoulder);
        if let (Some(turn), Some(angles)) = (turn, pose.angles.get_mut(at..at + 3)) {
            angles.copy_from_slice(log_so3(&turn).as_slice());
        }
    }
}

impl RestReport {
    /// Median time of a call, ms.
    pub fn median_ms(&self) -> f64 {
        let mut ms = self.ms.clone();
        ms.sort_unstable_by(f64::total_cmp);
        ms.get(ms.len() / 2).copied().unwrap_or(0.0)
    }
    /// Mean time of a call, ms.
    pub fn mean_ms(&self) -> f64 {
        self.ms.iter().sum::<f64>() / self.ms.len().max(1) as f64
    }
    /// Mean share of the vertices that slept.
    pub fn mean_asleep(&self) -> f64 {
        self.asleep.iter().sum::<f64>() / self.asleep.len().max(1) as f64
    }
    /// How far the cloth of two runs is apart after the last call: root mean square, 99th percentile and most, metres.
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
        far.sort_unstable_by(f64::total_cmp);
        let n = far.len().max(1);
        let rms = (far.iter().map(|d| d * d).sum::<f64>() / n as f64).sqrt();
        [
            rms,
            far.get(far.len() * 99 / 100).copied().unwrap_or(0.0),
            far.last().copied().unwrap_or(0.0),
        ]
    }
}
