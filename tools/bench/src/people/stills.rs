//! Row `stills`: unordered pictures with root-relative joints (ITOP's form), each a start from nothing.

use super::bars::{Bar, greatest};
use super::settings::PeopleSettings;
use crate::tracking::mean;
use crate::{DepthScene, EvaluateError};
use std::path::Path;
use tryon_body::{BoneTransforms, embedded};
use tryon_geometry::camera::RgbdFrame;
use tryon_geometry::math::V3d;
use tryon_tracking::{TrackerConfig, TrackerModel, TrackerState, Workspace, step};

/// Folder below the data.
pub(super) const STILLS: &str = "rgbd/itop_stills";

/// Names of ITOP's joints and ours; the mean of several is meant where there are several. ITOP's neck is the middle of its
/// shoulders in every picture (to a tenth of a millimetre), its torso the middle of neck and hips.
#[rustfmt::skip]
const NAMES: [(&str, &[&str]); 15] = [
    ("Head", &["head", "head_end"]),
    ("Neck", &["left_shoulder", "right_shoulder"]),
    ("R Shoulder", &["right_shoulder"]),
    ("L Shoulder", &["left_shoulder"]),
    ("R Elbow", &["right_elbow"]),
    ("L Elbow", &["left_elbow"]),
    ("R Hand", &["right_wrist", "right_hand_end"]),
    ("L Hand", &["left_wrist", "left_hand_end"]),
    ("Torso", &["left_shoulder", "right_shoulder", "left_hip", "right_hip"]),
    ("R Hip", &["right_hip"]),
    ("L Hip", &["left_hip"]),
    ("R Knee", &["right_knee"]),
    ("L Knee", &["left_knee"]),
    ("R Foot", &["right_ankle"]),
    ("L Foot", &["left_ankle"]),
];

/// Joints of stills, relative to a root, metres.
#[derive(serde::Deserialize)]
pub(crate) struct JointsFile {
    pub(crate) joint_names: Vec<String>,
    pub(crate) frames: Vec<StillTruth>,
}

impl JointsFile {
    /// Reads `joints.json` of a folder; the fault as text.
    pub(crate) fn read(folder: &Path) -> Result<Self, String> {
        let text =
            std::fs::read_to_string(folder.join("joints.json")).map_err(|e| e.to_string())?;
        serde_json::from_str(&text).map_err(|e| e.to_string())
    }
}

/// Joints of one still.
#[derive(serde::Deserialize)]
pub(crate) struct StillTruth {
    pub(crate) frame: usize,
    pub(crate) joints: Vec<[f64; 3]>,
}

/// Share of pairs of joints, ours and true, that lie within reach once their mean offset is taken out.
fn share_within(pairs: &[(V3d, V3d)], within: f64) -> f64 {
    let n = pairs.len().max(1) as f64;
    let offset = pairs.iter().fold(V3d::zeros(), |s, (p, t)| s + (p - t)) / n;
    let is_near = |(p, t): &&(V3d, V3d)| (p - t - offset).norm() < within;
    pairs.iter().filter(is_near).count() as f64 / n
}

/// Share of the joints within reach, one picture each; nobody found is a share of nothing.
pub(super) fn measure(settings: &PeopleSettings, data: &Path) -> Result<Vec<Bar>, EvaluateError> {
    let folder = data.join(STILLS);
    let scene = DepthScene::open(&folder)?;
    let fault = |why: String| EvaluateError::new(&scene.name, format!("joints.json: {why}"));
    let truth = JointsFile::read(&folder).map_err(fault)?;

    let template = embedded::template();
    let skeleton = template.skeleton();
    let ours = |name: &String| -> Option<Vec<usize>> {
        let (_, names) = NAMES.iter().find(|m| m.0 == name)?;
        names.iter().map(|n| skeleton.index(n)).collect()
    };
    let ours: Vec<_> = truth.joint_names.iter().map(ours).collect();
    let config = TrackerConfig::default();
    let model = TrackerModel::new(template.clone(), scene.calibration.clone(), config);
    let mut workspace = Workspace::default();
    let (mut shares, mut missed) = (Vec::new(), Vec::new());
    for t in &truth.frames {
        let picture = scene.frames.get(t.frame);
        let picture = picture.ok_or_else(|| fault(format!("no picture {}", t.frame)))?;
        let mut state = TrackerState::new(&model);
        let frame = RgbdFrame {
            sequence: 0,
            time_ns: 0,
            ..picture.clone()
        };
        step(&model, &mut state, &frame, &mut workspace).map_err(|e| fault(e.to_string()))?;
        let mut share = 0.0;
        if state.status.is_live() {
            let rest = workspace.rest_body(&model, &state.shape);
            let mut bones = BoneTransforms::default();
            state.pose.bones(skeleton, rest, &mut bones);
            let pair = |(ours, t): (&Option<Vec<usize>>, &[f64; 3])| {
                let ours = ours.as_ref()?;
                let sum: V3d = ours.iter().map(|&j| bones.joints[j].coords).sum();
                Some((sum / ours.len() as f64, V3d::from(*t)))
            };
            let pairs: Vec<_> = ours.iter().zip(&t.joints).filter_map(pair).collect();
            share = share_within(&pairs, settings.within);
        }
        shares.push(share);
        missed.push((format!("still {}", t.frame), 100.0 * (1.0 - share)));
    }
    let measure = "ITOP joints within 10 cm, one picture each [%]";
    let bar = Bar::new(measure, 100.0 * mean(&shares), shares.len());
    Ok(vec![bar.worst(greatest(missed, " % missed"))])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offset_of_all_joints_is_no_error_and_that_of_one_is() {
        let at = |x: f64| V3d::new(x, 0.0, 0.0);
        let shifted = [0.0, 0.5, 1.0].map(|x| (at(x + 2.0), at(x)));
        assert_eq!(share_within(&shifted, 0.1), 1.0);
        let bent = [(at(0.0), at(0.0)), (at(0.5), at(0.5)), (at(1.2), at(1.0))];
        assert!((share_within(&bent, 0.1) - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(share_within(&[], 0.1), 0.0);
    }
}
