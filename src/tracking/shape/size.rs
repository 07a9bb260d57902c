//! Body size and shape: scales of bones (eq. 18 to 23) and coefficients of the shape space in one linear system.
//!
//! The paper solves for scales alone at a fixed pose. Here pose and size are linearised together and the pose is
//! eliminated (Schur complement): a frame informs size only as far as no pose explains its readings. Information adds up
//! over the views of the body; the prior decides the rest.

use super::view_information::{SizeInformation, SizeView, ViewInformation};
use crate::fit::{FitContext, FitScratch, assemble, for_each_point, pair};
use crate::model::TrackerModel;
use crate::settings::BodySizeSettings;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3, Vector6};
use serde::{Deserialize, Serialize};
use tryon_body::measure::measure;
use tryon_body::{BodyShape, Pose, RestBody};

/// Accumulated information on size and shape.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SizeEstimate {
    /// Frames used so far.
    pub frames: u32,
    /// Schur complements of the frames by view.
    views: ViewInformation,
    /// Girths of chest, natural waist and hip when they were last compared, metres.
    #[serde(default)]
    girths: Option<[f64; 3]>,
    /// They changed less than `settled_girth` over `settling_frames`.
    #[serde(default)]
    pub(crate) is_settled: bool,
}

/// Largest coefficient, standard deviations: a child is eight below the mean of adults.
pub(crate) const MOST_DEVIATIONS: f64 = 8.0;
/// Bounds of a bone's scale.
pub(crate) const SCALES: [f64; 2] = [0.5, 1.4];

impl SizeEstimate {
    /// Estimate of a size that was measured before, over `frames` frames: it does not change.
    pub(crate) fn known(frames: u32) -> Self {
        Self {
            frames: frames.max(1),
            views: ViewInformation::closed(),
            is_settled: true,
            ..Self::default()
        }
    }

    /// Adds one converged frame and updates `shape`; without `keep` the estimate itself stays. Returns the largest change
    /// of a coefficient or of ten times a scale.
    pub(crate) fn observe(
        &mut self,
        context: &FitContext<'_>,
        pose: &Pose,
        shape: &mut BodyShape,
        scratch: &mut FitScratch,
        keep: bool,
    ) -> f64 {
        let settings = &context.model.config.shape.size;
        let model = context.model;
        let n = model.directions.len();
        if n == 0 {
            return 0.0;
        }
        let (reach, sigma) = if keep && self.frames >= settings.searching {
            (settings.later_reach, settings.later_sigma)
        } else {
            (settings.first_reach, settings.first_sigma)
        };
        pair(context, pose, reach, 0.0, scratch);
        let Some((information, gradient)) = frame_information(context, pose, sigma, scratch) else {
            return 0.0;
        };
        let now = current(model, shape);
        let evidence = &information * &now + gradient;
        let frame = SizeInformation {
            information,
            evidence,
        };
        let view = SizeView::of(pose, &scratch.centre());
        let total = self.views.with(view, frame, settings.fade, keep);
        let Some(next) = solve(model, total) else {
            return 0.0;
        };
        self.frames += u32::from(keep);
        store(model, &next, shape);
        (0..n)
            .map(|d| {
                let is_scale = model.directions[d].bone.is_some();
                (next[d] - now[d]).abs() * if is_scale { settings.scale_change } else { 1.0 }
            })
            .fold(0.0, f64::max)
    }

    /// True while frames of the view in which a pose shows the body add to what is known.
    pub(crate) fn is_view_open(
        &self,
        pose: &Pose,
        root: &Vector3<f64>,
        settings: &BodySizeSettings,
    ) -> bool {
        self.views.frames(SizeView::of(pose, root)) < settings.view_frames
    }

    /// Information of all frames so far and of the prior, per point, shape `[directions × directions]`; `None` before the
    /// first frame.
    pub(super) fn precision(&self, model: &TrackerModel) -> Option<DMatrix<f64>> {
        let data = self.views.total(model.directions.len())?;
        Some(with_prior(model, data.information))
    }

    /// Compares the girths of the `rest` body with those of half a second before; to be called after each new frame.
    pub(crate) fn check_settled(&mut self, model: &TrackerModel, rest: &RestBody) {
        let settings = &model.config.shape.size;
        if !self.frames.is_multiple_of(settings.settling_frames) {
            return;
        }
        let girths = measure(&model.template, rest).map(|m| [m.chest, m.natural_waist, m.hip]);
        let before = std::mem::replace(&mut self.girths, girths.ok());
        let pairs = before.zip(self.girths);
        self.is_settled |= pairs.is_some_and(|(before, now)| {
            let changes = before.iter().zip(now).map(|(a, b)| (a - b).abs());
            changes.fold(0.0, f64::max) < settings.settled_girth
        });
    }
}

