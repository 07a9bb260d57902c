//! The pose: pairs, normal equations, solve, until nothing moves (eq. 12).

use super::kinematics::{LEVER, apply, linearise};
use super::model::TrackerModel;
use super::sleeve::hold;
use super::stand::{Ground, planted, stand};
use super::{Normals, TrackerConfig};
use crate::body::{BoneTransforms, JointMotion, Pose, RestBody};
use crate::math::{P3, V3};
use crate::registration::{
    ArticulatedSums, Association, Dof, EdgePairs, EdgeSide, GemanMcClure, Metric, ModelPoints,
    Pair, PairingConfig, PairingScratch, PairingStats, pair_edges, pair_surfaces, solve_damped,
};
use crate::segment::Contour;
use crate::spatial::{OrganisedCloud, PointTree};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// What the camera saw of the person.
pub(super) struct Seen<'a> {
    pub grid: &'a OrganisedCloud,
    pub cells: &'a [u32],
    pub contour: &'a Contour,
    pub tree: Option<&'a PointTree>,
}

/// Samples of the personalised rest body.
#[derive(Clone, Debug, Default)]
pub(super) struct SampleRest {
    pub positions: Vec<P3>,
    pub normals: Vec<V3>,
}

/// How one alignment goes about it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Schedule {
    pub iterations: usize,
    /// Iterations' worth of shrinking that are left out, because the start is good already.
    pub ahead: usize,
    /// Width of the robust kernel at the first and from the fifth iteration on, metres.
    pub sigma: [f64; 2],
    /// Longest pair at the first and from the fifth iteration on, metres.
    pub distance: [f32; 2],
    pub pull: f32,
}

/// What counts in an alignment, besides distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Terms {
    pub association: Association,
    /// Weight of edge-to-edge pairs.
    pub edge_weight: f64,
    /// Weight of the free-space constraint.
    pub free_space: f64,
    /// Multiplies the pull towards the rest pose.
    pub rest_weight: f64,
    /// The pull eases for what is seen.
    pub eased: bool,
    /// Feet out of view stand here.
    pub ground: Option<Ground>,
    /// Hands beyond sleeves without return, left and right.
    pub hands: [Option<Vector3<f64>>; 2],
}

/// From a rough start: windows skip readings whose normal does not fit instead of giving up on the nearest one, and
/// outlines and a stronger rest pose hold what is not yet near its place. On the real still, kd-tree pairs left the arm
/// on the hip and twisted the head; on converged poses they are the better ones (docs/benchmarks).
pub(super) const START_TERMS: Terms = Terms {
    association: Association::Projective,
    edge_weight: 0.3,
    free_space: 0.0,
    rest_weight: 1.0,
    eased: false,
    ground: None,
    hands: [None; 2],
};

impl Terms {
    /// From frame to frame, as configured.
    pub(super) fn tracking(config: &TrackerConfig) -> Self {
        Self {
            association: config.association,
            edge_weight: config.edge_weight,
            free_space: config.free_space,
            rest_weight: config.rest_weight,
            eased: true,
            ground: None,
            hands: [None; 2],
        }
    }
}

impl Default for Terms {
    fn default() -> Self {
        START_TERMS
    }
}

/// From frame to frame. The first reach is Table 1's 0.2 m less what prediction saves; the last is three times the
/// residual of a wrong body.
pub(super) const TRACK: Schedule = Schedule {
    iterations: 8,
    ahead: 0,
    sigma: [0.08, 0.03],
    distance: [0.12, 0.06],
    pull: 0.35,
};
/// From a rough start.
pub(super) const START: Schedule = Schedule {
    iterations: 20,
    ahead: 0,
    sigma: [0.15, 0.04],
    distance: [0.20, 0.08],
    pull: 0.5,
};

