//! Scratch and caches of a step. Dropping a workspace changes no result.

use super::align::{AlignScratch, SampleRest};
use super::surface::SurfaceScratch;
use super::{TrackerModel, TrackerState};
use crate::body::{BodyShape, BoneTransforms, RestBody, skin};
use crate::math::P3;
use crate::par::Par;
use crate::segment::{Contour, SegmentScratch};
use crate::spatial::OrganisedCloud;

/// Scratch memory of [`super::step`]; one per thread that steps.
#[derive(Default)]
pub struct Workspace {
    pub(super) grid: Option<OrganisedCloud>,
    pub(super) segment: SegmentScratch,
    pub(super) contour: Contour,
    pub(super) align: AlignScratch,
    pub(super) surface: SurfaceScratch,
    /// The shape that `rest` was made for.
    cached: Option<BodyShape>,
    pub(super) rest: RestBody,
    pub(super) samples: SampleRest,
    posed: Vec<P3>,
}

impl Workspace {
    /// The personalised rest body of `state`, made anew only when the shape has changed.
    pub fn rest_body(&mut self, model: &TrackerModel, shape: &BodyShape) -> &RestBody {
        if self.cached.as_ref() == Some(shape)
            && self.samples.positions.len() == model.samples.len()
        {
            return &self.rest;
        }
        let bare = |s: &BodyShape| (s.coefficients.clone(), s.bone_scales.clone());
        let same_base = self.cached.as_ref().is_some_and(|c| bare(c) == bare(shape))
            && self.samples.positions.len() == model.samples.len();
        if same_base {
            // Only displacements changed: base, normals and joints stay.
            let moved = self.rest.base.iter().zip(&self.rest.normals).enumerate();
            let moved =
                moved.map(|(i, (p, n))| p + n * shape.displacements.get(i).copied().unwrap_or(0.0));
            self.rest.vertices = moved.collect();
        } else {
            self.rest = model.template.personalise(shape);
        }
        let pick = |v: &u32| *v as usize;
        let surface = if model.config.displaced_pose {
            &self.rest.vertices
        } else {
            &self.rest.base
        };
        self.samples.positions = model.samples.iter().map(|v| surface[pick(v)]).collect();
        self.samples.normals = model
            .samples
            .iter()
            .map(|v| self.rest.normals[pick(v)])
            .collect();
        self.cached = Some(shape.clone());
        &self.rest
    }

    /// Moves samples and joints to another shape and leaves normals, which hardly turn, and all other vertices behind:
    /// enough to look for a size with, at a tenth of the time. [`Workspace::rest_body`] makes all of it anew.
    pub(super) fn sketch(&mut self, model: &TrackerModel, shape: &BodyShape) {
        if model.config.displaced_pose {
            self.rest_body(model, shape);
            return;
        }
        (self.samples.positions, self.rest.joints) =
            model.template.personalise_some(shape, &model.samples);
        self.cached = None;
    }

    /// All vertices of the tracked body in the camera frame, metres, shape `[vertices]`, and its bones.
    pub fn posed(&mut self, model: &TrackerModel, state: &TrackerState) -> (&[P3], BoneTransforms) {
        self.rest_body(model, &state.shape);
        let mut bones = BoneTransforms::default();
        state
            .pose
            .bones(model.template.skeleton(), &self.rest, &mut bones);
        skin(
            Par::Seq,
            &self.rest.vertices,
            model.template.weights(),
            &bones,
            &mut self.posed,
        );
        (&self.posed, bones)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Calibration, Intrinsics};
    use crate::tracking::TrackerConfig;

    #[test]
    fn a_sketch_has_the_samples_and_joints_of_the_whole() {
        let config = TrackerConfig {
            samples: 200,
            ..TrackerConfig::default()
        };
        let calibration = Calibration::registered(Intrinsics::KINECT_V1);
        let model = TrackerModel::new(crate::body::embedded::template(), calibration, config);
        let scales = (0..model.parents.len())
            .map(|j| 1.0 + 0.01 * (j % 7) as f64)
            .collect();
        let coefficients = vec![0.7, -1.2];
        let shape = BodyShape {
            coefficients,
            bone_scales: scales,
            displacements: Vec::new(),
        };
        let mut workspace = Workspace::default();
        workspace.rest_body(&model, &BodyShape::default());
        let before = workspace.samples.normals.clone();
        workspace.sketch(&model, &shape);
        assert_eq!(workspace.samples.normals, before, "normals stay behind");
        let (positions, joints) = (
            workspace.samples.positions.clone(),
            workspace.rest.joints.clone(),
        );
        workspace.rest_body(&model, &shape);
        assert_eq!(
            (positions, joints),
            (
                workspace.samples.positions.clone(),
                workspace.rest.joints.clone()
            )
        );
        assert_ne!(
            workspace.samples.normals, before,
            "and follow with the whole"
        );
        // After a sketch nothing is taken from the cache.
        workspace.sketch(&model, &BodyShape::default());
        workspace.rest_body(&model, &shape);
        assert_eq!(
            workspace.rest.vertices,
            model.template.personalise(&shape).vertices
        );
    }
}
