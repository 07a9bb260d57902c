//! Scratch of a step.

use super::contact::chunk::ContactChunk;
use super::contact::pair_contact::PairContacts;
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
    pub(super) pairs: PairContacts,
    pub(super) maps: DepthMaps,
    pub(super) untangle: UntangleWork,
}

/// Body at the beginning of a step and at the beginning of an interval within it.
#[derive(Debug, Default)]
pub(super) struct BodyMotion {
    pub(super) before: SurfaceFrame,
    pub(super) now: SurfaceFrame,
}
