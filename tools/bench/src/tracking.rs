//! Accuracy and run time of a tracker on a scene: the measures that every table of tracking uses.

use super::{DepthScene, Row, SceneTruth};
use std::sync::Arc;
use std::time::Instant;
use tryon_body::{BoneTransforms, Template};
use tryon_geometry::camera::Intrinsics;
use tryon_geometry::math::order_statistics;
use tryon_geometry::math::{P3, P3d};
use tryon_geometry::mesh::Face;
use tryon_geometry::raster::{View, VisibilityBuffer, rasterise};
use tryon_geometry::spatial::{PointTree, closest_on_triangle};
use tryon_tracking::{
    StepReport, TrackerConfig, TrackerModel, TrackerState, TrackingStagesMs, Workspace, step,
};

/// Joint errors count from this frame on: calibration is over.
pub const FIRST_COMPARED: usize = 30;
/// Steady run time counts from this frame on (or from the middle of a shorter scene): size and shape are settled.
const FIRST_TIMED: usize = 75;
/// A vertex of the truth is visible when the drawn truth is no farther in front of it than this, metres.
const VISIBLE: f32 = 0.01;

/// Errors and times of one run.
#[derive(Clone, Debug, Default)]
pub struct TrackOutcome {
    /// Mean joint error of each frame from [`FIRST_COMPARED`] on, millimetres.
    pub joints_mm: Vec<f64>,
    /// Mean error of each joint of the truth, millimetres.
    pub per_joint_mm: Vec<f64>,
    /// Mean distance of the truth's visible vertices from the tracked surface, millimetres; NaN without truth.
    pub visible_mm: f64,
    /// The same over all vertices, unseen back included.
    pub whole_mm: f64,
    /// Mean distance between vertices of the same number, millimetres; NaN where the topologies differ.
    pub vertices_mm: f64,
    /// Mean relative error of bone lengths at the end, per cent.
    pub bones_percent: f64,
    /// Frames from the first with a pose on that have none.
    pub lost: usize,
    /// Frames until there was a pose; `None` when there never was one.
    pub found: Option<usize>,
    /// Processor time of each whole step, milliseconds.
    pub step_ms: Vec<f64>,
    /// Stages of each step.
    pub stages: Vec<TrackingStagesMs>,
    /// Processor time of posing all vertices, milliseconds.
    pub skin_ms: Vec<f64>,
    /// Iterations of each step.
    pub iterations: Vec<f64>,
    /// Report of the last step.
    pub last: Option<StepReport>,
}

/// Mean of finite values; NaN without any.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Median; NaN without values.
pub fn median(values: &[f64]) -> f64 {
    order_statistics::median(&mut values.to_vec()).unwrap_or(f64::NAN)
}

/// The part of per-frame values from which run time is taken.
pub fn steady<T>(values: &[T]) -> &[T] {
    &values[FIRST_TIMED.min(values.len() / 2)..]
}

impl TrackOutcome {
    /// Mean processor time of a whole steady step, displacements amortised, milliseconds.
    pub fn steady_ms(&self) -> f64 {
        // The system's clock of a thread ticks every few milliseconds: single values are rough, their mean is not.
        mean(steady(&self.step_ms))
    }
    /// Time of one stage of the steady steps, milliseconds: the part of the processor time that the stage has in the
    /// sum of all stages.
    pub fn stage_ms(&self, stage: impl Fn(&TrackingStagesMs) -> f64) -> f64 {
        let sum =
            |f: &dyn Fn(&TrackingStagesMs) -> f64| steady(&self.stages).iter().map(f).sum::<f64>();
        self.steady_ms() * sum(&stage) / sum(&TrackingStagesMs::total)
    }
    /// Mean processor time of posing all vertices, milliseconds.
    pub fn posing_ms(&self) -> f64 {
        mean(steady(&self.skin_ms))
    }
    /// As a row of a table.
    pub fn row(&self, scene: &DepthScene, method: &str) -> Row {
        Row::new(&scene.name, method, self.steady_ms())
            .error("joints_mm", mean(&self.joints_mm))
            .error(
                "worst_frame_mm",
                self.joints_mm.iter().copied().fold(f64::NAN, f64::max),
            )
            .error("visible_mm", self.visible_mm)
            .error("whole_mm", self.whole_mm)
            .error("vertices_mm", self.vertices_mm)
            .error("bones_percent", self.bones_percent)
            .error("lost", self.lost as f64)
            .error("pose_ms", self.stage_ms(|s| s.pose) + self.posing_ms())
    }
}

