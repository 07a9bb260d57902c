//! Correspondences and normal equations of one iteration: point residuals, then rest pose, floor and hands.

use super::scratch::{FitContext, FitScratch};
use super::standing::planted;
use super::terms::FitTerms;
use crate::model::{Limb, TrackerModel};
use crate::registration::residual::{
    ClearanceResidual, EdgeResidual, FloorPlane, FloorResidual, HandResidual, JointResidual,
    LimbMotion, PointTerm, Residual, RestPoseResidual, SurfaceMetric, SurfaceResidual,
};
use crate::registration::{
    Dof, NormalEquations, PairingConfig, PairingStats, ROOT_UNKNOWNS, linearise, pair_edges,
    pair_surfaces,
};
use nalgebra::Vector3;
use tryon_body::Pose;
use tryon_geometry::math::P3d;
use tryon_geometry::spatial::OrganisedCloud;

/// Sums over the pairs of the surface residual.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PoseSums {
    /// Σ kernel weights.
    pub weight: f64,
    /// Σ kernel weight × distance along the normal, metres.
    pub distance: f64,
    /// Σ robust costs, m².
    pub cost: f64,
}

/// Poses the samples and pairs them with the readings.
pub(crate) fn pair(
    context: &FitContext<'_>,
    pose: &Pose,
    distance: f32,
    pull: f32,
    scratch: &mut FitScratch,
) -> PairingStats {
    let settings = &context.model.config.registration;
    scratch.pose_samples(context, pose);
    let (model, observation, terms) = (context.model, context.observation, scratch.terms);
    let config = PairingConfig {
        association: terms.association,
        distance,
        pull,
        data_step: model.config.data_step,
        settings: *settings,
    };
    let mut pairs = std::mem::take(&mut scratch.pairs);
    let mut pairing = std::mem::take(&mut scratch.pairing);
    let mut edges = std::mem::take(&mut scratch.edges);
    let points = scratch.points(model);
    let stats = pair_surfaces(&points, observation, &config, &mut pairing, &mut pairs);
    if terms.edge_weight > 0.0 {
        pair_edges(&points, observation, &pairing.image, settings, &mut edges);
    } else {
        edges.pairs.clear();
    }
    (scratch.pairs, scratch.pairing, scratch.edges) = (pairs, pairing, edges);
    stats
}

/// Visits the terms of all point residuals of the current pairs. `sigma` is the kernel's width, metres, `point_to_point`
/// the weight of that distance beside the configured point-to-plane.
pub(crate) fn for_each_point(
    context: &FitContext<'_>,
    scratch: &FitScratch,
    sigma: f64,
    point_to_point: f64,
    mut visit: impl FnMut(&PointTerm),
) -> PoseSums {
    let settings = &context.model.config.fit;
    let (config, terms) = (&context.model.config, &scratch.terms);
    let grid = context.observation.grid;
    let model = &scratch.points(context.model);
    let surface = SurfaceResidual {
        model,
        grid,
        pairs: &scratch.pairs,
        both_ways: config.both_ways,
        metric: SurfaceMetric {
            point_to_point,
            point_to_plane: config.point_to_plane,
            robust: config.robust,
            sigma,
            pull_length: config.registration.pull_length,
        },
    };
    let mut sums = PoseSums::default();
    surface.for_each(|term| {
        sums.cost += term.cost.min(settings.unexplained * settings.unexplained);
        sums.weight += term.weight;
        sums.distance += term.weight * term.metric.direction.dot(&term.residual).abs();
        visit(term);
    });
    let edge = EdgeResidual {
        model,
        grid,
        pairs: &scratch.edges.pairs,
        weight: terms.edge_weight,
        sigma: sigma.max(config.registration.edge_sigma),
    };
    edge.for_each(&mut visit);
    sums
}

/// Fills the normal equations at the paired pose, per point, with rest pose, floor and hands.
pub(crate) fn assemble(
    context: &FitContext<'_>,
    pose: &Pose,
    sigma: f64,
    point_to_point: f64,
    scratch: &mut FitScratch,
) -> PoseSums {
    let model = context.model;
    let centre = scratch.centre();
    let mut equations = std::mem::take(&mut scratch.equations);
    equations.reset(model.parents.len());
    let sums = for_each_point(context, scratch, sigma, point_to_point, |term| {
        equations.add_point(term, &centre);
    });
    let readings = scratch.residuals().max(1) as f64;
    let seen = JointResidual {
        joints: &scratch.bones.joints,
        targets: &scratch.targets,
        uncertainty: model.config.fit.seen_joints.uncertainty,
        sigma: model.config.fit.seen_joints.sigma,
        weight: model.config.fit.seen_joints.weight * readings,
    };
    seen.for_each(|term| equations.add_point(term, &centre));
    let skeleton = model.template.skeleton();
    linearise(skeleton, &scratch.bones, pose, &centre, &mut scratch.dofs);
    equations.assemble(&model.parents, &scratch.dofs);
    let scale = 1.0 / readings;
    equations.hessian *= scale;
    equations.gradient *= scale;
    add_priors(context, pose, scratch, &mut equations);
    scratch.equations = equations;
    sums
}

