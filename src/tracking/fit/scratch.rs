//! Inputs and scratch of the pose fit.

use super::terms::FitTerms;
use crate::model::{PersonalBody, TrackerModel};
use crate::registration::residual::JointTarget;
use crate::registration::{
    Dof, EdgePairs, ModelPoints, NormalEquations, Observation, Pair, PairingScratch, ROOT_UNKNOWNS,
};
use crate::settings::FitSettings;
use nalgebra::{Matrix3, Vector3};
use tryon_body::{BoneTransforms, Pose};
use tryon_geometry::math::{P3, V3};

/// Constants of one fit: body and readings.
#[derive(Clone, Copy)]
pub(crate) struct FitContext<'a> {
    pub model: &'a TrackerModel,
    pub body: &'a PersonalBody,
    pub observation: &'a Observation<'a>,
}

/// Scratch of the fit.
pub(crate) struct FitScratch {
    /// Residuals and weights, until set anew.
    pub terms: FitTerms,
    /// Places that joints are pulled to.
    pub targets: Vec<JointTarget>,
    /// Bones of the last pose that was paired.
    pub bones: BoneTransforms,
    /// Samples at that pose, camera frame, metres.
    pub positions: Vec<P3>,
    pub normals: Vec<V3>,
    pub pairing: PairingScratch,
    pub pairs: Vec<Pair>,
    pub edges: EdgePairs,
    /// Degrees of freedom of the last normal equations.
    pub dofs: Vec<Dof>,
    /// Last normal equations, per point, priors included.
    pub equations: NormalEquations,
    /// Share of each joint angle (0 to 1) that no reading held in them.
    pub unseen: Vec<f64>,
}

impl Default for FitScratch {
    fn default() -> Self {
        Self {
            terms: FitTerms::start(&FitSettings::default()),
            targets: Vec::new(),
            bones: BoneTransforms::default(),
            positions: Vec::new(),
            normals: Vec::new(),
            pairing: PairingScratch::default(),
            pairs: Vec::new(),
            edges: EdgePairs::default(),
            dofs: Vec::new(),
            equations: NormalEquations::default(),
            unseen: Vec::new(),
        }
    }
}

impl FitScratch {
    /// Runs `work` with other terms.
    pub(crate) fn with_terms<T>(
        &mut self,
        terms: FitTerms,
        work: impl FnOnce(&mut Self) -> T,
    ) -> T {
        let before = std::mem::replace(&mut self.terms, terms);
        let result = work(self);
        self.terms = before;
        result
    }

    /// Runs `work` with joints pulled to `targets`.
    pub(crate) fn with_targets<T>(
        &mut self,
        targets: Vec<JointTarget>,
        work: impl FnOnce(&mut Self) -> T,
    ) -> T {
        let before = std::mem::replace(&mut self.targets, targets);
        let result = work(self);
        self.targets = before;
        result
    }

    /// Information of the last normal equations on a joint angle, per point, priors included; 0 before any.
    pub(crate) fn information(&self, angle: usize) -> f64 {
        let unknown = ROOT_UNKNOWNS + angle;
        let hessian = &self.equations.hessian;
        if unknown < hessian.nrows() {
            hessian[(unknown, unknown)]
        } else {
            0.0
        }
    }

    /// Number of point residuals of the current pairs.
    pub(crate) fn residuals(&self) -> usize {
        self.pairs.len() + self.edges.pairs.len()
    }

    /// Origin of the twists: the root joint, camera frame, metres.
    pub(crate) fn centre(&self) -> Vector3<f64> {
        self.bones.joints[0].coords
    }

    /// The posed samples.
    pub(crate) fn points<'a>(&'a self, model: &'a TrackerModel) -> ModelPoints<'a> {
        ModelPoints {
            positions: &self.positions,
            normals: &self.normals,
            bones: &model.bones,
            parents: &model.parents,
            spacing: model.spacing,
        }
    }

    /// Poses the samples and draws them into the index image.
    pub(crate) fn draw(&mut self, context: &FitContext<'_>, pose: &Pose) {
        self.pose_samples(context, pose);
        let grid = context.observation.grid;
        let image = &mut self.pairing.image;
        image.draw(grid, &self.positions, &self.normals, context.model.spacing);
    }

    /// Poses the samples: positions by all weights, normals by the dominant bone.
    pub(super) fn pose_samples(&mut self, context: &FitContext<'_>, pose: &Pose) {
        let (model, samples) = (context.model, &context.body.samples);
        pose.bones(
            model.template.skeleton(),
            &context.body.rest,
            &mut self.bones,
        );
        let to_f32 = |b: &nalgebra::Isometry3<f64>| {
            let rotation = b.rotation.to_rotation_matrix().into_inner();
            (rotation.cast::<f32>(), b.translation.vector.cast::<f32>())
        };
        let bones: Vec<(Matrix3<f32>, V3)> = self.bones.bones.iter().map(to_f32).collect();
        self.positions.clear();
        self.normals.clear();
        for (i, p) in samples.positions.iter().enumerate() {
            let (joints, weights) = (&model.weights.joints[i], &model.weights.weights[i]);
            let mut sum = V3::zeros();
            for k in 0..4 {
                if weights[k] > 0.0 {
                    let (r, t) = &bones[usize::from(joints[k])];
                    sum += (r * p.coords + t) * weights[k];
                }
            }
            self.positions.push(P3::from(sum));
            let (r, _) = bones[usize::from(joints[0])];
            self.normals.push(r * samples.normals[i]);
        }
    }
}