/// Processor time of this thread, milliseconds: other load does not count. Wall time where the system has no such clock.
pub fn thread_ms(start: Instant) -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let on_processor = text
        .split_whitespace()
        .next()
        .and_then(|n| n.parse::<f64>().ok())
        .map(|ns| ns * 1e-6);
    on_processor.unwrap_or_else(|| start.elapsed().as_secs_f64() * 1e3)
}

/// Comparison of tracked frames with the truth of a scene.
struct TruthComparison<'a> {
    template: &'a Template,
    scene: &'a DepthScene,
    /// Joint of the template for each joint of the truth.
    joints: Vec<Option<usize>>,
    /// Mean surface errors of each compared frame, millimetres: visible vertices, all, vertices of the same number.
    surfaces: [Vec<f64>; 3],
    last_joints: Vec<P3d>,
}

impl<'a> TruthComparison<'a> {
    fn new(template: &'a Template, scene: &'a DepthScene) -> Self {
        let skeleton = template.skeleton();
        let names = scene.joint_names.iter();
        Self {
            template,
            scene,
            joints: names.map(|n| skeleton.index(n)).collect(),
            surfaces: Default::default(),
            last_joints: Vec::new(),
        }
    }

    /// Adds the joint errors of one frame to `out`.
    fn add_joints(&mut self, truth: &SceneTruth, bones: &BoneTransforms, out: &mut TrackOutcome) {
        let pairs = self.joints.iter().zip(&truth.joints);
        let off: Vec<f64> = pairs
            .map(|(j, t)| j.map_or(f64::NAN, |j| (bones.joints[j] - t).norm() * 1e3))
            .collect();
        out.joints_mm.push(mean(&off));
        for (sum, off) in out.per_joint_mm.iter_mut().zip(&off) {
            *sum += off;
        }
        self.last_joints.clone_from(&bones.joints);
    }

    /// Adds the surface errors of one frame.
    fn add_surface(&mut self, truth: &SceneTruth, posed: &[P3]) {
        let own = self.template.mesh().faces();
        let faces = if self.scene.faces.is_empty() {
            own
        } else {
            &self.scene.faces
        };
        let camera = &self.scene.calibration.depth;
        let (visible, whole) = surface_errors(camera, truth, faces, posed, self.template);
        let [all_visible, all_whole, vertices] = &mut self.surfaces;
        all_visible.push(visible);
        all_whole.push(whole);
        if truth.vertices.len() == posed.len() && faces == own {
            let pairs = truth.vertices.iter().zip(posed);
            let off: f64 = pairs.map(|(a, b)| f64::from((a - b).norm())).sum();
            vertices.push(off / posed.len() as f64 * 1e3);
        }
    }

    /// Writes the means over all frames.
    fn finish(&self, out: &mut TrackOutcome) {
        let frames = out.joints_mm.len().max(1) as f64;
        out.per_joint_mm.iter_mut().for_each(|s| *s /= frames);
        [out.visible_mm, out.whole_mm, out.vertices_mm] =
            [0, 1, 2].map(|k| mean(&self.surfaces[k]));
        out.bones_percent = bone_error(self.template, self.scene, &self.joints, &self.last_joints);
    }
}