/// Coefficients and scales − 1 as one vector.
fn current(model: &TrackerModel, shape: &BodyShape) -> DVector<f64> {
    DVector::from_iterator(
        model.directions.len(),
        model
            .directions
            .iter()
            .enumerate()
            .map(|(d, direction)| match direction.bone {
                None => shape.coefficients.get(d).copied().unwrap_or(0.0),
                Some(j) => shape.bone_scales.get(j).copied().unwrap_or(1.0) - 1.0,
            }),
    )
}

/// Writes a vector of [`current`]'s form into a shape, within bounds.
fn store(model: &TrackerModel, x: &DVector<f64>, shape: &mut BodyShape) {
    let coefficients = model.directions.iter().filter(|d| d.bone.is_none()).count();
    shape.coefficients.resize(coefficients, 0.0);
    shape.bone_scales.resize(model.parents.len(), 1.0);
    for (d, direction) in model.directions.iter().enumerate() {
        match direction.bone {
            None => shape.coefficients[d] = x[d].clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS),
            Some(j) => shape.bone_scales[j] = (1.0 + x[d]).clamp(SCALES[0], SCALES[1]),
        }
    }
}

/// Data and prior: (Λ + P) x = η, with eq. 23 in P.
fn solve(model: &TrackerModel, data: SizeInformation) -> Option<DVector<f64>> {
    let h = with_prior(model, data.information);
    let x = h.cholesky()?.solve(&data.evidence);
    x.iter().all(|v| v.is_finite()).then_some(x)
}

/// Λ + P.
fn with_prior(model: &TrackerModel, mut h: DMatrix<f64>) -> DMatrix<f64> {
    let settings = &model.config.shape.size;
    let has_space = model.directions.iter().any(|d| d.bone.is_none());
    let deviation = settings.scale_deviations[usize::from(!has_space)];
    for (d, direction) in model.directions.iter().enumerate() {
        h[(d, d)] += if direction.bone.is_some() {
            settings.prior / (deviation * deviation)
        } else {
            settings.prior
        };
    }
    for &(a, b, weight) in &model.tied {
        let w = settings.tie * weight;
        h[(a, a)] += w;
        h[(b, b)] += w;
        h[(a, b)] -= w;
        h[(b, a)] -= w;
    }
    h
}

/// Motion of the posed body per unit of each direction of size.
struct SizeMotion<'a> {
    model: &'a TrackerModel,
    /// Rotation of each bone.
    rotations: Vec<Matrix3<f64>>,
    /// Displacement of each bone per unit of a direction, metres, shape `[directions × bones]`.
    shifts: Vec<Vector3<f64>>,
}

impl<'a> SizeMotion<'a> {
    /// dg_b − R_b dp_b for each bone b and direction, with the joints moved along the chain.
    fn new(model: &'a TrackerModel, pose: &Pose, scratch: &FitScratch) -> Self {
        let rotation = |b: &nalgebra::Isometry3<f64>| b.rotation.to_rotation_matrix().into_inner();
        let rotations: Vec<_> = scratch.bones.bones.iter().map(rotation).collect();
        let bones = rotations.len();
        let mut shifts = vec![Vector3::zeros(); model.directions.len() * bones];
        for (d, direction) in model.directions.iter().enumerate() {
            let mut joint = vec![Vector3::zeros(); bones];
            for b in 0..bones {
                let dp = direction.joints[b];
                joint[b] = match model.parents[b] {
                    None => pose.root.iso().rotation * dp,
                    Some(p) => joint[p] + rotations[p] * (dp - direction.joints[p]),
                };
                shifts[d * bones + b] = joint[b] - rotations[b] * dp;
            }
        }
        Self {
            model,
            rotations,
            shifts,
        }
    }

    /// Displacement of a sample on a bone per unit of direction `d`, metres.
    fn displacement(&self, d: usize, sample: usize, bone: usize) -> Vector3<f64> {
        let offset = self.model.directions[d].samples[sample].cast::<f64>();
        self.shifts[d * self.rotations.len() + bone] + self.rotations[bone] * offset
    }
}

/// Sample with all its residuals: a sample has several, but one displacement, so their metrics add up first.
struct PairedSample {
    sample: usize,
    bone: usize,
    /// Position about the root joint, metres.
    point: Vector3<f64>,
    /// Σ w M.
    metric: Matrix3<f64>,
    /// Σ w M r.
    pull: Vector3<f64>,
}

