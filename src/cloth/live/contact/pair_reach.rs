//! Distance within which features of cloth are near pairs, by the speed at which they close.

use crate::live::outfit_model::Model;
use tryon_geometry::math::V3;

/// Reach of a query, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairReach {
    at_rest: f32,
    pub(super) farthest: f32,
    /// Approach beyond what velocities say.
    slack: f32,
    /// Time until the next query, s.
    span: f32,
    longest_edge: f32,
}

impl PairReach {
    /// Reach in an outfit for a query that holds for `span` seconds; `farthest` is not less than that at rest.
    pub(super) fn new(model: &Model, [farthest, slack]: [f32; 2], span: f32) -> Self {
        let longest_edge = longest_edge(model);
        let at_rest = model.config.contact.pairs.reach_edges * longest_edge;
        Self {
            at_rest,
            farthest: farthest.max(at_rest),
            slack,
            span,
            longest_edge,
        }
    }

    /// Features may meet, of which the one moves against the other at `velocity`, m/s, to which it is `distance` metres along
    /// `normal`. What slides past by an edge before does not: half-spaces are endless and would stop it.
    pub(super) fn is_near(&self, normal: &V3, distance: f32, velocity: &V3) -> bool {
        let closing = normal.dot(velocity);
        let time = self.span.min(distance / closing.max(f32::MIN_POSITIVE));
        let sliding = (velocity - normal * closing).norm() * time;
        distance < self.at(closing) && sliding <= self.longest_edge
    }

    /// Reach of what closes at this speed, m/s.
    pub(super) fn at(&self, closing: f32) -> f32 {
        let motion = closing.max(0.0) * self.span + self.slack;
        (self.at_rest + motion).min(self.farthest)
    }
}

/// Longest of the garments' edges, metres.
pub(super) fn longest_edge(model: &Model) -> f32 {
    let edges = model.garments.iter().map(|g| g.topology.edge());
    edges.fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_are_near_that_meet_before_they_slide_past() {
        let reach = PairReach {
            at_rest: 0.01,
            farthest: 0.02,
            slack: 0.0,
            span: 0.01,
            longest_edge: 0.03,
        };
        let near = |d: f32, closing: f32, sliding: f32| {
            reach.is_near(&V3::z(), d, &V3::new(sliding, 0.0, closing))
        };
        assert!(near(0.009, 0.0, 0.0) && near(0.009, -5.0, 2.9));
        assert!(!near(0.011, 0.0, 0.0) && near(0.011, 0.5, 0.0));
        assert!(!near(0.021, 10.0, 0.0), "beyond the farthest");
        assert!(
            !near(0.009, 0.0, 3.1),
            "an edge in the time until the next query"
        );
        assert!(
            near(0.009, 4.0, 10.0) && !near(0.009, 2.0, 10.0),
            "an edge until they meet"
        );
    }
}