/// Iterations over which kernel and reach shrink.
pub(super) const ANNEAL: usize = 4;
/// A point that has moved by no more than this since it was paired keeps its reading, metres: a fifth of a cell.
const REUSE: f32 = 2e-3;
/// A reading without any model point near it, and a visible point without reading, count as this far off, metres.
const UNEXPLAINED: f64 = 0.10;

/// A degree of freedom with less data than this (per point, m²/rad²) counts as hidden; a shank in view has 7·10⁻⁴.
const HIDDEN: f64 = 1e-5;
/// With less data than this (per point, m²/rad²) the floor has a say in how a leg bends: a finger's breadth of a shank at
/// the rim of the picture. At 1·10⁻⁵ / 3·10⁻⁵ / 10⁻⁴ / 3·10⁻⁴ the waist-up sequence has 9.7 / 9.5 / 9.9 / 10.2 mm with its own
/// body, 15.4 / 14.9 / 14.5 / 14.3 with the template.
const BARELY_SEEN: f64 = 3e-5;
/// A hidden leg is pulled to the rest pose with this weight.
const HIDDEN_LEG_PULL: f64 = 2e-5;
/// The same while its foot is planted: a straight knee is no more likely then than a bent one. (With the full pull the
/// waist-up sequence has 9.0 instead of 7.8 mm with its own body.)
const PLANTED_LEG_PULL: f64 = 2e-6;
/// Width of the kernel for what stands in free space, metres: it may be far off.
const FREE_SIGMA: f64 = 0.10;
/// What stands before a reading goes back by at most this in one iteration, metres.
const FREE_STEP: f64 = 0.10;

/// How an alignment ended.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Fit {
    pub iterations: usize,
    pub converged: bool,
    /// Mean distance of pairs along the normal, metres, weighted by the kernel.
    pub residual: f64,
    /// Robust cost per point, m²; comparable between poses of one frame.
    pub cost: f64,
    /// Share of readings that the model explains, 0 to 1.
    pub explained: f64,
    /// Share of visible model points that found a reading, 0 to 1.
    pub matched: f64,
    pub pairs: PairingStats,
}

/// Scratch of the alignment.
#[derive(Default)]
pub(super) struct AlignScratch {
    /// What counts until further notice.
    pub terms: Terms,
    pub bones: BoneTransforms,
    pub positions: Vec<P3>,
    pub normals: Vec<V3>,
    pub pairing: PairingScratch,
    pub pairs: Vec<Pair>,
    pub edges: EdgePairs,
    pub dofs: Vec<Dof>,
    sums: ArticulatedSums,
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    damping: Vec<f64>,
    unseen: Vec<f64>,
}

impl AlignScratch {
    /// What the last normal equations know of one unknown, per point (priors included); 0 before there were any.
    pub(super) fn information(&self, unknown: usize) -> f64 {
        if unknown < self.hessian.nrows() {
            self.hessian[(unknown, unknown)]
        } else {
            0.0
        }
    }
    /// Share of an angle (0 to 1) that no reading held in the last normal equations.
    pub(super) fn unseen(&self, angle: usize) -> f64 {
        self.unseen.get(angle).copied().unwrap_or(0.0)
    }
    /// Pretends that nothing was seen of any of `angles` angles.
    #[cfg(test)]
    pub(super) fn hide_all(&mut self, angles: usize) {
        self.unseen = vec![1.0; angles];
    }
    /// Normal equations of nothing at `pose`, whose bones are known.
    #[cfg(test)]
    pub(super) fn blank(&mut self, model: &TrackerModel, pose: &Pose) {
        let centre = self.bones.joints[0].coords;
        linearise(
            model.template.skeleton(),
            &self.bones,
            pose,
            &centre,
            &mut self.dofs,
        );
        self.hessian = DMatrix::zeros(self.dofs.len(), self.dofs.len());
        self.gradient = DVector::zeros(self.dofs.len());
    }
    /// One damped step of the angles.
    #[cfg(test)]
    pub(super) fn follow(&mut self, model: &TrackerModel, pose: &mut Pose) {
        let mut damping = vec![1e-5; self.dofs.len()];
        damping[..6].fill(1e9);
        let x = solve_damped(&self.hessian, &self.gradient, &damping).expect("damped");
        let centre = self.bones.joints[0].coords;
        apply(model.template.skeleton(), pose, &centre, &x);
    }
    /// Adds `weight · (slopes · x − off)²` over the given angles to the normal equations.
    pub(super) fn add_row(&mut self, angles: &[usize], slopes: &[f64], off: f64, weight: f64) {
        for (&a, &sa) in angles.iter().zip(slopes) {
            self.gradient[6 + a] += weight * sa * off;
            for (&b, &sb) in angles.iter().zip(slopes) {
                self.hessian[(6 + a, 6 + b)] += weight * sa * sb;
            }
        }
    }
    /// Number of residuals of the current pairs.
    pub(super) fn residuals(&self) -> usize {
        let free = if self.terms.free_space > 0.0 {
            self.pairing.in_front.len()
        } else {
            0
        };
        self.pairs.len() + self.edges.pairs.len() + free
    }
}

