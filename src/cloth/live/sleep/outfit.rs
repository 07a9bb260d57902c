//! Sleep of the whole outfit, which then follows the skin without being simulated.

use super::criteria::stays_asleep;
use super::follow_skin::follow_skin;
use crate::contact::CollisionWorkspace;
use crate::live::outfit_model::Model;
use crate::live::report::StepReport;
use crate::live::state::State;
use tryon_geometry::par;

/// Lets a sleeping outfit follow the filtered body of `work`; `None` when it is awake or wakes.
///
/// Its body keeps the clearances of the moment when it fell asleep.
pub(in crate::live) fn follow_asleep(
    model: &Model,
    state: &mut State,
    work: &mut CollisionWorkspace,
) -> Option<StepReport> {
    let config = &model.config;
    if !config.sleep
        || state.sleep.still_steps < config.stillness.still_steps
        || state.body.is_new()
    {
        return None;
    }
    if let Some(to) = state.body.shifted(&model.collision, work) {
        let State {
            body,
            garments,
            sleep,
            ..
        } = state;
        let from = body.vertices();
        if !stays_asleep(config, sleep, garments, from, &to) {
            return None;
        }
        par::for_chunks(config.par, garments, 1, |k, g| {
            let (g, edges) = (&mut g[0], &model.garments[k].sheet.edges);
            follow_skin(edges, &g.nearest, from, &to, &mut g.positions);
        });
        body.shift(to, work);
    }
    state.frames += 1;
    Some(StepReport {
        sleeping: state.garments.iter().map(|g| g.positions.len()).sum(),
        ..StepReport::default()
    })
}

/// Counts still steps after a step in which cloth moved at `speed` (m/s) and the body was `still` or not.
pub(in crate::live) fn update_stillness(model: &Model, state: &mut State, still: bool, speed: f32) {
    let sleep = &mut state.sleep;
    if !still {
        sleep.reference.copy_from_slice(state.body.vertices());
    }
    let config = &model.config;
    let is_tracked = config.noise_deadband > 0.0;
    let is_slow = speed < config.stillness.still_cloth[usize::from(is_tracked)];
    sleep.still_steps = if still && is_slow {
        sleep.still_steps + 1
    } else {
        0
    };
}
