//! Scratch and caches of a step. Dropping a workspace changes no result.

use super::state::TrackerState;
use crate::assess::AgreementScratch;
use crate::fit::FitScratch;
use crate::model::{PersonalBody, TrackerModel};
use crate::segment::part_network::PersonParts;
use crate::segment::{Contour, SegmentScratch};
use crate::shape::SurfaceScratch;
use tryon_body::{BodyShape, BoneTransforms, RestBody, skin};
use tryon_geometry::math::P3;
use tryon_geometry::par::Par;
use tryon_geometry::spatial::OrganisedCloud;

/// Scratch memory of [`super::step`]; one per thread that steps.
#[derive(Default)]
pub struct Workspace {
    pub(super) grid: Option<OrganisedCloud>,
    pub(super) segment: SegmentScratch,
    pub(super) contour: Contour,
    pub(super) body: PersonalBody,
    pub(super) fit: FitScratch,
    pub(super) agreement: AgreementScratch,
    pub(super) parts: PersonParts,
    pub(super) surface: SurfaceScratch,
    /// Cells of the subject in the last frame, while an adaptation of the surface to them is due.
    pub(super) surface_cells: Option<Vec<u32>>,
    posed: Vec<P3>,
}

impl Workspace {
    /// Personalised rest body of `shape`, computed again only when the shape has changed.
    pub fn rest_body(&mut self, model: &TrackerModel, shape: &BodyShape) -> &RestBody {
        self.body.update(model, shape);
        &self.body.rest
    }

    /// All vertices of the tracked body in the camera frame, metres, shape `[vertices]`, and its bones.
    pub fn posed(&mut self, model: &TrackerModel, state: &TrackerState) -> (&[P3], BoneTransforms) {
        self.body.update(model, &state.shape);
        let rest = &self.body.rest;
        let mut bones = BoneTransforms::default();
        state
            .pose
            .bones(model.template.skeleton(), rest, &mut bones);
        let weights = model.template.weights();
        skin(Par::Seq, &rest.vertices, weights, &bones, &mut self.posed);
        (&self.posed, bones)
    }
}
