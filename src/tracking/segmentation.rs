//! Segmentation stage of a step: scene planes, the subject's cells and their outline.

use super::state::TrackerState;
use super::status::Status;
use super::workspace::Workspace;
use crate::assess::Verdict;
use crate::fit::FitContext;
use crate::model::TrackerModel;
use crate::registration::Observation;
use crate::segment::{PersonChoice, PersonPrior, PersonSearch, contour, find_person, find_planes};
use tryon_geometry::camera::{DepthImage, RgbdFrame};
use tryon_geometry::spatial::OrganisedCloud;

/// Samples the depth image into `grid` and finds the subject; refines its cells and traces its outline.
pub(super) fn segment(
    model: &TrackerModel,
    state: &mut TrackerState,
    frame: &RgbdFrame,
    grid: &mut OrganisedCloud,
    workspace: &mut Workspace,
) -> PersonSearch {
    let settings = &model.config.segment;
    if grid.sample(&frame.depth, model.config.farthest) == 0 {
        return PersonSearch::default();
    }
    state.scene_age = state.scene_age.map(|a| a.saturating_add(1));
    if !state.status.is_live() && state.scene_age.is_none_or(|a| a >= settings.scene_interval) {
        let scene = find_planes(grid, &settings.planes);
        // A known floor stays known while somebody stands before it.
        if scene.floor.is_some() || state.scene_age.is_none() || state.scene.floor.is_none() {
            state.set_scene(scene, &model.config);
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
        reach: settings.reach,
        body,
    };
    let choice = if state.is_following() {
        PersonChoice::Near(prior)
    } else {
        state.refusals.age();
        hold_things(model, state, &frame.depth);
        let is_recent = matches!(state.status, Status::Lost { .. })
            && state.pose_age <= settings.recall
            && state.belief.verdict == Verdict::Person;
        let reach = settings
            .reach
            .min(settings.recent_reach + settings.walk * state.pose_age as f32);
        PersonChoice::Untried {
            refusals: &state.refusals,
            recent: is_recent.then_some(PersonPrior { reach, ..prior }),
        }
    };
    let mut person = find_person(grid, &state.scene, choice, settings, &mut workspace.segment);
    if person.cells.len() >= settings.least_cells {
        grid.refine(&frame.depth, &person.cells);
        person.cells.retain(|&c| grid.depth[c as usize] > 0.0);
        contour(grid, &person.cells, settings, &mut workspace.contour);
    }
    person
}

/// Lets things that never moved wait, and forgets those that did.
fn hold_things(model: &TrackerModel, state: &mut TrackerState, image: &DepthImage) {
    let (steps, refusals) = (&model.config.step, &model.config.segment.refusals);
    for thing in std::mem::take(&mut state.things) {
        if thing.is_still(image, steps) {
            state.refusals.hold(thing.candidate, refusals);
            state.things.push(thing);
        } else {
            state.refusals.forget(&thing.candidate, refusals);
        }
    }
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