/// Poses the samples: positions by all weights, normals by the dominant bone.
pub(super) fn skin_samples(model: &TrackerModel, rest: &SampleRest, scratch: &mut AlignScratch) {
    let m: Vec<(Matrix3<f32>, V3)> = scratch
        .bones
        .bones
        .iter()
        .map(|b| {
            (
                b.rotation.to_rotation_matrix().into_inner().cast::<f32>(),
                b.translation.vector.cast::<f32>(),
            )
        })
        .collect();
    scratch.positions.clear();
    scratch.normals.clear();
    for (i, p) in rest.positions.iter().enumerate() {
        let (joints, weights) = (&model.weights.joints[i], &model.weights.weights[i]);
        let mut sum = V3::zeros();
        for k in 0..4 {
            if weights[k] > 0.0 {
                let (r, t) = &m[usize::from(joints[k])];
                sum += (r * p.coords + t) * weights[k];
            }
        }
        scratch.positions.push(P3::from(sum));
        scratch
            .normals
            .push(m[usize::from(joints[0])].0 * rest.normals[i]);
    }
}

/// Poses the samples and pairs them with what was seen.
pub(super) fn pair(
    model: &TrackerModel,
    rest: (&RestBody, &SampleRest),
    pose: &Pose,
    seen: &Seen<'_>,
    distance: f32,
    pull: f32,
    scratch: &mut AlignScratch,
) -> PairingStats {
    pose.bones(model.template.skeleton(), rest.0, &mut scratch.bones);
    skin_samples(model, rest.1, scratch);
    let points = ModelPoints {
        positions: &scratch.positions,
        normals: &scratch.normals,
        bones: &model.bones,
        parents: &model.parents,
        spacing: model.spacing,
    };
    let config = PairingConfig {
        association: scratch.terms.association,
        distance,
        // Table 1: 60°.
        cos_normal: 0.5,
        pull: if model.config.pull { pull } else { 0.0 },
        data_step: model.config.data_step,
        reuse: if model.config.skip_converged {
            REUSE
        } else {
            0.0
        },
    };
    let false_edges = &seen.contour.false_edges;
    let stats = pair_surfaces(
        &points,
        seen.grid,
        seen.cells,
        false_edges,
        seen.tree,
        &config,
        &mut scratch.pairing,
        &mut scratch.pairs,
    );
    let terms = scratch.terms;
    if terms.edge_weight > 0.0 || terms.free_space > 0.0 {
        let edges = &seen.contour.true_edges;
        let side = if terms.edge_weight > 0.0 {
            EdgeSide::Outline
        } else {
            EdgeSide::Outside
        };
        pair_edges(
            &points,
            seen.grid,
            edges,
            &scratch.pairing.image,
            0.2,
            side,
            &mut scratch.edges,
        );
    } else {
        scratch.edges.pairs.clear();
    }
    stats
}

