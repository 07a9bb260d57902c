//! Ghost exchange between patches after a substep.

use super::patch_model::PatchModel;
use super::patch_state::PatchState;
use super::vec4::{SLOT_MASK, V4};
use std::sync::RwLock;

/// Displacement, velocity and predicted position of one border vertex.
type BorderVertex = [V4; 3];

/// Border vertices of all patches, double buffered: one buffer is read while the next substep fills the other.
#[derive(Debug, Default)]
pub(super) struct HaloExchange(Vec<[RwLock<Vec<BorderVertex>>; 2]>);

impl HaloExchange {
    /// Empty buffers of as many patches.
    pub(super) fn new(patches: usize) -> Self {
        Self((0..patches).map(|_| Default::default()).collect())
    }
    /// Publishes the border of patch `p` after a substep.
    pub(super) fn publish(&self, substep: usize, p: usize, f: &PatchModel, state: &PatchState) {
        if f.border.is_empty() {
            return;
        }
        let Ok(mut to) = self.0[p][substep % 2].write() else {
            return;
        };
        to.clear();
        to.extend(f.border.iter().map(|i| {
            let i = *i as usize;
            [
                state.displacement[i],
                state.velocity[i],
                state.scratch.predicted[i & SLOT_MASK],
            ]
        }));
    }
    /// Copies the ghosts of a patch from their owners' borders after a substep.
    pub(super) fn receive(&self, substep: usize, f: &PatchModel, state: &mut PatchState) {
        let (mut from, mut open) = (u32::MAX, None);
        for (k, [q, at]) in f.ghosts.iter().enumerate() {
            if from != *q {
                let buffer = &self.0[*q as usize][substep % 2];
                (from, open) = (*q, buffer.read().ok());
            }
            let vertex = open.as_ref().and_then(|o| o.get(*at as usize));
            let (i, Some(vertex)) = (f.owned + k, vertex) else {
                continue;
            };
            [
                state.displacement[i],
                state.velocity[i],
                state.scratch.predicted[i & SLOT_MASK],
            ] = *vertex;
        }
    }
}