/// Tracks a scene from its first frame on the calling thread. `each` sees every frame with the state after it.
pub fn follow(
    template: &Arc<Template>,
    config: &TrackerConfig,
    scene: &DepthScene,
    mut each: impl FnMut(usize, &TrackerModel, &TrackerState, &StepReport, &mut Workspace),
) -> TrackOutcome {
    let model = TrackerModel::new(template.clone(), scene.calibration.clone(), *config);
    let mut state = TrackerState::new(&model);
    let mut workspace = Workspace::default();
    let mut comparison = TruthComparison::new(template, scene);
    let mut out = TrackOutcome {
        per_joint_mm: vec![0.0; comparison.joints.len()],
        ..TrackOutcome::default()
    };
    let clock = Instant::now();
    for (i, frame) in scene.frames.iter().enumerate() {
        let start = thread_ms(clock);
        let Ok(report) = step(&model, &mut state, frame, &mut workspace) else {
            continue;
        };
        let stepped = thread_ms(clock);
        let (posed, bones): (&[P3], BoneTransforms) = workspace.posed(&model, &state);
        out.skin_ms.push(thread_ms(clock) - stepped);
        out.step_ms.push(stepped - start);
        out.stages.push(report.stages_ms);
        out.iterations.push(report.iterations as f64);

        let live = state.status.is_live();
        let truth = scene.truth.get(i).filter(|t| !t.joints.is_empty());
        if live && out.found.is_none() {
            out.found = Some(i);
        }
        let nobody = !scene.truth.is_empty() && truth.is_none();
        out.lost += usize::from(!live && out.found.is_some() && !nobody);
        if let Some(truth) = truth.filter(|_| i >= FIRST_COMPARED) {
            comparison.add_joints(truth, &bones, &mut out);
            if !truth.vertices.is_empty() && live {
                comparison.add_surface(truth, posed);
            }
        }
        each(i, &model, &state, &report, &mut workspace);
        out.last = Some(report);
    }
    comparison.finish(&mut out);
    out
}

/// Mean relative error of the lengths of all bones between compared joints, per cent.
fn bone_error(
    template: &Template,
    scene: &DepthScene,
    joints: &[Option<usize>],
    ours: &[P3d],
) -> f64 {
    let Some(truth) = scene.truth.iter().rev().find(|t| !t.joints.is_empty()) else {
        return f64::NAN;
    };
    let skeleton = template.skeleton().joints();
    let off: Vec<f64> = joints
        .iter()
        .enumerate()
        .filter_map(|(k, j)| {
            let parent = skeleton[(*j)?].parent?;
            let above = joints.iter().position(|o| *o == Some(parent))?;
            let length = (truth.joints[k] - truth.joints[above]).norm();
            let got = (ours.get((*j)?)? - ours.get(parent)?).norm();
            (length > 0.0).then(|| (got / length - 1.0).abs() * 100.0)
        })
        .collect();
    mean(&off)
}

/// Mean distance of the truth's vertices from the tracked surface, millimetres: (those in view, all).
fn surface_errors(
    camera: &Intrinsics,
    truth: &SceneTruth,
    truth_faces: &[Face],
    posed: &[P3],
    template: &Template,
) -> (f64, f64) {
    let view = View::Perspective {
        camera: *camera,
        near: 0.1,
    };
    let mut buffer = VisibilityBuffer::default();
    rasterise(&view, &truth.vertices, truth_faces, &mut buffer);
    let tree = PointTree::new(posed);
    let (faces, around) = (template.mesh().faces(), template.topology().vertex_faces());
    let (mut visible, mut seen, mut whole) = (0.0, 0usize, 0.0);
    for p in &truth.vertices {
        let Some((k, _)) = tree.nearest(p, f32::INFINITY) else {
            return (f64::NAN, f64::NAN);
        };
        // The nearest point of the surface lies on a face of the nearest vertex, but for needles.
        let d = around
            .row(k)
            .iter()
            .map(|f| distance_to_triangle(p, faces[*f as usize].map(|v| posed[v as usize])))
            .fold(f32::INFINITY, f32::min);
        let d = f64::from(d) * 1e3;
        whole += d;
        let in_view = view.project(p).is_some_and(|[u, v, z]| {
            let (u, v) = (u.round(), v.round());
            let inside =
                u >= 0.0 && v >= 0.0 && u < buffer.width as f32 && v < buffer.height as f32;
            inside && z < buffer.depth[v as usize * buffer.width as usize + u as usize] + VISIBLE
        });
        if in_view {
            visible += d;
            seen += 1;
        }
    }
    (visible / seen as f64, whole / truth.vertices.len() as f64)
}

fn distance_to_triangle(p: &P3, corners: [P3; 3]) -> f32 {
    let w = closest_on_triangle(p, corners);
    let sum = |k: usize| corners[k].coords * w[k];
    (p.coords - sum(0) - sum(1) - sum(2)).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_and_means_of_nothing_are_nan() {
        assert!(mean(&[]).is_nan() && median(&[]).is_nan());
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(steady(&[0; 200]).len(), 125);
        assert_eq!(steady(&[0; 10]).len(), 5);
    }
}