/// Adds rest pose, floor, trunk and hands to the equations of the readings; updates the unseen shares.
fn add_priors(
    context: &FitContext<'_>,
    pose: &Pose,
    scratch: &mut FitScratch,
    equations: &mut NormalEquations,
) {
    let settings = &context.model.config.fit;
    let (model, grid) = (context.model, context.observation.grid);
    let standing = scratch.terms.standing;
    let joints = &scratch.bones.joints;
    let feet = planted(model, grid, standing.as_ref(), joints);
    scratch.unseen.clear();
    for k in 0..pose.angles.len() {
        let information = equations.hessian[(ROOT_UNKNOWNS + k, ROOT_UNKNOWNS + k)];
        let share = settings.barely_seen / (settings.barely_seen + information);
        scratch.unseen.push(share.powi(2));
    }
    let prior = RestPoseResidual {
        angles: &pose.angles,
        weights: &prior_weights(model, &scratch.terms, feet.map(|f| f.is_some()), equations),
    };
    prior.for_each(|row| equations.add_row(row));
    if let Some(standing) = standing {
        let legs = FloorLegs {
            model,
            grid,
            floor: &standing.floor,
            feet,
            joints,
            dofs: &scratch.dofs,
            unseen: &scratch.unseen,
        };
        legs.add_to(equations);
    }
    add_clearance(model, scratch, equations);
    let centre = scratch.centre();
    for (arm, hand) in model.arms.iter().zip(scratch.terms.hands) {
        let (Some(arm), Some(target)) = (arm, hand) else {
            continue;
        };
        let residual = HandResidual {
            arm: limb_motion(arm, scratch, &centre),
            hand: arm.hand(&scratch.bones),
            target,
            weight: settings.hand_weight,
        };
        residual.for_each(|row| equations.add_row(row));
    }
}

/// Motion of a limb in the last linearisation, about `centre`.
fn limb_motion<'a>(
    limb: &'a Limb,
    scratch: &'a FitScratch,
    centre: &'a Vector3<f64>,
) -> LimbMotion<'a> {
    LimbMotion {
        angles: &limb.angles,
        dofs: &scratch.dofs,
        centre,
    }
}

/// Pushes both arms out of the trunk.
fn add_clearance(model: &TrackerModel, scratch: &FitScratch, equations: &mut NormalEquations) {
    let settings = &model.config.fit;
    let Some(column) = model.trunk.and_then(|t| t.column(&scratch.bones)) else {
        return;
    };
    let centre = scratch.centre();
    for arm in model.arms.iter().flatten() {
        for point in arm.lower_points(&scratch.bones) {
            let residual = ClearanceResidual {
                arm: limb_motion(arm, scratch, &centre),
                point,
                column: &column,
                weight: settings.clearance_weight,
            };
            residual.for_each(|row| equations.add_row(row));
        }
    }
}

/// Weight of the rest-pose prior of each angle: readings of a joint outweigh it at once; a hidden leg stands.
fn prior_weights(
    model: &TrackerModel,
    terms: &FitTerms,
    planted: [bool; 2],
    equations: &NormalEquations,
) -> Vec<f64> {
    let settings = &model.config.fit;
    let leg_pull = |k: usize| {
        let mut legs = model.standing.iter().zip(planted);
        if legs.any(|(leg, stays)| stays && leg.moves(k)) {
            settings.planted_leg_pull
        } else {
            settings.hidden_leg_pull
        }
    };
    let weight = |(k, &stiffness): (usize, &f64)| {
        let information = equations.hessian[(ROOT_UNKNOWNS + k, ROOT_UNKNOWNS + k)];
        let hidden = (settings.hidden / (settings.hidden + information)).powi(2);
        let seen_share = if terms.eased {
            model.seen_shares[k]
        } else {
            1.0
        };
        let share = seen_share + (1.0 - seen_share) * hidden;
        let leg = if model.below_knee[k] {
            leg_pull(k) * hidden
        } else {
            0.0
        };
        stiffness * terms.rest_weight * share + leg
    };
    model.stiffness.iter().enumerate().map(weight).collect()
}

/// Both legs over a floor.
pub(crate) struct FloorLegs<'a> {
    pub model: &'a TrackerModel,
    pub grid: &'a OrganisedCloud,
    pub floor: &'a FloorPlane,
    /// Remembered ankle and ball of each planted foot.
    pub feet: [Option<[Vector3<f64>; 2]>; 2],
    pub joints: &'a [P3d],
    /// Degrees of freedom as twists about the root joint.
    pub dofs: &'a [Dof],
    /// Share of each angle without readings, 0 to 1.
    pub unseen: &'a [f64],
}

impl FloorLegs<'_> {
    /// Adds the floor residual of both legs to the equations.
    pub(crate) fn add_to(&self, equations: &mut NormalEquations) {
        for (leg, planted) in self.model.standing.iter().zip(self.feet) {
            let residual = FloorResidual {
                foot: &leg.foot,
                floor: *self.floor,
                planted,
                joints: self.joints,
                parents: &self.model.parents,
                dofs: self.dofs,
                centre: &self.joints[0].coords,
                unseen: self.unseen,
                grid: self.grid,
                settings: self.model.config.registration.floor,
            };
            residual.for_each(|row| equations.add_row(row));
        }
    }
}
