//! Body size and shape: scales of bones (eq. 18 to 23) and coefficients of the shape space in one linear system.
//!
//! The paper solves for scales alone at a fixed pose. Here pose and size are linearised together and the pose is
//! eliminated (Schur complement), so that what a frame says about size counts only as far as no pose explains it; the
//! information of the first frames adds up and the prior decides the rest.

use super::align::{AlignScratch, SampleRest, Seen, for_residuals, normal_equations, pair};
use super::model::TrackerModel;
use crate::body::{BodyShape, Pose, RestBody};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3, Vector6};
use serde::{Deserialize, Serialize};

/// What the frames so far say about size and shape.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SizeEstimate {
    /// Frames that were used.
    pub frames: u32,
    /// Sum of the faded weights of the frames.
    weight: f64,
    /// Σ of Schur complements, per point, shape `[directions × directions]`; empty before the first frame.
    information: Vec<f64>,
    /// Σ of information × (estimate of the frame), shape `[directions]`.
    evidence: Vec<f64>,
}

/// Weight λₛ of eq. 23, per point, m²: bones tied by symmetry differ by a tenth of what single ones do.
const TIE: f64 = 5e-3;
/// Largest coefficient, standard deviations.
const MOST_DEVIATIONS: f64 = 3.0;
/// Bounds of a bone's scale.
const SCALES: [f64; 2] = [0.7, 1.4];
/// Longest pair used for size and kernel width, metres: while pose and size still look for each other, and later. Feet
/// of a body of the wrong stature start a hand's width away.
const START: (f32, f64) = (0.15, 0.08);
const LATER: (f32, f64) = (0.08, 0.04);
/// Frames over which size looks farther.
const SEARCHING: u32 = 20;
/// Point-to-point weight: sizes must slide along limbs, so it is a fifth of the pose's.
const POINT_TO_POINT: f64 = 0.02;
/// What earlier frames said fades by this factor a frame: their pairs belonged to a body not yet adapted.
const FADE: f64 = 0.95;

