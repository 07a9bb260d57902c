//! Removal of self-intersections from a draped garment.

use super::context::DrapeContext;
use super::state::{Drape, on_arms};
use super::step::QUERY_INTERVAL;
use tryon_cloth::solver::xpbd::project_distance;
use tryon_cloth::untangler::{UNTANGLE_GAP, UNTANGLE_STEP};
use tryon_geometry::par::Par;

/// Growth of a tangled vertex's slack in one iteration, and its limit (m): between two skins the offset is the only clearance.
const SLACK_STEP: f64 = 0.001;
const MAX_SLACK: f64 = 0.005;
/// Share of the slack that a vertex keeps in an iteration without intersection.
const SLACK_DECAY: f64 = 0.98;
/// Iterations between two relaxations of lengths and contacts, both of which may intersect anew.
const RELAX_INTERVAL: usize = 2;
/// Iterations with relaxation; later ones only limit stretch.
const RELAXED: usize = 10;
/// Time step of a relaxation (s).
const RELAX_STEP: f64 = 1e-3;
/// Iterations without progress before local smoothing, and most smoothings. A hood folds over itself in three layers, none of
/// which is on the wrong side.
const STUCK: usize = 16;
const MAX_SMOOTHINGS: usize = 4;
/// Depth under the skin that is allowed in later iterations (m). Deeper shows skin in the armpits of a heavy subject.
const ALLOWED_DEPTH: f64 = 0.002;
/// Stretch ratio that later iterations allow. Below 1.19 (p99) a hood in folds on the neck did not come free.
const MAX_STRETCH: f64 = 1.07;

impl Drape {
    /// One untangling iteration, which changes no velocities. A full query finds new intersections, else only the last ones
    /// are followed.
    pub(super) fn untangle(&mut self, full_query: bool) {
        let Some(untangler) = &mut self.untangler else {
            return;
        };
        if full_query {
            untangler.invalidate();
        }
        let (pinned, inverse) = (&self.pinned, &self.inverse_mass);
        let weight = |i: usize| if pinned[i].is_some() { 0.0 } else { inverse[i] };
        let r = untangler.iterate(Par::Rayon, &mut self.x, weight, UNTANGLE_STEP, UNTANGLE_GAP);
        self.crossings = r.intersections;
        for (i, (push, n)) in untangler.displacements.iter().enumerate() {
            self.before[i] += push;
            self.slack[i] = if *n > 0.0 {
                (self.slack[i] + SLACK_STEP).min(MAX_SLACK)
            } else {
                self.slack[i] * SLACK_DECAY
            };
        }
    }
    /// Untangles the sheet in at most `most` iterations on a body that stands still, and stops it if it intersected. After
    /// [`RELAXED`] iterations only overstretched edges and deep contacts move it. Without progress it is smoothed locally,
    /// in a wider circle each time. Returns the number of intersections left.
    pub(crate) fn untangle_at_rest(&mut self, context: &DrapeContext<'_>, most: usize) -> usize {
        let (mut fewest, mut since, mut smoothings) = (usize::MAX, 0, 0);
        for k in 0..most {
            self.before.clone_from(&self.x);
            self.untangle(k % QUERY_INTERVAL == 0);
            if self.crossings == 0 {
                break;
            }
            if self.crossings < fewest {
                (fewest, since) = (self.crossings, k);
            }
            if k - since > STUCK {
                if smoothings == MAX_SMOOTHINGS {
                    break;
                }
                (smoothings, since) = (smoothings + 1, k);
                self.smooth_locally(smoothings);
            }
            if k % QUERY_INTERVAL == 0 {
                self.find_planes(context);
            }
            if k >= RELAXED {
                self.limit_stretch();
                self.project_contacts(ALLOWED_DEPTH);
            } else if k % RELAX_INTERVAL == 0 {
                for backwards in [false, true] {
                    self.project_edges(RELAX_STEP, backwards);
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
    /// Contracts edges that are stretched by more than [`MAX_STRETCH`] to that.
    fn limit_stretch(&mut self) {
        for k in 0..self.edges.len() {
            let e = self.edges[k];
            let w = e.ends.map(|v| self.weight(v));
            let length = MAX_STRETCH * e.rest;
            project_distance(&mut self.x, e.ends, w, (length, length), 0.0);
        }
    }
}
