//! Unordered stills with root-relative joints (the form of ITOP): every picture is a start from nothing.

use super::EvaluateError;
use super::tracking::thread_ms;
use nalgebra::Vector3;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use tryon_body::{BoneTransforms, Skeleton, Template};
use tryon_geometry::camera::RgbdFrame;
use tryon_geometry::math::P3d;
use tryon_tracking::{TrackerConfig, TrackerModel, TrackerState, Workspace, step};

/// A joint within this distance of the truth counts, metres (the measure of the published results).
pub const WITHIN: f64 = 0.10;

/// Time between two showings of a still, nanoseconds: 30 frames per second.
const FRAME_NS: u64 = 33_333_333;

/// Names of ITOP's joints and ours; the mean of several is meant where there are several. ITOP's neck is the middle of its
/// shoulders in every picture (to a tenth of a millimetre), its torso the middle of neck and hips.
const NAMES: [(&str, &[&str]); 15] = [
    ("Head", &["head", "head_end"]),
    ("Neck", &["left_shoulder", "right_shoulder"]),
    ("R Shoulder", &["right_shoulder"]),
    ("L Shoulder", &["left_shoulder"]),
    ("R Elbow", &["right_elbow"]),
    ("L Elbow", &["left_elbow"]),
    ("R Hand", &["right_wrist", "right_hand_end"]),
    ("L Hand", &["left_wrist", "left_hand_end"]),
    (
        "Torso",
        &["left_shoulder", "right_shoulder", "left_hip", "right_hip"],
    ),
    ("R Hip", &["right_hip"]),
    ("L Hip", &["left_hip"]),
    ("R Knee", &["right_knee"]),
    ("L Knee", &["left_knee"]),
    ("R Foot", &["right_ankle"]),
    ("L Foot", &["left_ankle"]),
];

/// Result of starts on stills.
#[derive(Clone, Debug, Default)]
pub struct StillsOutcome {
    /// Pictures in which a person was found.
    pub found: usize,
    /// Share of joints within [`WITHIN`] of each picture; 0 where nobody was found.
    pub within: Vec<f64>,
    /// Joint names and their share.
    pub per_joint: Vec<(String, f64)>,
    /// Mean of (ours − truth) of each joint over the pictures in which it was within twice [`WITHIN`], metres: the
    /// difference in what the two skeletons call by one name.
    pub bias: Vec<Vector3<f64>>,
    /// Processor time of the first step of each picture, milliseconds.
    pub start_ms: Vec<f64>,
}

/// Joints of stills, relative to a root, metres.
#[derive(serde::Deserialize)]
pub(super) struct JointsFile {
    pub(super) joint_names: Vec<String>,
    pub(super) frames: Vec<TruthFrame>,
}

/// Joints of one still.
#[derive(serde::Deserialize)]
pub(super) struct TruthFrame {
    pub(super) frame: usize,
    pub(super) joints: Vec<[f64; 3]>,
}

impl JointsFile {
    pub(super) fn read(path: &Path) -> Result<Self, String> {
        let text = std::fs::read_to_string(path).map_err(|e| e.to_string())?;
        serde_json::from_str(&text).map_err(|e| e.to_string())
    }
}

/// JointComparison of root-relative joints with the truth.
struct JointComparison {
    /// Joints of the skeleton whose mean stands for each joint of the truth; `None` for one without counterpart.
    ours: Vec<Option<Vec<usize>>>,
    /// Hits of each joint.
    hits: Vec<f64>,
    /// Sum of offsets of each joint, metres, and their number.
    biases: Vec<(Vector3<f64>, f64)>,
}

impl JointComparison {
    fn new(skeleton: &Skeleton, names: &[String]) -> Self {
        let ours = |name: &String| {
            let (_, names) = NAMES.iter().find(|m| m.0 == name)?;
            names.iter().map(|n| skeleton.index(n)).collect()
        };
        Self {
            ours: names.iter().map(ours).collect(),
            hits: vec![0.0; names.len()],
            biases: vec![(Vector3::zeros(), 0.0); names.len()],
        }
    }

