//! Scratch of a step.

use super::contact::chunk::ContactChunk;
use super::contact::layer_height::LayerHeights;
use super::contact::self_contact::SelfContactFrame;
use super::patch::PatchWork;
use super::repair::untangle::UntangleWork;
use crate::contact::{CollisionWorkspace, DepthMaps, SkinGrid, SurfaceFrame};

/// Scratch. Dropping it changes no result, only the time of the next step.
#[derive(Debug, Default)]
pub struct Workspace {
    pub(super) patches: Vec<PatchWork>,
    pub(super) chunks: Vec<ContactChunk>,
    pub(super) body: BodyMotion,
    pub(super) collision: CollisionWorkspace,
    /// Body vertices at the end of the step.
    pub(super) skin_grid: SkinGrid,
    /// Garments at the beginning of an interval, for contact of cloth with cloth.
    pub(super) sheets: Vec<SelfContactFrame>,
    pub(super) layer_heights: LayerHeights,
    pub(super) maps: DepthMaps,
    pub(super) untangle: UntangleWork,
}

/// Body at the beginning of a step and at the beginning of an interval within it.
#[derive(Debug, Default)]
pub(super) struct BodyMotion {
    pub(super) before: SurfaceFrame,
    pub(super) now: SurfaceFrame,
}
