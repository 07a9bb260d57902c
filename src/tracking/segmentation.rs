//! Segmentation stage of a step: scene planes, the subject's cells and their outline.

use super::{TrackerModel, TrackerState, Workspace};
use crate::camera::RgbdFrame;
use crate::segment::{PersonChoice, PersonPrior, PersonSearch, contour, find_person, find_planes};
use crate::spatial::OrganisedCloud;

/// Frames without a subject after which the scene planes are searched again.
const SCENE_INTERVAL: u32 = 60;
/// Reach of the search around the last position, metres: six times a sprint between two frames.
const REACH: f32 = 0.8;
/// Least number of cells of a subject; fewer are a thing or noise.
pub(super) const LEAST_CELLS: usize = 60;

/// Samples the depth image into `grid` and finds the subject; refines its cells and traces its outline.
pub(super) fn segment(
    model: &TrackerModel,
    state: &mut TrackerState,
    frame: &RgbdFrame,
    grid: &mut OrganisedCloud,
    workspace: &mut Workspace,
) -> PersonSearch {
    if grid.sample(&frame.depth, model.config.farthest) == 0 {
        return PersonSearch::default();
    }
    state.scene_age = state.scene_age.map(|a| a.saturating_add(1));
    if !state.status.is_live() && state.scene_age.is_none_or(|a| a >= SCENE_INTERVAL) {
        let scene = find_planes(grid);
        // A known floor stays known while somebody stands before it.
        if scene.floor.is_some() || state.scene_age.is_none() || state.scene.floor.is_none() {
            state.set_scene(scene);
        }
    }
    let choice = if state.is_following() {
        PersonChoice::Near(PersonPrior {
            centre: state.centre,
            reach: REACH,
        })
    } else {
        PersonChoice::Ranked(state.attempts as usize)
    };
    let mut person = find_person(grid, &state.scene, choice, &mut workspace.segment);
    if person.cells.len() >= LEAST_CELLS {
        grid.refine(&frame.depth, &person.cells);
        person.cells.retain(|&c| grid.depth[c as usize] > 0.0);
        contour(grid, &person.cells, &mut workspace.contour);
    }
    person
}
