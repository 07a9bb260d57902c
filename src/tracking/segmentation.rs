//! Segmentation stage of a step: scene planes, the subject's cells and their outline.

use super::state::TrackerState;
use super::status::Status;
use super::workspace::Workspace;
use crate::assess::Verdict;
use crate::fit::FitContext;
use crate::model::TrackerModel;
use crate::registration::Observation;
use crate::segment::{PersonChoice, PersonPrior, PersonSearch, contour, find_person, find_planes};
use tryon_geometry::camera::RgbdFrame;
use tryon_geometry::spatial::OrganisedCloud;

/// Frames without a subject after which the scene planes are searched again.
const SCENE_INTERVAL: u32 = 60;
/// Reach of the search around the last position, metres: six times a sprint between two frames.
const REACH: f32 = 0.8;
/// Age of a last pose up to which a lost person is searched near it alone, frames: nobody leaves and is replaced within a
/// second.
const RECALL: u32 = 30;
/// Reach of that search at first, metres: somebody beside the lost person is farther away.
const RECENT_REACH: f32 = 0.3;
/// Its growth per frame, metres: a brisk walk.
const WALK: f32 = 0.04;
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
    let body = if state.is_following() {
        draw_last(model, state, grid, workspace);
        workspace.fit.pairing.image.depth.as_slice()
    } else {
        &[]
    };
    let prior = PersonPrior {
        centre: state.centre,
        reach: REACH,
        body,
    };
    let choice = if state.is_following() {
        PersonChoice::Near(prior)
    } else {
        state.refusals.age();
        let is_recent = matches!(state.status, Status::Lost { .. })
            && state.pose_age <= RECALL
            && state.belief.verdict == Verdict::Person;
        let reach = REACH.min(RECENT_REACH + WALK * state.pose_age as f32);
        PersonChoice::Untried {
            refusals: &state.refusals,
            recent: is_recent.then_some(PersonPrior { reach, ..prior }),
        }
    };
    let mut person = find_person(grid, &state.scene, choice, &mut workspace.segment);
    if person.cells.len() >= LEAST_CELLS {
        grid.refine(&frame.depth, &person.cells);
        person.cells.retain(|&c| grid.depth[c as usize] > 0.0);
        contour(grid, &person.cells, &mut workspace.contour);
    }
    person
}

/// Draws the body of the last pose into the grid.
fn draw_last(
    model: &TrackerModel,
    state: &TrackerState,
    grid: &OrganisedCloud,
    workspace: &mut Workspace,
) {
    workspace.body.update(model, &state.shape);
    let context = FitContext {
        model,
        body: &workspace.body,
        observation: &Observation {
            grid,
            cells: &[],
            false_edges: &[],
            true_edges: &[],
            tree: None,
        },
    };
    workspace.fit.draw(&context, &state.pose);
}