impl SizeEstimate {
    /// Takes in one converged frame and updates `shape`. Returns the largest change of a coefficient or of ten times a
    /// scale.
    pub(super) fn observe(
        &mut self,
        model: &TrackerModel,
        rest: (&RestBody, &SampleRest),
        pose: &Pose,
        seen: &Seen<'_>,
        shape: &mut BodyShape,
        scratch: &mut AlignScratch,
        keep: bool,
    ) -> f64 {
        let n = model.directions.len();
        if n == 0 {
            return 0.0;
        }
        let (reach, sigma) = if keep && self.frames >= SEARCHING {
            LATER
        } else {
            START
        };
        pair(model, rest, pose, seen, reach, 0.0, scratch);
        let Some((information, gradient)) = frame_information(model, pose, seen, sigma, scratch)
        else {
            return 0.0;
        };
        let now = current(model, shape);
        let evidence = &information * &now + gradient;
        let mut total = information;
        let mut sum = evidence;
        if self.information.len() == n * n {
            total += DMatrix::from_column_slice(n, n, &self.information) * FADE;
            sum += DVector::from_column_slice(&self.evidence) * FADE;
        }
        let frames = 1.0 + FADE * self.weight;
        let Some(next) = solve(model, &total / frames, &sum / frames) else {
            return 0.0;
        };
        if keep {
            self.frames += 1;
            self.weight = frames;
            self.information = total.as_slice().to_vec();
            self.evidence = sum.as_slice().to_vec();
        }
        store(model, &next, shape);
        (0..n)
            .map(|d| {
                (next[d] - now[d]).abs()
                    * if model.directions[d].bone.is_some() {
                        10.0
                    } else {
                        1.0
                    }
            })
            .fold(0.0, f64::max)
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
fn solve(model: &TrackerModel, mut h: DMatrix<f64>, g: DVector<f64>) -> Option<DVector<f64>> {
    let has_space = model.directions.iter().any(|d| d.bone.is_none());
    let deviation = model.config.scale_deviation[usize::from(!has_space)];
    let prior = model.config.shape_prior;
    for (d, direction) in model.directions.iter().enumerate() {
        h[(d, d)] += if direction.bone.is_some() {
            prior / (deviation * deviation)
        } else {
            prior
        };
    }
    for &(a, b, weight) in &model.tied {
        let w = TIE * weight;
        h[(a, a)] += w;
        h[(b, b)] += w;
        h[(a, b)] -= w;
        h[(b, a)] -= w;
    }
    let x = h.cholesky()?.solve(&g);
    x.iter().all(|v| v.is_finite()).then_some(x)
}

/// What one frame says about size once the pose is eliminated: (information, gradient), per point.
fn frame_information(
    model: &TrackerModel,
    pose: &Pose,
    seen: &Seen<'_>,
    sigma: f64,
    scratch: &mut AlignScratch,
) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let (hpp, gp) = normal_equations(model, pose, seen, sigma, POINT_TO_POINT, scratch);
    let n = model.directions.len();
    let bones = &scratch.bones.bones;
    let centre = scratch.bones.joints[0].coords;
    let rotations: Vec<_> = bones
        .iter()
        .map(|b| b.rotation.to_rotation_matrix().into_inner())
        .collect();
    // How each bone shifts per unit of each direction: dg_b − R_b dp_b.
    let mut shifts = vec![Vector3::zeros(); n * bones.len()];
    for (d, direction) in model.directions.iter().enumerate() {
        let mut joint = vec![Vector3::zeros(); bones.len()];
        for b in 0..bones.len() {
            let dp = direction.joints[b];
            joint[b] = match model.parents[b] {
                None => pose.root.iso().rotation * dp,
                Some(p) => joint[p] + rotations[p] * (dp - direction.joints[p]),
            };
            shifts[d * bones.len() + b] = joint[b] - rotations[b] * dp;
        }
    }
    let mut hss = DMatrix::<f64>::zeros(n, n);
    let mut gs = DVector::<f64>::zeros(n);
    let mut hbs = vec![Vector6::zeros(); n * bones.len()];
    // A sample has several residuals, but moves in one way only: their metrics add up first.
    let mut sums: Vec<(Matrix3<f64>, Vector3<f64>)> = vec![Default::default(); model.samples.len()];
    let mut paired: Vec<(usize, usize, Vector3<f64>)> = Vec::new();
    let mut known = vec![false; model.samples.len()];
    for_residuals(model, seen, scratch, sigma, POINT_TO_POINT, |r| {
        let (metric, pull) = &mut sums[r.sample];
        *metric += r.metric.matrix() * r.weight;
        *pull += r.metric.apply(&r.residual) * r.weight;
        if !std::mem::replace(&mut known[r.sample], true) {
            paired.push((r.sample, r.bone, r.point - centre));
        }
    });
    let mut moves = vec![Vector3::zeros(); n];
    let mut weighed = vec![Vector3::zeros(); n];
    for &(sample, bone, p) in &paired {
        let (metric, pull) = &sums[sample];
        for d in 0..n {
            let offset = model.directions[d].samples[sample].cast::<f64>();
            moves[d] = shifts[d * bones.len() + bone] + rotations[bone] * offset;
            let m = metric * moves[d];
            let t = p.cross(&m);
            hbs[d * bones.len() + bone] += Vector6::new(m.x, m.y, m.z, t.x, t.y, t.z);
            gs[d] += moves[d].dot(pull);
            weighed[d] = m;
        }
        for d in 0..n {
            for e in 0..=d {
                hss[(d, e)] += weighed[d].dot(&moves[e]);
            }
        }
    }
    for d in 0..n {
        for e in 0..d {
            hss[(e, d)] = hss[(d, e)];
        }
    }
    let scale = 1.0 / scratch.residuals().max(1) as f64;
    for d in 0..n {
        for b in (1..bones.len()).rev() {
            if let Some(p) = model.parents[b] {
                let below = hbs[d * bones.len() + b];
                hbs[d * bones.len() + p] += below;
            }
        }
    }
    let hps = DMatrix::from_fn(scratch.dofs.len(), n, |k, d| {
        let dof = &scratch.dofs[k];
        let h = &hbs[d * bones.len() + dof.bone];
        let (v, w) = (dof.twist.linear, dof.twist.angular);
        scale * (v.x * h[0] + v.y * h[1] + v.z * h[2] + w.x * h[3] + w.y * h[4] + w.z * h[5])
    });
    let mut pp = hpp;
    for k in 0..pp.nrows() {
        // Keeps unobserved angles from swallowing everything; far below any observed one.
        pp[(k, k)] += 1e-7;
    }
    let factor = pp.cholesky()?;
    let reduced = hss * scale - hps.transpose() * factor.solve(&hps);
    let gradient = gs * scale - hps.transpose() * factor.solve(&gp);
    gradient
        .iter()
        .chain(reduced.iter())
        .all(|v| v.is_finite())
        .then_some((reduced, gradient))
}

/// The most likely shape of a person of this stature (metres from sole to crown): along the shape space if there is
/// one, else all bones alike.
pub(super) fn from_stature(model: &TrackerModel, stature: f64) -> BodyShape {
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