    /// Adds one picture; returns the share of joints within [`WITHIN`].
    fn add(&mut self, found: &[P3d], truth: &[[f64; 3]]) -> f64 {
        let pairs: Vec<(usize, P3d, P3d)> = self
            .ours
            .iter()
            .zip(truth)
            .enumerate()
            .filter_map(|(k, (ours, t))| {
                let ours = ours.as_ref()?;
                let sum: Vector3<f64> = ours.iter().map(|&j| found[j].coords).sum();
                Some((k, P3d::from(sum / ours.len() as f64), P3d::from(*t)))
            })
            .collect();
        let n = pairs.len().max(1) as f64;
        let sum = |s, (_, p, t): &(usize, P3d, P3d)| s + (p - t);
        let offset = pairs.iter().fold(Vector3::zeros(), sum) / n;
        let mut share = 0.0;
        for (k, p, t) in &pairs {
            let off = p - t - offset;
            if off.norm() < 2.0 * WITHIN {
                self.biases[*k].0 += off;
                self.biases[*k].1 += 1.0;
            }
            let hit = f64::from(u8::from(off.norm() < WITHIN));
            self.hits[*k] += hit;
            share += hit / n;
        }
        share
    }
}

/// Starts on each picture of an RGBD folder with `joints.json` and shows it `steps` times. `each` sees every result.
///
/// # Errors
/// Names the file at fault.
pub fn stills(
    template: &Arc<Template>,
    config: &TrackerConfig,
    folder: &Path,
    steps: u64,
    mut each: impl FnMut(usize, &TrackerModel, &TrackerState, &mut Workspace, &RgbdFrame, f64),
) -> Result<StillsOutcome, EvaluateError> {
    let scene = super::DepthScene::open(folder)?;
    let fault = |why: String| EvaluateError::Scene {
        scene: scene.name.clone(),
        why,
    };
    let truth = JointsFile::read(&folder.join("joints.json"))
        .map_err(|e| fault(format!("joints.json: {e}")))?;
    let mut comparison = JointComparison::new(template.skeleton(), &truth.joint_names);
    let model = TrackerModel::new(template.clone(), scene.calibration.clone(), *config);
    let mut workspace = Workspace::default();
    let mut out = StillsOutcome::default();
    let clock = Instant::now();
    for t in &truth.frames {
        let Some(picture) = scene.frames.get(t.frame) else {
            return Err(fault(format!("no picture {}", t.frame)));
        };
        let mut state = TrackerState::new(&model);
        let start = thread_ms(clock);
        for i in 0..steps.max(1) {
            let frame = RgbdFrame {
                sequence: i,
                time_ns: i * FRAME_NS,
                ..picture.clone()
            };
            step(&model, &mut state, &frame, &mut workspace).map_err(|e| fault(e.to_string()))?;
            if i == 0 {
                out.start_ms.push(thread_ms(clock) - start);
            }
        }
        let mut share = 0.0;
        if state.status.is_live() {
            out.found += 1;
            let rest = workspace.rest_body(&model, &state.shape);
            let mut bones = BoneTransforms::default();
            state.pose.bones(template.skeleton(), rest, &mut bones);
            share = comparison.add(&bones.joints, &t.joints);
        }
        out.within.push(share);
        each(t.frame, &model, &state, &mut workspace, picture, share);
    }
    let pictures = truth.frames.len().max(1) as f64;
    let names = truth.joint_names.into_iter().zip(comparison.hits);
    out.per_joint = names.map(|(name, hits)| (name, hits / pictures)).collect();
    let mean = |(sum, n): (Vector3<f64>, f64)| sum / n.max(1.0);
    out.bias = comparison.biases.into_iter().map(mean).collect();
    Ok(out)
}
