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
        if self.cached.as_ref() == Some(shape) && self.samples.positions.len() == model.samples.len() {
            return &self.rest;
        }
        let bare = |s: &BodyShape| (s.coefficients.clone(), s.bone_scales.clone());
        let same_base = self.cached.as_ref().is_some_and(|c| bare(c) == bare(shape))
            && self.samples.positions.len() == model.samples.len();
        if same_base {
            // Only displacements changed: base, normals and joints stay.
            let moved = self.rest.base.iter().zip(&self.rest.normals).enumerate();
            let moved = moved.map(|(i, (p, n))| p + n * shape.displacements.get(i).copied().unwrap_or(0.0));
            self.rest.vertices = moved.collect();
        } else {
            self.rest = model.template.personalise(shape);
        }
        let pick = |v: &u32| *v as usize;
        let surface = if model.config.displaced_pose { &self.rest.vertices } else { &self.rest.base };
        self.samples.positions = model.samples.iter().map(|v| surface[pick(v)]).collect();
        self.samples.normals = model.samples.iter().map(|v| self.rest.normals[pick(v)]).collect();
        self.cached = Some(shape.clone());
        &self.rest
    }

    /// All vertices of the tracked body in the camera frame, metres, shape `[vertices]`, and its bones.
    pub fn posed(&mut self, model: &TrackerModel, state: &TrackerState) -> (&[P3], BoneTransforms) {
        self.rest_body(model, &state.shape);
        let mut bones = BoneTransforms::default();
        state.pose.bones(model.template.skeleton(), &self.rest, &mut bones);
        skin(Par::Seq, &self.rest.vertices, model.template.weights(), &bones, &mut self.posed);
        (&self.posed, bones)
    }
}