/// Samples of the current pairs in the order of their first residual.
fn paired_samples(context: &FitContext<'_>, scratch: &FitScratch, sigma: f64) -> Vec<PairedSample> {
    let settings = &context.model.config.shape.size;
    let centre = scratch.centre();
    let mut index = vec![usize::MAX; context.model.samples.len()];
    let mut out: Vec<PairedSample> = Vec::new();
    for_each_point(context, scratch, sigma, settings.point_to_point, |term| {
        let at = &mut index[term.sample];
        if *at == usize::MAX {
            *at = out.len();
            out.push(PairedSample {
                sample: term.sample,
                bone: term.bone,
                point: term.point - centre,
                metric: Matrix3::zeros(),
                pull: Vector3::zeros(),
            });
        }
        let sample = &mut out[*at];
        sample.metric += term.metric.matrix() * term.weight;
        sample.pull += term.metric.apply(&term.residual) * term.weight;
    });
    out
}

/// Normal equations of size and their coupling with the pose, summed over points.
struct SizeEquations {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Coupling with the twist of each bone and all below, shape `[directions × bones]`.
    coupling: Vec<Vector6<f64>>,
}

impl SizeEquations {
    fn new(motion: &SizeMotion<'_>, samples: &[PairedSample]) -> Self {
        let (n, bones) = (motion.model.directions.len(), motion.rotations.len());
        let mut hessian = DMatrix::<f64>::zeros(n, n);
        let mut gradient = DVector::<f64>::zeros(n);
        let mut coupling = vec![Vector6::zeros(); n * bones];
        let mut moves = vec![Vector3::zeros(); n];
        let mut weighted = vec![Vector3::zeros(); n];
        for s in samples {
            for d in 0..n {
                moves[d] = motion.displacement(d, s.sample, s.bone);
                let m = s.metric * moves[d];
                let t = s.point.cross(&m);
                coupling[d * bones + s.bone] += Vector6::new(m.x, m.y, m.z, t.x, t.y, t.z);
                gradient[d] += moves[d].dot(&s.pull);
                weighted[d] = m;
            }
            for d in 0..n {
                for e in 0..=d {
                    hessian[(d, e)] += weighted[d].dot(&moves[e]);
                }
            }
        }
        hessian.fill_upper_triangle_with_lower_triangle();
        for d in 0..n {
            for b in (1..bones).rev() {
                if let Some(p) = motion.model.parents[b] {
                    let below = coupling[d * bones + b];
                    coupling[d * bones + p] += below;
                }
            }
        }
        Self {
            hessian,
            gradient,
            coupling,
        }
    }
}

/// Information and gradient of one frame on size with the pose eliminated, per point.
fn frame_information(
    context: &FitContext<'_>,
    pose: &Pose,
    sigma: f64,
    scratch: &mut FitScratch,
) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let settings = &context.model.config.shape.size;
    assemble(context, pose, sigma, settings.point_to_point, scratch);
    let motion = SizeMotion::new(context.model, pose, scratch);
    let samples = paired_samples(context, scratch, sigma);
    let size = SizeEquations::new(&motion, &samples);
    let scale = 1.0 / scratch.residuals().max(1) as f64;
    let (n, bones) = (context.model.directions.len(), motion.rotations.len());
    let mixed = DMatrix::from_fn(scratch.dofs.len(), n, |k, d| {
        let dof = &scratch.dofs[k];
        let h = &size.coupling[d * bones + dof.bone];
        let (v, w) = (dof.twist.linear, dof.twist.angular);
        scale * (v.x * h[0] + v.y * h[1] + v.z * h[2] + w.x * h[3] + w.y * h[4] + w.z * h[5])
    });
    let mut pose_hessian = scratch.equations.hessian.clone();
    for k in 0..pose_hessian.nrows() {
        pose_hessian[(k, k)] += settings.pose_ridge;
    }
    let factor = pose_hessian.cholesky()?;
    let pose_gradient = &scratch.equations.gradient;
    let reduced = size.hessian * scale - mixed.transpose() * factor.solve(&mixed);
    let gradient = size.gradient * scale - mixed.transpose() * factor.solve(pose_gradient);
    gradient
        .iter()
        .chain(reduced.iter())
        .all(|v| v.is_finite())
        .then_some((reduced, gradient))
}

