//! Arms that a fit has lost: where the scan shows an arm that the body does not explain, they are searched anew.

use super::model_fit::{AlignedBody, ModelFit};
use crate::CaptureError;
use crate::scan::BodyScan;
use crate::settings::ArmSearchSettings;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg32;
use tryon_body::parts::BodyPart;
use tryon_body::{BoneTransforms, PosedSkin, RestBody, Template};
use tryon_geometry::math::P3;
use tryon_geometry::spatial::PointTree;

pub(super) struct LostArms<'a> {
    template: &'a Template,
    settings: &'a ArmSearchSettings,
    points: Vec<P3>,
}

impl<'a> LostArms<'a> {
    pub(super) fn new(
        template: &'a Template,
        scan: &BodyScan,
        settings: &'a ArmSearchSettings,
    ) -> Self {
        let stride = scan.points.len().div_ceil(settings.points).max(1);
        Self {
            template,
            settings,
            points: scan.points.iter().step_by(stride).copied().collect(),
        }
    }

    /// Searches the arms of a body anew and takes those that the scan shows elsewhere; true if there is one.
    pub(super) fn search(
        &self,
        fit: &mut ModelFit<'_>,
        body: &mut AlignedBody,
    ) -> Result<bool, CaptureError> {
        let settings = self.settings;
        let mut is_found = false;
        for arm in [BodyPart::LeftArm, BodyPart::RightArm] {
            let surface = fit.posed(body).vertices;
            let Some(search) = self.arm(arm, &surface, fit.rest(&body.shape)) else {
                continue;
            };
            let now = search.error(body);
            if now < settings.gain {
                continue;
            }
            let mut other = search.best(body);
            if now - search.error(&other) < settings.gain {
                continue;
            }
            let least = settings.better * fit.error(body);
            fit.run(&mut other, &settings.stage)?;
            if fit.error(&other) < least {
                (*body, is_found) = (other, true);
            }
        }
        Ok(is_found)
    }

    /// `None` for a template without the arm. Posed surface in metres.
    fn arm(&self, arm: BodyPart, surface: &[P3], rest: RestBody) -> Option<ArmSearch<'a>> {
        let (template, settings) = (self.template, self.settings);
        let joints = template.parts().limb(arm)?;
        let skeleton = template.skeleton();
        let is_arm = |v: &usize| {
            let joint = template.weights().dominant(*v);
            joint == joints.root || skeleton.is_ancestor(joints.root, joint)
        };
        let (nodes, others): (Vec<usize>, Vec<usize>) =
            (0..template.mesh().vertices().len()).partition(is_arm);
        let others: Vec<P3> = others.iter().map(|v| surface[*v]).collect();
        let (tree, farthest) = (PointTree::new(&others), settings.farthest);
        let most = farthest * farthest;
        let distance = |p: &P3| tree.nearest(p, farthest).map_or(most, |n| n.1);
        let limits = skeleton.limits();
        let dofs = [joints.root, joints.hinge].into_iter().flat_map(|j| {
            let first = skeleton.dof_offset(j);
            first..first + skeleton.joints()[j].motion.dofs()
        });
        let points = self.points.iter().map(|p| (*p, distance(p)));
        let least = settings.apart * settings.apart;
        Some(ArmSearch {
            nodes: nodes.into_iter().step_by(settings.stride).collect(),
            dofs: dofs.map(|d| (d, limits[d])).collect(),
            open: points.filter(|(_, d)| *d > least).collect(),
            points: self.points.len(),
            template,
            settings,
            rest,
        })
    }
}

/// Search of one arm's angles, all else fixed.
struct ArmSearch<'a> {
    template: &'a Template,
    settings: &'a ArmSearchSettings,
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

impl ArmSearch<'_> {
    fn posed(&self, body: &AlignedBody) -> Vec<P3> {
        let (mut bones, skeleton) = (BoneTransforms::default(), self.template.skeleton());
        body.pose.bones(skeleton, &self.rest, &mut bones);
        let skin = PosedSkin::blended(self.template.weights(), &bones);
        let posed = |v: &usize| {
            let blend = skin.transform(*v);
            blend.transform_point(&self.rest.vertices[*v].cast()).cast()
        };
        self.nodes.iter().map(posed).collect()
    }

    /// Mean squared distance of all scan points from the body beside that at the farthest, 0 to 1.
    fn error(&self, body: &AlignedBody) -> f64 {
        let tree = PointTree::new(&self.posed(body));
        let farthest = self.settings.farthest;
        let left = |(p, apart): &(P3, f32)| {
            let near = tree.nearest(p, farthest).map_or(*apart, |n| n.1);
            f64::from(near.min(*apart) / (farthest * farthest))
        };
        self.open.iter().map(left).sum::<f64>() / self.points.max(1) as f64
    }

    /// Angles that explain most of the scan.
    fn best(&self, body: &AlignedBody) -> AlignedBody {
        let settings = self.settings;
        let mut random = Pcg32::seed_from_u64(7);
        let trial = |_| {
            let mut other = body.clone();
            for (d, [low, high]) in &self.dofs {
                other.pose.angles[*d] = low + (high - low) * random.random::<f64>();
            }
            (self.error(&other), other)
        };
        let mut trials: Vec<(f64, AlignedBody)> = (0..settings.trials).map(trial).collect();
        trials.sort_by(|a, b| a.0.total_cmp(&b.0));
        trials.truncate(settings.improved);
        for (error, best) in &mut trials {
            let repeats = 0..settings.repeats * settings.steps.len();
            for step in repeats.map(|k| settings.steps[k / settings.repeats]) {
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
