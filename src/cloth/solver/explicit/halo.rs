//! What patches tell each other after a step: the vertices that others have as ghosts.

use super::patch_model::{MOST, PatchModel};
use super::patch_state::{PatchState, V4};
use std::sync::RwLock;

/// Moved, velocity, where forces are evaluated.
type Told = [V4; 3];

/// Letter boxes of all patches, two each: what is told in one round is read in the next, while the other box is filled.
#[derive(Debug, Default)]
pub struct HaloExchange(Vec<[RwLock<Vec<Told>>; 2]>);

impl HaloExchange {
    /// For so many patches.
    pub fn new(patches: usize) -> Self {
        Self((0..patches).map(|_| Default::default()).collect())
    }
    /// Tells what patch `p` computed in a round.
    pub fn publish(&self, round: usize, p: usize, f: &PatchModel, motion: &PatchState) {
        if f.border.is_empty() {
            return;
        }
        let Ok(mut to) = self.0[p][round % 2].write() else {
            return;
        };
        to.clear();
        to.extend(f.border.iter().map(|i| {
            let i = *i as usize;
            [
                motion.displacement[i],
                motion.velocity[i],
                motion.scratch.ahead[i % MOST],
            ]
        }));
    }
    /// Takes over for the ghosts of a patch what their owners told in a round.
    pub fn receive(&self, round: usize, f: &PatchModel, motion: &mut PatchState) {
        let (mut from, mut open) = (u32::MAX, None);
        for (k, [q, at]) in f.ghosts.iter().enumerate() {
            if from != *q {
                (from, open) = (*q, self.0[*q as usize][round % 2].read().ok());
            }
            let (i, Some(told)) = (f.owned + k, open.as_ref().and_then(|o| o.get(*at as usize)))
            else {
                continue;
            };
            [
                motion.displacement[i],
                motion.velocity[i],
                motion.scratch.ahead[i % MOST],
            ] = *told;
        }
    }
}