/// Shapes for a first pose of somebody this tall, metres, `known` where that isn't seen or is no stature: a child, or an adult
/// who crouches.
pub(crate) fn first_shapes(
    model: &TrackerModel,
    stature: Option<f64>,
    known: &BodyShape,
) -> Vec<BodyShape> {
    let sized = |s: f64| from_stature(model, s);
    let settings = &model.config.shape.size;
    let [least, most] = settings.adults;
    match stature {
        Some(s) if (least..most).contains(&s) => vec![sized(s)],
        Some(s) if (settings.least_child..least).contains(&s) => vec![known.clone(), sized(s)],
        _ => vec![known.clone()],
    }
}

/// Most likely shape of a stature (metres from sole to crown): along the shape space if there is one, else all bones
/// alike.
fn from_stature(model: &TrackerModel, stature: f64) -> BodyShape {
    let template = &model.template;
    let Some((lo, hi)) = template.mesh().bounds() else {
        return BodyShape::default();
    };
    let own = f64::from(hi.y - lo.y);
    let wanted = stature.clamp(SCALES[0] * own, SCALES[1] * own);
    let mut shape = BodyShape::default();
    let vertices = template.mesh().vertices();
    let extreme = |sign: f32| {
        (0..vertices.len())
            .max_by(|&a, &b| (sign * vertices[a].y).total_cmp(&(sign * vertices[b].y)))
    };
    let gain: Vec<f64> = match (template.shape_space(), extreme(1.0), extreme(-1.0)) {
        (Some(space), Some(top), Some(sole)) => space
            .vertices
            .iter()
            .map(|v| f64::from(v[top].y - v[sole].y))
            .collect(),
        _ => Vec::new(),
    };
    let total: f64 = gain.iter().map(|g| g * g).sum();
    if total > f64::EPSILON {
        let factor = (wanted - own) / total;
        shape.coefficients = gain
            .iter()
            .map(|g| (g * factor).clamp(-MOST_DEVIATIONS, MOST_DEVIATIONS))
            .collect();
    } else {
        shape.bone_scales = vec![wanted / own; model.parents.len()];
    }
    shape
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::TestScene;

    #[test]
    fn the_size_settles_once_girths_stay_for_half_a_second() {
        let model = TestScene::new(50, 480).model;
        let frames = model.config.shape.size.settling_frames;
        let body = |weight: f64| {
            model.template.personalise(&BodyShape {
                coefficients: vec![0.0, weight],
                ..BodyShape::default()
            })
        };
        let mut size = SizeEstimate::default();
        let mut settled = Vec::new();
        for frame in 1..=4 * frames {
            size.frames = frame;
            // Girths move until the thirtieth frame.
            size.check_settled(&model, &body(f64::from(frame.min(30)) * 0.05));
            if size.is_settled {
                settled.push(frame);
            }
        }
        assert_eq!(settled.first(), Some(&(3 * frames)));
        // It never becomes unsettled again.
        assert_eq!(settled.len() as u32, frames + 1);
    }

    #[test]
    fn a_known_size_takes_no_more_frames() {
        let model = TestScene::new(50, 480).model;
        let settings = &model.config.shape.size;
        let pose = TestScene::new(50, 480).pose;
        let root = pose.root.iso().translation.vector;
        let is_open = |size: SizeEstimate| size.is_view_open(&pose, &root, settings);
        assert!(is_open(SizeEstimate::default()));
        assert!(!is_open(SizeEstimate::known(60)));
    }

    #[test]
    fn a_small_person_may_be_a_child_of_that_stature_or_crouch() {
        let model = TestScene::new(200, 480).model;
        let known = BodyShape {
            coefficients: vec![0.5],
            ..BodyShape::default()
        };
        let shapes = |s| first_shapes(&model, s, &known);
        let same = vec![known.clone()];
        assert_eq!(shapes(None), same);
        assert_eq!(shapes(Some(0.5)), same, "a bag has no stature");
        for (stature, count) in [(1.0, 2), (1.2, 2), (1.5, 1), (2.0, 1)] {
            let shapes = shapes(Some(stature));
            assert_eq!(shapes.len(), count, "{stature} m");
            assert!(count == 1 || shapes[0] == known);
            let heights = model.template.personalise(&shapes[count - 1]).vertices;
            let heights = heights.iter().map(|p| f64::from(p.y));
            let (lo, hi) = heights.fold((f64::MAX, f64::MIN), |(l, h), y| (l.min(y), h.max(y)));
            assert!(
                (hi - lo - stature).abs() < 0.02,
                "{} for {stature} m",
                hi - lo
            );
        }
    }
}
