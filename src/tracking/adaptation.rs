//! Second half of a step: displacements of the surface, when they are due (paper, section 3.3).
//!
//! Apart from the pose, so that a service publishes the pose first: the displacements are for the next frame.

use super::state::TrackerState;
use super::workspace::Workspace;
use crate::fit::{FitContext, pair};
use crate::model::TrackerModel;
use crate::registration::Observation;
use crate::shape::fit_displacements;

/// Adapts the displacements to the frame of the last [`follow`](super::follow) with the same state and workspace, when
/// they are due; the number of updated vertices. The interval doubles while they hardly change.
pub fn adapt_surface(
    model: &TrackerModel,
    state: &mut TrackerState,
    workspace: &mut Workspace,
) -> usize {
    let settings = &model.config.shape.surface;
    let Some((cells, grid)) = workspace.surface_cells.take().zip(workspace.grid.as_ref()) else {
        return 0;
    };
    workspace.body.update(model, &state.shape);
    let tree = model.point_tree(grid, &cells);
    let observation = Observation {
        grid,
        cells: &cells,
        false_edges: &workspace.contour.false_edges,
        true_edges: &workspace.contour.true_edges,
        tree: tree.as_ref(),
    };
    let context = FitContext {
        model,
        body: &workspace.body,
        observation: &observation,
    };
    let scratch = &mut workspace.fit;
    pair(&context, &state.pose, settings.pair_distance, 0.0, scratch);
    let (updated, change) = fit_displacements(
        &context,
        scratch,
        &mut state.shape.displacements,
        &mut state.surface,
        &mut workspace.surface,
    );
    let config = &model.config;
    let [wait, interval] = &mut state.surface_due;
    *interval = if change < settings.settled {
        (*interval * 2).min(settings.longest_interval)
    } else {
        config.displacement_interval.max(1)
    };
    *wait = *interval;
    updated
}
