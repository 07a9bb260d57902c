//! Arms that a fit has lost: far from every scan point, behind the back or in the air, they are searched anew.

use super::model_fit::{AlignedBody, FitStage, ModelFit};
use crate::body::Template;
use crate::body::parts::BodyPart;
use crate::clothcap::CaptureError;
use crate::clothcap::scan::BodyScan;
use crate::math::P3;
use crate::spatial::PointTree;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Most scan points that arms are compared with.
const POINTS: usize = 10_000;
/// Farthest that a vertex counts as, metres.
const FARTHEST: f32 = 0.10;
/// Mean distance of a forearm with its hand from the scan above which it is lost, metres. Wide sleeves stay below.
const LOST: f32 = 0.04;
/// Angles that are tried, within the limits of the joints.
const TRIALS: usize = 48;
/// Trials that are refined.
const REFINED: usize = 3;
/// Stage of that.
const STAGE: FitStage = FitStage::posed(0.08, 8);
/// Error beside that of the lost arm from which another one is taken.
const BETTER: f64 = 0.97;

/// Searches the arms of a body that lie far from the scan; true if one was found elsewhere.
///
/// # Errors
/// [`CaptureError::Solve`].
pub(super) fn search_lost_arms(
    template: &Template,
    scan: &BodyScan,
    fit: &mut ModelFit<'_>,
    body: &mut AlignedBody,
) -> Result<bool, CaptureError> {
    let stride = scan.points.len().div_ceil(POINTS).max(1);
    let some: Vec<P3> = scan.points.iter().step_by(stride).copied().collect();
    let tree = PointTree::new(&some);
    let mut is_found = false;
    for arm in [BodyPart::LeftArm, BodyPart::RightArm] {
        let (surface, _) = fit.posed(body);
        if mean_distance(template, arm, &surface, &tree) > LOST
            && let Some(other) = searched(template, arm, fit, body)?
        {
            (*body, is_found) = (other, true);
        }
    }
    Ok(is_found)
}

/// Mean distance of a forearm with its hand from the scan, metres; 0 for a template without.
fn mean_distance(template: &Template, arm: BodyPart, surface: &[P3], tree: &PointTree) -> f32 {
    let Some(joints) = template.parts().limb(arm) else {
        return 0.0;
    };
    let skeleton = template.skeleton();
    let is_fore = |v: &usize| {
        let joint = template.weights().dominant(*v);
        joint == joints.hinge || skeleton.is_ancestor(joints.hinge, joint)
    };
    let bodies = 0..template.mesh().vertices().len();
    let (sum, n) = bodies.filter(is_fore).fold((0.0, 0), |(sum, n), v| {
        let far = tree
            .nearest(&surface[v], FARTHEST)
            .map_or(FARTHEST, |(_, d2)| d2.sqrt());
        (sum + far.min(FARTHEST), n + 1)
    });
    sum / n.max(1) as f32
}

/// The arm at other angles, if the scan is explained better there.
fn searched(
    template: &Template,
    arm: BodyPart,
    fit: &mut ModelFit<'_>,
    body: &AlignedBody,
) -> Result<Option<AlignedBody>, CaptureError> {
    let Some(joints) = template.parts().limb(arm) else {
        return Ok(None);
    };
    let skeleton = template.skeleton();
    let limits = skeleton.limits();
    let dofs: Vec<usize> = [joints.root, joints.hinge]
        .iter()
        .flat_map(|j| {
            let first = skeleton.dof_offset(*j);
            first..first + skeleton.joints()[*j].motion.dofs()
        })
        .collect();
    let mut random = Pcg32::seed_from_u64(7);
    let mut trials: Vec<(f64, AlignedBody)> = Vec::new();
    for _ in 0..TRIALS {
        let mut other = body.clone();
        for d in &dofs {
            let [low, high] = limits[*d];
            other.pose.angles[*d] = low + (high - low) * random.random::<f64>();
        }
        trials.push((fit.error(&other), other));
    }
    trials.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best = None;
    let mut least = BETTER * fit.error(body);
    for (_, mut other) in trials.into_iter().take(REFINED) {
        fit.run(&mut other, &STAGE)?;
        let error = fit.error(&other);
        if error < least {
            (best, least) = (Some(other), error);
        }
    }
    Ok(best)
}
