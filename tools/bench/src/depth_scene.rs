//! Depth sequences with known truth: recorded folders and synthetic ones in one form.

use super::EvaluateError;
use std::path::Path;
use tryon_formats::npy::read_npy;
use tryon_formats::open_recording;
use tryon_geometry::camera::{Calibration, RgbdFrame};
use tryon_geometry::math::{P3, P3d};
use tryon_synth::Sequence;

/// Ground truth of one frame.
#[derive(Clone, Debug, Default)]
pub struct SceneTruth {
    /// Joints in the order of [`DepthScene::joint_names`], camera frame, metres; empty if there is nobody.
    pub joints: Vec<P3d>,
    /// Vertices of the person, camera frame, metres; empty where unknown (nine frames of ten).
    pub vertices: Vec<P3>,
}

/// Frames of one camera with the truth beside them.
#[derive(Clone, Debug)]
pub struct DepthScene {
    /// Name in tables.
    pub name: String,
    /// The camera.
    pub calibration: Calibration,
    /// Names of the joints that are compared.
    pub joint_names: Vec<String>,
    /// Triangles of [`SceneTruth::vertices`]; empty when they are those of the tracked template.
    pub faces: Vec<[u32; 3]>,
    /// Frames in order.
    pub frames: Vec<RgbdFrame>,
    /// Truth of each frame; empty when there is none.
    pub truth: Vec<SceneTruth>,
}

/// Vertices are compared in every tenth frame, as the shared sequences hold them.
const VERTEX_INTERVAL: usize = 10;

#[derive(serde::Deserialize)]
struct TruthFile {
    joint_names: Vec<String>,
    joints: Vec<Vec<[f64; 3]>>,
}

impl DepthScene {
    /// Reads an RGBD folder, with `truth.json` and `truth_vertices.npy` (every tenth frame, relative to joint 0) where
    /// they exist.
    ///
    /// # Errors
    /// Names the file and what is wrong with it.
    pub fn open(folder: &Path) -> Result<Self, EvaluateError> {
        let name = folder
            .file_name()
            .map_or_else(|| "scene".to_owned(), |n| n.to_string_lossy().into_owned());
        let fault = |why: String| EvaluateError::new(&name, why);
        let mut source = open_recording(folder).map_err(|e| fault(e.to_string()))?;
        let calibration = source.calibration().clone();
        let mut frames = Vec::new();
        while let Some(frame) = source.next_frame().map_err(|e| fault(e.to_string()))? {
            frames.push(RgbdFrame {
                color: None,
                ..frame
            });
        }
        let mut scene = Self {
            name: name.clone(),
            calibration,
            joint_names: vec![],
            faces: vec![],
            frames,
            truth: vec![],
        };
        let Ok(text) = std::fs::read_to_string(folder.join("truth.json")) else {
            return Ok(scene);
        };
        let file: TruthFile =
            serde_json::from_str(&text).map_err(|e| fault(format!("truth.json: {e}")))?;
        let (found, wanted) = (file.joints.len(), scene.frames.len());
        let is_whole = |j: &Vec<[f64; 3]>| j.len() == file.joint_names.len();
        if found != wanted || !file.joints.iter().all(is_whole) {
            return Err(fault(format!("truth.json: {found} frames for {wanted}")));
        }
        let truth = |joints: &Vec<[f64; 3]>| SceneTruth {
            joints: joints.iter().map(|p| P3d::from(*p)).collect(),
            vertices: vec![],
        };
        scene.truth = file.joints.iter().map(truth).collect();
        scene.joint_names = file.joint_names;
        let path = folder.join("truth_vertices.npy");
        if !path.exists() {
            return Ok(scene);
        }
        let (shape, values) = read_npy(&path).map_err(|e| fault(e.to_string()))?;
        let [_, n, 3] = shape[..] else {
            return Err(fault(format!("truth_vertices.npy: shape {shape:?}")));
        };
        let blocks = values.chunks_exact(3 * n.max(1) as usize);
        for (truth, block) in scene.truth.iter_mut().step_by(VERTEX_INTERVAL).zip(blocks) {
            if let Some(origin) = truth.joints.first().map(|p| p.coords.cast::<f32>()) {
                let vertices = block.chunks_exact(3);
                truth.vertices = vertices
                    .map(|v| P3::new(v[0], v[1], v[2]) + origin)
                    .collect();
            }
        }
        Ok(scene)
    }

    /// The first `frames` frames of a synthetic sequence. End points are not compared, as in the recorded truth.
    pub fn synthetic(name: impl Into<String>, sequence: &Sequence, frames: u64) -> Self {
        let template = &sequence.actor().template;
        let joints = template.skeleton().joints();
        let compared: Vec<usize> = (0..joints.len())
            .filter(|&j| !joints[j].name.ends_with("_end"))
            .collect();
        let (mut images, mut truths) = (Vec::new(), Vec::new());
        for i in 0..frames {
            let (frame, truth) = sequence.frame(i);
            images.push(RgbdFrame {
                color: None,
                ..frame
            });
            let keep = truth.present && (i as usize).is_multiple_of(VERTEX_INTERVAL);
            truths.push(SceneTruth {
                joints: if truth.present {
                    compared.iter().map(|&j| truth.joints[j]).collect()
                } else {
                    vec![]
                },
                vertices: if keep { truth.vertices } else { vec![] },
            });
        }
        Self {
            name: name.into(),
            calibration: sequence.calibration().clone(),
            joint_names: compared.iter().map(|&j| joints[j].name.clone()).collect(),
            faces: template.mesh().faces().to_vec(),
            frames: images,
            truth: truths,
        }
    }
}
