//! Static drape of an outfit from coarse to fine: each mesh starts from the rest of the coarser one (cascadic iteration,
//! Bornemann & Deuflhard 1996), so that the fine systems only add what the coarse mesh cannot resolve.

use super::error::MirrorError;
use super::offline_outfit::OfflineOutfit;
use super::offline_run::OfflineRun;
use super::outfit::DressedOutfit;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::time::Instant;
use tryon_cloth::fine::{DrapeReport, DrapeSettings, FrameTargets, StartReport};
use tryon_geometry::par::Par;

/// Work of a drape on one mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OfflineDrapeLevel {
    /// Vertices of the cloth.
    pub vertices: usize,
    /// Steps and end.
    pub drape: DrapeReport,
    /// Computing time (s). No result depends on it.
    pub seconds: f64,
}

/// Work of a drape.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OfflineDrapeReport {
    /// Repair of the real-time result.
    pub start: StartReport,
    /// Meshes, from coarse to fine.
    pub levels: Vec<OfflineDrapeLevel>,
}

impl OfflineDrapeReport {
    /// True if the finest mesh came to rest.
    pub fn is_settled(&self) -> bool {
        self.levels.last().is_some_and(|l| l.drape.settled)
    }
}

/// Most steps on a mesh that starts from a coarser one's rest. What moves on from there, the hem of a dress by a millimetre
/// a step, does so for as long as was tried (decision 079).
const FINER_STEPS: usize = 12;
/// Most steps on the finest mesh after those, to the solver's tolerance.
const FINAL_STEPS: usize = 2;

impl OfflineOutfit {
    /// Brings the real-time result to rest on the body that it met. `progress` receives the vertices of the mesh in work and
    /// each step; a break ends the drape, and finer meshes stay as the coarser one is then.
    ///
    /// # Errors
    /// [`MirrorError::TangledStart`] when intersections stay; a step that is not solved.
    pub fn drape(
        &self,
        worn: &DressedOutfit,
        par: Par,
        mut progress: impl FnMut(usize, &DrapeReport) -> ControlFlow<()>,
    ) -> Result<(OfflineRun<'_>, OfflineDrapeReport), MirrorError> {
        let coarser = (0..self.level()).map(|l| Self::with_level(worn, self.body_faces(), l));
        let coarser = coarser.collect::<Result<Vec<Self>, _>>()?;
        let (mut state, start) = coarser.first().unwrap_or(self).start(worn, par)?;
        let body = worn.state.collision_body().vertices();
        let (mut settings, mut levels) = (DrapeSettings::default(), Vec::new());
        let (mut before, mut flow): (Option<&Self>, _) = (None, ControlFlow::Continue(()));
        for outfit in coarser.iter().chain([self]) {
            if let Some(coarse) = before.replace(outfit) {
                state = outfit.refined(coarse, &state);
                settings = DrapeSettings {
                    // Near rest, the longest step is solved at once.
                    steps: [settings.steps[1]; 2],
                    most_steps: FINER_STEPS,
                    final_steps: FINAL_STEPS,
                    ..settings
                };
            }
            let started = Instant::now();
            let vertices = outfit.cloth().len();
            if flow.is_break() {
                levels.push(OfflineDrapeLevel {
                    vertices,
                    ..OfflineDrapeLevel::default()
                });
                continue;
            }
            let is_finest = outfit.level() == self.level();
            let own = DrapeSettings {
                final_steps: settings.final_steps * usize::from(is_finest),
                ..settings
            };
            let mut solver = outfit.solver(state, par)?;
            let pins = outfit.pins(body);
            let targets = FrameTargets {
                pins: &pins,
                ..FrameTargets::default()
            };
            let drape = solver.drape_to(&own, &targets, |step| {
                flow = progress(vertices, step);
                flow
            })?;
            levels.push(OfflineDrapeLevel {
                vertices,
                drape,
                seconds: started.elapsed().as_secs_f64(),
            });
            state = solver.state().clone();
        }
        let run = OfflineRun::new(self, state, par)?;
        Ok((run, OfflineDrapeReport { start, levels }))
    }
}