/// One residual with its metric and weight.
pub(super) struct Residual {
    pub sample: usize,
    pub bone: usize,
    pub point: Vector3<f64>,
    pub residual: Vector3<f64>,
    pub metric: Metric,
    pub weight: f64,
}

/// All residuals of the current pairs; returns (Σ weights, Σ weighted |normal residual|, Σ robust cost).
pub(super) fn for_residuals(
    model: &TrackerModel,
    seen: &Seen<'_>,
    scratch: &AlignScratch,
    sigma: f64,
    isotropic: f64,
    mut f: impl FnMut(&Residual),
) -> (f64, f64, f64) {
    let (mut total, mut off, mut cost) = (0.0, 0.0, 0.0);
    let config = &model.config;
    for pair in scratch
        .pairs
        .iter()
        .filter(|p| config.both_ways || !p.from_data)
    {
        let i = pair.model as usize;
        let p = scratch.positions[i].coords.cast::<f64>();
        let r = seen.grid.points[pair.cell as usize].coords.cast::<f64>() - p;
        let mut direction = scratch.normals[i].cast::<f64>();
        if config.normals == Normals::Symmetric {
            let both = direction + seen.grid.normals[pair.cell as usize].cast::<f64>();
            direction = both.try_normalize(f64::EPSILON).unwrap_or(direction);
        }
        let metric = Metric {
            isotropic,
            directional: config.point_to_plane,
            direction,
        };
        // A coarse pull is long by nature: the kernel widens with it so that it is not taken for an outlier.
        let far = r.norm() > 0.12;
        let kernel = GemanMcClure {
            sigma: if far { sigma.max(0.12) } else { sigma },
        };
        let e2 = r.norm_squared();
        let weight = if config.robust {
            kernel.weight(e2)
        } else {
            1.0
        };
        cost += kernel.value(e2).min(UNEXPLAINED * UNEXPLAINED);
        total += weight;
        off += weight * direction.dot(&r).abs();
        f(&Residual {
            sample: i,
            bone: usize::from(model.bones[i]),
            point: p,
            residual: r,
            metric,
            weight,
        });
    }
    for &(i, cell) in &scratch.edges.pairs {
        let i = i as usize;
        let p = scratch.positions[i].coords.cast::<f64>();
        let ray = seen.grid.points[cell as usize]
            .coords
            .cast::<f64>()
            .normalize();
        let r = ray * ray.dot(&p) - p;
        let metric = Metric {
            isotropic: 1.0,
            directional: -1.0,
            direction: ray,
        };
        let weight = scratch.terms.edge_weight.max(scratch.terms.free_space);
        let weight = weight
            * GemanMcClure {
                sigma: sigma.max(FREE_SIGMA),
            }
            .weight(r.norm_squared());
        f(&Residual {
            sample: i,
            bone: usize::from(model.bones[i]),
            point: p,
            residual: r,
            metric,
            weight,
        });
    }
    if scratch.terms.free_space > 0.0 {
        for &(i, cell) in &scratch.pairing.in_front {
            let i = i as usize;
            let p = scratch.positions[i].coords.cast::<f64>();
            let ray = p.normalize();
            // Back along the ray to what was measured there, a little at a time.
            let behind = f64::from(seen.grid.depth[cell as usize]) / ray.z - p.norm();
            let r = ray * behind.clamp(0.0, FREE_STEP);
            let metric = Metric {
                isotropic: 0.0,
                directional: 1.0,
                direction: ray,
            };
            let weight = scratch.terms.free_space;
            f(&Residual {
                sample: i,
                bone: usize::from(model.bones[i]),
                point: p,
                residual: r,
                metric,
                weight,
            });
        }
    }
    (total, off, cost)
}

