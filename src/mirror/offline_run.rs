//! Offline simulation of an outfit: from a drape or a checkpoint on, one frame for each pose of the body.

use super::offline_outfit::OfflineOutfit;
use tryon_cloth::fine::{
    FrameTargets, OfflineError, OfflineFrameReport, OfflineSolver, OfflineState, checkpoint_state,
};
use tryon_geometry::math::{P3, V3d};
use tryon_geometry::par::Par;

/// Simulation at its last finished frame.
#[derive(Debug)]
pub struct OfflineRun<'a> {
    outfit: &'a OfflineOutfit,
    solver: OfflineSolver<'a>,
}

impl<'a> OfflineRun<'a> {
    /// Run at this state.
    ///
    /// # Errors
    /// A state of another outfit or with a number that is not finite.
    pub(super) fn new(
        outfit: &'a OfflineOutfit,
        state: OfflineState,
        par: Par,
    ) -> Result<Self, OfflineError> {
        let solver = outfit.solver(state, par)?;
        Ok(Self { outfit, solver })
    }

    /// Run at a checkpoint, which continues to the same bits.
    ///
    /// # Errors
    /// Bytes that are no checkpoint, are damaged, or belong to other meshes.
    pub fn resumed(
        outfit: &'a OfflineOutfit,
        checkpoint: &[u8],
        par: Par,
    ) -> Result<Self, OfflineError> {
        let mut run = Self::new(outfit, checkpoint_state(checkpoint)?, par)?;
        run.solver.resume(checkpoint)?;
        Ok(run)
    }

    /// Frame of `dt` seconds, in which the body moves evenly to these vertices (world, metres).
    ///
    /// # Errors
    /// A step that is not solved; the state is then that before it.
    pub fn follow(&mut self, body: &[P3], dt: f64) -> Result<OfflineFrameReport, OfflineError> {
        let obstacle: Vec<V3d> = body.iter().map(|p| p.coords.cast()).collect();
        let targets = FrameTargets {
            pins: &self.outfit.pins(body),
            obstacle: &obstacle,
        };
        self.solver.advance(dt, &targets)
    }

    /// Garments on their finer meshes.
    pub fn outfit(&self) -> &'a OfflineOutfit {
        self.outfit
    }

    /// Solver after the last finished frame.
    pub fn solver(&self) -> &OfflineSolver<'a> {
        &self.solver
    }
}
