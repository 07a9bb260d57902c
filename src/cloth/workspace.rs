//! Scratch of a step.

use super::contact::chunk::ContactChunk;
use super::contact::layer_height::LayerHeights;
use super::contact::self_contact::SelfContactFrame;
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
    /// Garments at the beginning of an interval, for contact of cloth with cloth.
    pub(super) sheets: Vec<SelfContactFrame>,
    pub(super) pairs: PairContacts,
    pub(super) layer_heights: LayerHeights,
    pub(super) maps: DepthMaps,
    pub(super) untangle: UntangleWork,
}

impl Workspace {
    /// Trial.
    pub fn describe(&self, model: &super::Model, g: usize, v: u32) -> String {
        let mut out = String::new();
        let mut at = 0;
        for (k, m) in model.garments.iter().enumerate() {
            for f in &m.patches {
                let p = &self.patches[at];
                for (i, _) in f.vertices.iter().enumerate().filter(|(i, w)| k == g && **w == v && *i < f.owned) {
                    let moved = p.motion.displacement[i];
                    out += &format!("moved {:.1} mm over {} taut {} ", moved.dot(moved).sqrt() * 1e3, p.overstretched[i], p.taut[i]);
                    for c in self.chunks.iter().filter(|c| c.at == at) {
                        let body = c.body_planes.iter().filter(|b| b.vertex == i as u32).count();
                        let projected = c.projected.iter().filter(|b| b.0 == i as u32).count();
                        if c.range.contains(&i) {
                            out += &format!("body {body} projected {projected} ");
                        }
                    }
                }
                at += 1;
            }
        }
        out + &self.pairs.describe(g, v)
    }
    /// Trial.
    pub fn counts(&self) -> [usize; 2] {
        self.pairs.counts()
    }
}

/// Body at the beginning of a step and at the beginning of an interval within it.
#[derive(Debug, Default)]
pub(super) struct BodyMotion {
    pub(super) before: SurfaceFrame,
    pub(super) now: SurfaceFrame,
}
