//! Distance within which features of cloth are near pairs, by the speed at which they close.

use crate::live::outfit_model::Model;

/// Reach of a query, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairReach {
    at_rest: f32,
    pub(super) farthest: f32,
    /// Approach beyond what velocities say.
    slack: f32,
    /// Time until the next query, s.
    span: f32,
}

impl PairReach {
    /// Reach in an outfit for a query that holds for `span` seconds; `farthest` is not less than that at rest.
    pub(super) fn new(model: &Model, [farthest, slack]: [f32; 2], span: f32) -> Self {
        let at_rest = model.config.contact.pairs.reach_edges * longest_edge(model);
        Self {
            at_rest,
            farthest: farthest.max(at_rest),
            slack,
            span,
        }
    }

    /// Reach of what closes at this speed, m/s.
    pub(super) fn at(&self, closing: f32) -> f32 {
        let motion = closing.max(0.0) * self.span + self.slack;
        (self.at_rest + motion).min(self.farthest)
    }
}

/// Longest of the garments' edges, metres.
pub(super) fn longest_edge(model: &Model) -> f32 {
    let edges = model.garments.iter().map(|g| g.self_contact.edge());
    edges.fold(0.0, f32::max)
}
