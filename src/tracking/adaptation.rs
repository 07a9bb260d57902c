//! Second half of a step: displacements of the surface, when they are due (paper, section 3.3).
//!
//! Apart from the pose, so that a service publishes the pose first: the displacements are for the next frame.

use super::state::TrackerState;
use super::workspace::Workspace;
use crate::fit::{FitContext, pair};
use crate::model::TrackerModel;
use crate::registration::Observation;
use crate::shape::fit_displacements;

/// Longest pair when the body is drawn for displacements, metres (paper, section 3.3).
const DISPLACEMENT_DISTANCE: f32 = 0.05;
/// Root mean square change below which displacements have settled, metres.
const SETTLED_DISPLACEMENT: f32 = 0.4e-3;
/// Longest interval between updates of settled displacements, frames.
const LONGEST_INTERVAL: u32 = 24;

/// Adapts the displacements to the frame of the last [`follow`](super::follow) with the same state and workspace, when
/// they are due; the number of updated vertices. The interval doubles while they hardly change.
pub fn adapt_surface(
    model: &TrackerModel,
    state: &mut TrackerState,
    workspace: &mut Workspace,
) -> usize {
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
    pair(&context, &state.pose, DISPLACEMENT_DISTANCE, 0.0, scratch);
    let (updated, change) = fit_displacements(
        &context,
        scratch,
        &mut state.shape.displacements,
        &mut state.surface,
        &mut workspace.surface,
    );
    let config = &model.config;
    let [wait, interval] = &mut state.surface_due;
    *interval = if config.skip_settled && change < SETTLED_DISPLACEMENT {
        (*interval * 2).min(LONGEST_INTERVAL)
    } else {
        config.displacement_interval.max(1)
    };
    *wait = *interval;
    updated
}
