//! Time loop of the explicit solver: substeps of all patches in lockstep.

use super::halo::HaloExchange;
use super::patch_model::PatchModel;
use super::patch_state::PatchState;
use tryon_geometry::par::{self, Par};

/// Runs `count` substeps `substep(index, patch, scratch)` on all patches. Ghosts are exchanged after each.
pub fn run_substeps<P: Send + AsMut<PatchState>>(
    par: Par,
    models: &[PatchModel],
    patches: &mut [P],
    count: usize,
    substep: impl Fn(usize, usize, &mut P) + Sync,
) {
    let halo = HaloExchange::new(models.len());
    par::lockstep(par, patches, count, |s, k, p| {
        let model = &models[k];
        if s > 0 {
            halo.receive(s - 1, model, p.as_mut());
        }
        substep(s, k, p);
        halo.publish(s, k, model, p.as_mut());
    });
    if count > 0 {
        for (model, p) in models.iter().zip(patches) {
            halo.receive(count - 1, model, p.as_mut());
        }
    }
}
