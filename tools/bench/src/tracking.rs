//! Accuracy and run time of a tracker on a scene: the measures that every table of tracking uses.

use super::{DepthScene, Row, SceneTruth};
use std::sync::Arc;
use std::time::Instant;
use tryon_body::{BoneTransforms, Template};
use tryon_geometry::math::P3;
use tryon_geometry::math::order_statistics;
use tryon_geometry::raster::{View, VisibilityBuffer, rasterise};
use tryon_geometry::spatial::{PointTree, closest_on_triangle};
use tryon_tracking::{StepReport, TrackerConfig, TrackerModel, TrackerState, Workspace, step};

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
    /// Frames from the first with a pose on that have none.
    pub lost: usize,
    /// Frames until there was a pose; `None` when there never was one.
    pub found: Option<usize>,
    /// Processor time of each whole step, milliseconds.
    pub step_ms: Vec<f64>,
}

/// Mean of finite values; NaN without any.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Median; NaN without values.
pub fn median(values: &[f64]) -> f64 {
    order_statistics::median(&mut values.to_vec()).unwrap_or(f64::NAN)
}

impl TrackOutcome {
    /// Mean processor time of a whole steady step, displacements amortised, milliseconds.
    fn steady_ms(&self) -> f64 {
        // The system's clock of a thread ticks every few milliseconds: single values are rough, their mean is not.
        mean(&self.step_ms[FIRST_TIMED.min(self.step_ms.len() / 2)..])
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
            .error("lost", self.lost as f64)
    }
}

/// Processor time of this thread, milliseconds: other load does not count. Wall time where the system has no such clock.
fn thread_ms(start: Instant) -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let on_processor = text
        .split_whitespace()
        .next()
        .and_then(|n| n.parse::<f64>().ok())
        .map(|ns| ns * 1e-6);
    on_processor.unwrap_or_else(|| start.elapsed().as_secs_f64() * 1e3)
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
    let names = scene.joint_names.iter();
    let joints: Vec<Option<usize>> = names.map(|n| template.skeleton().index(n)).collect();
    let mut visible = Vec::new();
    let mut out = TrackOutcome {
        per_joint_mm: vec![0.0; joints.len()],
        ..TrackOutcome::default()
    };
    let clock = Instant::now();
    for (i, frame) in scene.frames.iter().enumerate() {
        let start = thread_ms(clock);
        let Ok(report) = step(&model, &mut state, frame, &mut workspace) else {
            continue;
        };
        out.step_ms.push(thread_ms(clock) - start);
        let (posed, bones): (&[P3], BoneTransforms) = workspace.posed(&model, &state);

        let live = state.status.is_live();
        let truth = scene.truth.get(i).filter(|t| !t.joints.is_empty());
        if live && out.found.is_none() {
            out.found = Some(i);
        }
        let nobody = !scene.truth.is_empty() && truth.is_none();
        out.lost += usize::from(!live && out.found.is_some() && !nobody);
        if let Some(truth) = truth.filter(|_| i >= FIRST_COMPARED) {
            let pairs = joints.iter().zip(&truth.joints);
            let off: Vec<f64> = pairs
                .map(|(j, t)| j.map_or(f64::NAN, |j| (bones.joints[j] - t).norm() * 1e3))
                .collect();
            out.joints_mm.push(mean(&off));
            for (sum, off) in out.per_joint_mm.iter_mut().zip(&off) {
                *sum += off;
            }
            if !truth.vertices.is_empty() && live {
                visible.push(visible_error(scene, truth, posed, template));
            }
        }
        each(i, &model, &state, &report, &mut workspace);
    }
    let frames = out.joints_mm.len().max(1) as f64;
    out.per_joint_mm.iter_mut().for_each(|s| *s /= frames);
    out.visible_mm = mean(&visible);
    out
}

/// Mean distance of the truth's vertices in view from the tracked surface, millimetres.
fn visible_error(scene: &DepthScene, truth: &SceneTruth, posed: &[P3], template: &Template) -> f64 {
    let faces = template.mesh().faces();
    let truth_faces = if scene.faces.is_empty() {
        faces
    } else {
        &scene.faces
    };
    let view = View::Perspective {
        camera: scene.calibration.depth,
        near: 0.1,
    };
    let mut buffer = VisibilityBuffer::default();
    rasterise(&view, &truth.vertices, truth_faces, &mut buffer);
    let tree = PointTree::new(posed);
    let around = template.topology().vertex_faces();
    let (mut visible, mut seen) = (0.0, 0usize);
    for p in &truth.vertices {
        let in_view = view.project(p).is_some_and(|[u, v, z]| {
            let (u, v) = (u.round(), v.round());
            let inside =
                u >= 0.0 && v >= 0.0 && u < buffer.width as f32 && v < buffer.height as f32;
            inside && z < buffer.depth[v as usize * buffer.width as usize + u as usize] + VISIBLE
        });
        if !in_view {
            continue;
        }
        let Some((k, _)) = tree.nearest(p, f32::INFINITY) else {
            return f64::NAN;
        };
        // The nearest point of the surface lies on a face of the nearest vertex, but for needles.
        let corners = |f: &u32| faces[*f as usize].map(|v| posed[v as usize]);
        let distances = around
            .row(k)
            .iter()
            .map(|f| distance_to_triangle(p, corners(f)));
        visible += f64::from(distances.fold(f32::INFINITY, f32::min)) * 1e3;
        seen += 1;
    }
    visible / seen as f64
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
    }
}
