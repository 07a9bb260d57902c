//! Arms that a fit has lost: where the scan shows an arm that the body does not explain, they are searched anew.

use super::model_fit::{AlignedBody, FitStage, ModelFit};
use crate::CaptureError;
use crate::scan::BodyScan;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg32;
use tryon_body::parts::BodyPart;
use tryon_body::{BoneTransforms, PosedSkin, RestBody, Template};
use tryon_geometry::math::P3;
use tryon_geometry::spatial::PointTree;

/// Most scan points that arms are compared with.
const POINTS: usize = 3000;
/// Farthest that a point counts as, metres.
const FARTHEST: f32 = 0.10;
/// Distance of a scan point from the body without an arm above which the arm can explain it, metres.
const APART: f32 = 0.02;
/// Stride through an arm's vertices.
const STRIDE: usize = 4;
/// Angles that are tried, within the limits of the joints.
const TRIALS: usize = 200;
/// Trials that are improved by random steps, their standard deviations as shares of the limits, and steps at each.
const IMPROVED: usize = 3;
/// See [`IMPROVED`].
const STEPS: [f64; 3] = [0.10, 0.04, 0.015];
/// See [`IMPROVED`].
const REPEATS: usize = 25;
/// Stage of the last fit.
const STAGE: FitStage = FitStage::posed(0.08, 8);
/// Error beside that of the lost arm from which another one is taken.
const BETTER: f64 = 0.97;
/// Error that another arm must save to be fitted: wrong arms of the scenes had at most 0.003, lost ones 0.02 to 0.04.
const GAIN: f64 = 0.01;

/// Searches the arms of a body anew and takes those that the scan shows elsewhere; true if there is one.
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
    let mut is_found = false;
    for arm in [BodyPart::LeftArm, BodyPart::RightArm] {
        let (surface, _) = fit.posed(body);
        let Some(search) = ArmSearch::new(template, arm, (&some, &surface), fit.rest(&body.shape))
        else {
            continue;
        };
        let now = search.error(body);
        if now < GAIN {
            continue;
        }
        let mut other = search.best(body);
        if now - search.error(&other) < GAIN {
            continue;
        }
        let least = BETTER * fit.error(body);
        fit.run(&mut other, &STAGE)?;
        if fit.error(&other) < least {
            (*body, is_found) = (other, true);
        }
    }
    Ok(is_found)
}

/// Search of one arm's angles, all else fixed.
struct ArmSearch<'a> {
    template: &'a Template,
    rest: RestBody,
    /// Some of the arm's vertices.
    nodes: Vec<usize>,
    /// Degrees of freedom of shoulder and elbow with their limits.
    dofs: Vec<(usize, [f64; 2])>,
    /// Scan points off the rest of the body with their squared distances from it, metres².
    open: Vec<(P3, f32)>,
    /// Scan points in all.
    points: usize,
}

impl<'a> ArmSearch<'a> {
    /// `None` for a template without the arm. `points` and posed surface in metres.
    fn new(
        template: &'a Template,
        arm: BodyPart,
        (points, surface): (&[P3], &[P3]),
        rest: RestBody,
    ) -> Option<Self> {
        let joints = template.parts().limb(arm)?;
        let skeleton = template.skeleton();
        let is_arm = |v: usize| {
            let joint = template.weights().dominant(v);
            joint == joints.root || skeleton.is_ancestor(joints.root, joint)
        };
        let (nodes, others): (Vec<usize>, Vec<usize>) =
            (0..template.mesh().vertices().len()).partition(|v| is_arm(*v));
        let others: Vec<P3> = others.iter().map(|v| surface[*v]).collect();
        let tree = PointTree::new(&others);
        let distance = |p: &P3| {
            tree.nearest(p, FARTHEST)
                .map_or(FARTHEST * FARTHEST, |n| n.1)
        };
        let limits = skeleton.limits();
        let dofs = [joints.root, joints.hinge].into_iter().flat_map(|j| {
            let first = skeleton.dof_offset(j);
            first..first + skeleton.joints()[j].motion.dofs()
        });
        Some(Self {
            nodes: nodes.into_iter().step_by(STRIDE).collect(),
            dofs: dofs.map(|d| (d, limits[d])).collect(),
            open: points
                .iter()
                .map(|p| (*p, distance(p)))
                .filter(|(_, d)| *d > APART * APART)
                .collect(),
            points: points.len(),
            template,
            rest,
        })
    }

    /// Posed vertices of the arm, metres.
    fn posed(&self, body: &AlignedBody) -> Vec<P3> {
        let mut bones = BoneTransforms::default();
        body.pose
            .bones(self.template.skeleton(), &self.rest, &mut bones);
        let skin = PosedSkin::blended(self.template.weights(), &bones);
        let posed = |v: &usize| {
            let blend = skin.transform(*v);
            blend.transform_point(&self.rest.vertices[*v].cast()).cast()
        };
        self.nodes.iter().map(posed).collect()
    }

    /// Mean squared distance of all scan points from the body beside that of [`FARTHEST`], 0 to 1.
    fn error(&self, body: &AlignedBody) -> f64 {
        let tree = PointTree::new(&self.posed(body));
        let left = |(p, apart): &(P3, f32)| {
            let near = tree.nearest(p, FARTHEST).map_or(*apart, |n| n.1);
            f64::from(near.min(*apart) / (FARTHEST * FARTHEST))
        };
        self.open.iter().map(left).sum::<f64>() / self.points.max(1) as f64
    }

    /// Angles that explain most of the scan.
    fn best(&self, body: &AlignedBody) -> AlignedBody {
        let mut random = Pcg32::seed_from_u64(7);
        let mut trials: Vec<(f64, AlignedBody)> = (0..TRIALS)
            .map(|_| {
                let mut other = body.clone();
                for (d, [low, high]) in &self.dofs {
                    other.pose.angles[*d] = low + (high - low) * random.random::<f64>();
                }
                (self.error(&other), other)
            })
            .collect();
        trials.sort_by(|a, b| a.0.total_cmp(&b.0));
        trials.truncate(IMPROVED);
        for (error, best) in &mut trials {
            for step in STEPS.iter().flat_map(|s| [*s; REPEATS]) {
                let mut other = best.clone();
                for (d, [low, high]) in &self.dofs {
                    let by: f64 = random.sample(StandardNormal);
                    let angle = &mut other.pose.angles[*d];
                    *angle = (*angle + step * (high - low) * by).clamp(*low, *high);
                }
                let tried = self.error(&other);
                if tried < *error {
                    (*error, *best) = (tried, other);
                }
            }
        }
        let least = trials.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        least.map_or_else(|| body.clone(), |t| t.1)
    }
}