/// Cost of a pose as it is, for choosing between poses.
pub(super) fn evaluate(
    model: &TrackerModel,
    rest: (&RestBody, &SampleRest),
    pose: &Pose,
    seen: &Seen<'_>,
    distance: f32,
    scratch: &mut AlignScratch,
) -> Fit {
    let stats = pair(model, rest, pose, seen, distance, 0.0, scratch);
    let sums = for_residuals(
        model,
        seen,
        scratch,
        0.05,
        model.config.point_to_point,
        |_| {},
    );
    summary(stats, sums, 0)
}

fn summary(stats: PairingStats, (total, off, cost): (f64, f64, f64), iterations: usize) -> Fit {
    let judged = stats.visible - stats.unknown;
    let missing = (stats.readings - stats.explained) + (judged - stats.from_model);
    let all = (stats.readings + judged).max(1) as f64;
    Fit {
        iterations,
        converged: false,
        residual: if total > 0.0 { off / total } else { 0.0 },
        cost: (cost + missing as f64 * UNEXPLAINED * UNEXPLAINED) / all,
        explained: stats.explained as f64 / stats.readings.max(1) as f64,
        matched: stats.from_model as f64 / judged.max(1) as f64,
        pairs: stats,
    }
}

/// Gauss–Newton with damping, limits and a weak pull to the rest pose, from `pose` on.
pub(super) fn align(
    model: &TrackerModel,
    rest: (&RestBody, &SampleRest),
    pose: &mut Pose,
    seen: &Seen<'_>,
    schedule: &Schedule,
    scratch: &mut AlignScratch,
) -> Fit {
    let mut fit = Fit::default();
    for iteration in 0..schedule.iterations {
        let t = ((iteration + schedule.ahead) as f64 / ANNEAL as f64).min(1.0);
        let sigma = schedule.sigma[0] + (schedule.sigma[1] - schedule.sigma[0]) * t;
        let distance =
            schedule.distance[0] + (schedule.distance[1] - schedule.distance[0]) * t as f32;
        let pull = if t < 1.0 { schedule.pull } else { 0.0 };
        let stats = pair(model, rest, pose, seen, distance, pull, scratch);
        let sums = assemble(
            model,
            pose,
            seen,
            sigma,
            model.config.point_to_point,
            scratch,
        );
        fit = summary(stats, sums, iteration + 1);
        if sums.0 < 1.0 {
            break;
        }
        let Some(x) = solve_damped(&scratch.hessian, &scratch.gradient, &scratch.damping) else {
            break;
        };
        let centre = scratch.bones.joints[0].coords;
        apply(model.template.skeleton(), pose, &centre, &x);
        limit(model, pose);
        let step = x
            .iter()
            .enumerate()
            .map(|(k, v)| if k < 3 { v.abs() } else { v.abs() * LEVER })
            .fold(0.0, f64::max);
        if t >= 1.0 && step < model.config.converged {
            fit.converged = true;
            break;
        }
    }
    fit
}

/// Moves joints back into their limits, where those count.
pub(super) fn limit(model: &TrackerModel, pose: &mut Pose) {
    if model.config.joint_limits {
        pose.clamp_to_limits(model.template.skeleton());
    }
}

