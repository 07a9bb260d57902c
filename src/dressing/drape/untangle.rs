//! Removal of self-intersections from a draped garment.

use super::context::DrapeContext;
use super::state::{Drape, on_arms};
use tryon_cloth::solver::xpbd::DistanceConstraint;
use tryon_geometry::par::Par;

impl Drape {
    /// One untangling iteration, which changes no velocities. A full query finds new intersections, else only the last ones
    /// are followed.
    pub(super) fn untangle(&mut self, full_query: bool) {
        let Some(untangler) = &mut self.untangler else {
            return;
        };
        let s = self.settings.untangle;
        let (slack_step, max_slack, slack_decay) = (s.slack_step, s.max_slack, s.slack_decay);
        if full_query {
            untangler.invalidate();
        }
        let (pinned, inverse) = (&self.pinned, &self.inverse_mass);
        let weight = |i: usize| if pinned[i].is_some() { 0.0 } else { inverse[i] };
        let r = untangler.iterate(Par::Rayon, &mut self.x, weight);
        self.crossings = r.intersections;
        for (i, (push, n)) in untangler.displacements.iter().enumerate() {
            self.before[i] += push;
            self.slack[i] = if *n > 0.0 {
                (self.slack[i] + slack_step).min(max_slack)
            } else {
                self.slack[i] * slack_decay
            };
        }
    }
    /// Untangles the sheet in at most `most` iterations on a body that stands still, and stops it if it intersected. After
    /// the relaxed iterations only overstretched edges and deep contacts move it. Without progress it is smoothed locally,
    /// in a wider circle each time. Returns the number of intersections left.
    pub(crate) fn untangle_at_rest(&mut self, context: &DrapeContext<'_>, most: usize) -> usize {
        let (settings, query_interval) = (self.settings.untangle, self.settings.query_interval);
        let (mut fewest, mut since, mut smoothings) = (usize::MAX, 0, 0);
        for k in 0..most {
            self.before.clone_from(&self.x);
            self.untangle(k % query_interval == 0);
            if self.crossings == 0 {
                break;
            }
            if self.crossings < fewest {
                (fewest, since) = (self.crossings, k);
            }
            if k - since > settings.stuck {
                if smoothings == settings.max_smoothings {
                    break;
                }
                (smoothings, since) = (smoothings + 1, k);
                self.smooth_locally(smoothings);
            }
            if k % query_interval == 0 {
                self.find_planes(context);
            }
            if k >= settings.relaxed {
                self.limit_stretch();
                self.project_contacts(settings.allowed_depth);
            } else if k % settings.relax_interval == 0 {
                for backwards in [false, true] {
                    self.project_edges(settings.relax_step, backwards);
                }
                self.project_contacts(0.0);
            }
            self.stop();
        }
        self.crossings
    }
    /// Smooths the intersecting parts and `rings` rings around them. A smoothed sleeve would pass through the arm.
    fn smooth_locally(&mut self, rings: usize) {
        self.compressed = true;
        if let Some(untangler) = &self.untangler {
            let (pinned, own) = (&self.pinned, &self.own);
            let movable = |v: usize| pinned[v].is_none() && !on_arms(own[v]);
            let intersecting = untangler.intersecting().collect();
            untangler.smooth_locally(&mut self.x, intersecting, movable, rings);
        }
    }
    /// Contracts edges that are stretched by more than the largest ratio to that.
    fn limit_stretch(&mut self) {
        let most = self.settings.untangle.max_stretch;
        for k in 0..self.edges.len() {
            let e = self.edges[k];
            let w = e.ends.map(|v| self.weight(v));
            let length = most * e.rest;
            let edge = DistanceConstraint {
                ends: e.ends,
                length,
                least: length,
                compliance: 0.0,
            };
            edge.project(&mut self.x, w);
        }
    }
}