/// Fills the normal equations of the pose, per point, priors included.
fn assemble(
    model: &TrackerModel,
    pose: &Pose,
    seen: &Seen<'_>,
    sigma: f64,
    isotropic: f64,
    scratch: &mut AlignScratch,
) -> (f64, f64, f64) {
    let skeleton = model.template.skeleton();
    let centre = scratch.bones.joints[0].coords;
    let mut sums = std::mem::take(&mut scratch.sums);
    sums.reset(model.parents.len());
    let single = model.config.single_precision;
    let totals = for_residuals(model, seen, scratch, sigma, isotropic, |r| {
        let p = r.point - centre;
        if single {
            sums.single[r.bone].add(
                &p.cast(),
                &r.residual.cast(),
                &r.metric.cast(),
                r.weight as f32,
            );
        } else {
            sums.bones[r.bone].add(&p, &r.residual, &r.metric, r.weight);
        }
    });
    let mut dofs = std::mem::take(&mut scratch.dofs);
    linearise(skeleton, &scratch.bones, pose, &centre, &mut dofs);
    sums.assemble(
        &model.parents,
        &dofs,
        &mut scratch.hessian,
        &mut scratch.gradient,
    );
    scratch.dofs = dofs;
    scratch.sums = sums;
    let scale = 1.0 / scratch.residuals().max(1) as f64;
    scratch.hessian *= scale;
    scratch.gradient *= scale;
    scratch.damping.clear();
    scratch
        .damping
        .resize(scratch.gradient.len(), model.config.damping);
    let stays = planted(model, seen.grid, scratch);
    let leg_pull = |k: usize| {
        let of = |(leg, stays): (&super::stand::Leg, bool)| stays && leg.moves(k);
        if model.standing.iter().zip(stays).any(of) {
            PLANTED_LEG_PULL
        } else {
            HIDDEN_LEG_PULL
        }
    };
    let mut hidden = std::mem::take(&mut scratch.unseen);
    hidden.clear();
    for (k, (&stiff, &angle)) in model.stiffness.iter().zip(&pose.angles).enumerate() {
        // Whatever is seen of a joint outweighs the rest pose at once; a hidden leg stands.
        let unseen = (HIDDEN / (HIDDEN + scratch.hessian[(6 + k, 6 + k)])).powi(2);
        hidden.push((BARELY_SEEN / (BARELY_SEEN + scratch.hessian[(6 + k, 6 + k)])).powi(2));
        let seen_share = if scratch.terms.eased {
            model.seen_shares[k]
        } else {
            1.0
        };
        let share = seen_share + (1.0 - seen_share) * unseen;
        let stiff = stiff * scratch.terms.rest_weight * share
            + if model.below_knee[k] {
                leg_pull(k) * unseen
            } else {
                0.0
            };
        scratch.hessian[(6 + k, 6 + k)] += stiff;
        scratch.gradient[6 + k] -= stiff * angle;
    }
    if let Some(ground) = &scratch.terms.ground.clone() {
        stand(model, seen.grid, ground, &hidden, stays, scratch);
    }
    scratch.unseen = hidden;
    hold(model, scratch);
    totals
}

/// The normal equations that the last [`pair`] and [`assemble`] gave, undamped: (H, g), per point.
pub(super) fn normal_equations(
    model: &TrackerModel,
    pose: &Pose,
    seen: &Seen<'_>,
    sigma: f64,
    isotropic: f64,
    scratch: &mut AlignScratch,
) -> (DMatrix<f64>, DVector<f64>) {
    assemble(model, pose, seen, sigma, isotropic, scratch);
    (scratch.hessian.clone(), scratch.gradient.clone())
}

/// Turns a ball joint so that the bone to `child` points along `direction` (rest frame of its parent), and then by
/// `twist` radians about it.
pub(super) fn aim(
    model: &TrackerModel,
    pose: &mut Pose,
    joint: &str,
    child: &str,
    direction: Vector3<f64>,
    twist: f64,
) {
    let skeleton = model.template.skeleton();
    let (Some(j), Some(c)) = (skeleton.index(joint), skeleton.index(child)) else {
        return;
    };
    if !matches!(skeleton.joints()[j].motion, JointMotion::Ball { .. }) {
        return;
    }
    let along = skeleton.joints()[c].rest - skeleton.joints()[j].rest;
    if let Some(turn) = nalgebra::UnitQuaternion::rotation_between(&along, &direction) {
        let about = nalgebra::UnitQuaternion::from_scaled_axis(direction * twist);
        pose.set(
            skeleton,
            joint,
            crate::math::log_so3(&(about * turn)).as_slice(),
        );
    }
}

/// Whether a tree over the readings is needed.
pub(super) fn wants_tree(model: &TrackerModel) -> bool {
    model.config.association == Association::KdTree
}
