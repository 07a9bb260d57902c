//! Contact of one step: candidates that cover the motion of the iteration, barrier, lagged friction, largest free step.

use super::newton::NewtonSystem;
use crate::contact::broad_phase::{BroadPhase, ContactSweep};
use crate::contact::ccd::{StepMotion, first_impact};
use crate::contact::{
    ActivePair, Barrier, ContactAssembly, ContactElement, ContactMesh, ContactPair, Friction,
    FrictionPair,
};
use crate::settings::ContactSettings;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tryon_geometry::linear::{BlockMatrix, BlockPattern, LinearError};
use tryon_geometry::math::V3d;
use tryon_geometry::par::{Par, map_into};

/// Pairs that one thread takes at a time.
const PAIRS: usize = 1024;

impl ContactSettings {
    /// Barrier of these settings.
    pub(super) fn barrier(&self) -> Barrier {
        Barrier {
            stiffness: self.stiffness,
            activation: self.activation,
            thickness: self.thickness,
        }
    }
}

/// Work of contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ContactReport {
    /// Broad-phase queries.
    pub queries: usize,
    /// Queries that were skipped, because the candidates covered the motion.
    pub reused: usize,
    /// Candidates of the largest query.
    pub candidates: usize,
    /// Most pairs in reach of the barrier.
    pub in_reach: usize,
}

/// Box of a vertex over a query, seen from the mean motion of all.
#[derive(Clone, Copy, Debug, Default)]
struct SweptBox {
    low: V3d,
    high: V3d,
}

/// Contact pairs around the present iterate.
#[derive(Debug)]
pub(super) struct Contacts {
    mesh: ContactMesh,
    settings: ContactSettings,
    par: Par,
    broad_phase: BroadPhase,
    boxes: Vec<SweptBox>,
    /// Mean position at the start of the query (m).
    start_mean: V3d,
    /// Positions at the step's begin (m): their edge lengths decide how parallel edges are mollified throughout the step.
    step_start: Vec<V3d>,
    candidates: Vec<ContactPair>,
    pairs: Vec<ActivePair>,
    assembly: ContactAssembly,
    friction: Friction,
    friction_pairs: Vec<FrictionPair>,
    /// Vertices that sleep; empty for none. Pairs of these alone are no candidates.
    asleep: Vec<bool>,
    pub(super) report: ContactReport,
}

impl Contacts {
    pub(super) fn new(mesh: ContactMesh, settings: ContactSettings, par: Par) -> Self {
        Self {
            mesh,
            settings,
            par,
            broad_phase: BroadPhase::default(),
            boxes: Vec::new(),
            start_mean: V3d::zeros(),
            step_start: Vec::new(),
            candidates: Vec::new(),
            pairs: Vec::new(),
            assembly: ContactAssembly::default(),
            friction: Friction {
                coefficient: settings.friction,
                slip: 1.0,
            },
            friction_pairs: Vec::new(),
            asleep: Vec::new(),
            report: ContactReport::default(),
        }
    }

    /// Forgets the candidates, so that a frame's bits do not depend on the frames before.
    pub(super) fn forget(&mut self) {
        self.boxes.clear();
    }

    /// Wakes vertices in reach of others that are awake, at positions `x`.
    pub(super) fn wake(&mut self, x: &[V3d], asleep: &mut [bool]) {
        self.asleep.clear();
        self.step_start = x.to_vec();
        self.forget();
        self.cover(x, x);
        let barrier = self.settings.barrier();
        let near = (self.assembly).within_reach(self.par, &barrier, x, &self.pairs);
        let stencils = near.iter().map(|a| a.pair.stencil());
        let touched = stencils.filter(|v| v.iter().any(|v| !asleep[*v as usize]));
        let woken: Vec<u32> = touched.flatten().collect();
        woken.into_iter().for_each(|v| asleep[v as usize] = false);
    }

    /// Leaves pairs of vertices that sleep out of the candidates from now on; empty for none.
    pub(super) fn leave_out(&mut self, asleep: &[bool]) {
        self.asleep = asleep.to_vec();
        self.forget();
    }

    /// Lags friction at the start `x` of a step of `h` (s).
    pub(super) fn begin_step(&mut self, x: &[V3d], h: f64) {
        self.step_start = x.to_vec();
        if !self.cover(x, x) {
            self.list_pairs();
        }
        self.friction.slip = (self.settings.creep * h).min(self.settings.slip);
        self.friction_pairs.clear();
        if self.settings.friction > 0.0 {
            let barrier = self.settings.barrier();
            let near = (self.assembly).within_reach(self.par, &barrier, x, &self.pairs);
            self.friction_pairs.extend(near.iter().filter_map(|a| {
                let corners = a.pair.corners(x);
                FrictionPair::lagged(a, &barrier, &corners, &corners)
            }));
        }
    }

    /// Makes the candidates hold every pair that comes within reach while each vertex moves straight from `x` to `end`;
    /// true if that took a query.
    fn cover(&mut self, x: &[V3d], end: &[V3d]) -> bool {
        let margin = self.settings.margin;
        if self.covers(x) && self.covers(end) {
            self.report.reused += 1;
            return false;
        }
        let reach = self.settings.barrier().reach() + 2.0 * margin;
        let sweep = ContactSweep {
            start: x,
            end,
            distance: reach,
            obstacle_distance: reach,
        };
        self.candidates = self.broad_phase.candidates(&self.mesh, &sweep, self.par);
        if !self.asleep.is_empty() {
            let asleep = &self.asleep;
            let is_awake = |v: &u32| !asleep[*v as usize];
            self.candidates.retain(|p| p.stencil().iter().any(is_awake));
        }
        self.list_pairs();
        self.start_mean = mean_of(x);
        let shift = mean_of(end) - self.start_mean;
        self.boxes.clear();
        self.boxes.extend(x.iter().zip(end).map(|(a, b)| SweptBox {
            low: a.inf(&(b - shift)),
            high: a.sup(&(b - shift)),
        }));
        self.report.queries += 1;
        self.report.candidates = self.report.candidates.max(self.candidates.len());
        true
    }

    /// Makes pairs of the candidates, the same at any point of a step.
    fn list_pairs(&mut self) {
        let (candidates, start) = (&self.candidates, &self.step_start);
        map_into(self.par, candidates.len(), PAIRS, &mut self.pairs, |k| {
            ActivePair::new(candidates[k], start)
        });
    }

    /// True if each vertex of `x`, less the mean motion since the query, is within the margin of its box: then every pair
    /// in reach is a candidate, and so it is anywhere between two such points, for boxes are convex.
    fn covers(&self, x: &[V3d]) -> bool {
        let shift = mean_of(x) - self.start_mean;
        let margin = self.settings.margin;
        let inside = |(c, p): (&SweptBox, &V3d)| {
            let p = p - shift;
            (0..3).all(|d| p[d] >= c.low[d] - margin && p[d] <= c.high[d] + margin)
        };
        self.boxes.len() == x.len() && self.boxes.iter().zip(x).all(inside)
    }

    /// Energy of contact and friction (J) at a point that [`Self::free_share`] or [`Self::assemble`] has covered.
    pub(super) fn value(&mut self, x: &[V3d]) -> f64 {
        let barrier = self.settings.barrier();
        let pressed = self
            .assembly
            .barrier_value(self.par, &barrier, x, &self.pairs);
        let rubbed =
            self.assembly
                .friction_value(self.par, &self.friction, x, &self.friction_pairs);
        pressed + rubbed
    }

    /// Springs across gaps, which keep their width, replacing the contact matrix of `out`: stiff where features touch, none
    /// at `reach` (m) between cloth and obstacle, at the barrier's between cloth and cloth. They shape a first guess only.
    pub(super) fn keep_gaps(
        &mut self,
        x: &[V3d],
        reach: f64,
        out: &mut NewtonSystem,
    ) -> Result<(), LinearError> {
        let own_reach = self.settings.barrier().reach();
        let stiffness = self.settings.gap_stiffness;
        let reach = reach.min(self.settings.gap_reach).max(own_reach);
        let sweep = ContactSweep {
            start: x,
            end: x,
            distance: own_reach,
            obstacle_distance: reach,
        };
        let near = self.broad_phase.candidates(&self.mesh, &sweep, self.par);
        let cloth = self.mesh.cloth_vertices() as u32;
        let spring = |pair: &ContactPair| {
            let vertices = pair.stencil();
            let is_own = vertices.iter().all(|v| *v < cloth);
            let range = if is_own { own_reach } else { reach };
            let corners = pair.corners(x);
            if pair.box_gap_squared(&corners) >= range * range {
                return None;
            }
            let separation = pair.separation(&corners);
            let distance = separation.squared.sqrt();
            // Weighted directions: the gap's change by the motion of each vertex.
            let across = separation.vector / distance.max(f64::MIN_POSITIVE);
            let strength = (stiffness * (1.0 - distance / range)).max(0.0).sqrt();
            let rates = [0, 1, 2, 3].map(|k| across * (separation.weights[k] * strength));
            (strength > 0.0).then_some((vertices, rates))
        };
        let mut springs: Vec<Option<([u32; 4], [V3d; 4])>> = Vec::new();
        map_into(self.par, near.len(), PAIRS, &mut springs, |k| {
            spring(&near[k])
        });
        let springs: Vec<([u32; 4], [V3d; 4])> = springs.into_iter().flatten().collect();
        out.contact = zeros_on(x.len(), springs.iter().map(|(v, _)| *v))?;
        for (v, rates) in &springs {
            for (a, p) in v.iter().zip(rates) {
                for (b, q) in v.iter().zip(rates) {
                    if let Some(slot) = out.contact.pattern().slot(*a, *b) {
                        *out.contact.block_mut(slot) += p * q.transpose();
                    }
                }
            }
        }
        Ok(())
    }

    /// Adds contact and friction at `x` to `out`, whose contact matrix is replaced.
    pub(super) fn assemble(
        &mut self,
        x: &[V3d],
        out: &mut NewtonSystem,
    ) -> Result<(), LinearError> {
        self.cover(x, x);
        let (par, barrier) = (self.par, self.settings.barrier());
        let near = self.assembly.within_reach(par, &barrier, x, &self.pairs);
        self.report.in_reach = self.report.in_reach.max(near.len());
        let pressed = near.iter().map(|a| a.pair.stencil());
        let rubbed = self.friction_pairs.iter().map(|p| p.vertices);
        out.contact = zeros_on(x.len(), pressed.chain(rubbed))?;
        let (friction, rubbing) = (&self.friction, &self.friction_pairs);
        let mut add = |e: &ContactElement| add_element(e, out);
        self.assembly
            .for_each_barrier(par, &barrier, x, &near, &mut add);
        self.assembly
            .for_each_friction(par, friction, x, rubbing, add);
        Ok(())
    }

    /// Largest share of `direction` without impact, at most 1; covers the segment for [`Self::value`].
    pub(super) fn free_share(&mut self, x: &[V3d], direction: &[V3d]) -> f64 {
        let end: Vec<V3d> = x.iter().zip(direction).map(|(x, p)| x + p).collect();
        self.cover(x, &end);
        let motion = StepMotion {
            start: x,
            end: &end,
            min_separation: self.settings.thickness,
        };
        let impact = first_impact(&self.candidates, &motion, self.par);
        impact.map_or(1.0, |i| i.time * self.settings.impact_share)
    }
}

/// Zero matrix of `size` rows on the pairs of vertices that share a stencil.
fn zeros_on(
    size: usize,
    stencils: impl Iterator<Item = [u32; 4]>,
) -> Result<BlockMatrix, LinearError> {
    let pairs = stencils.flat_map(|v| (0..4).flat_map(move |i| (0..i).map(move |j| (v[i], v[j]))));
    let pattern = BlockPattern::new(size, pairs)?;
    Ok(BlockMatrix::zeros(Arc::new(pattern)))
}

/// Mean position (m).
fn mean_of(x: &[V3d]) -> V3d {
    x.iter().sum::<V3d>() / x.len().max(1) as f64
}

fn add_element(element: &ContactElement, out: &mut NewtonSystem) {
    let (v, energy) = (&element.vertices, &element.energy);
    out.value += energy.value;
    for i in 0..4 {
        out.gradient[v[i] as usize] += energy.gradient.fixed_rows::<3>(3 * i);
        for j in 0..4 {
            if let Some(slot) = out.contact.pattern().slot(v[i], v[j]) {
                *out.contact.block_mut(slot) += energy.hessian.fixed_view::<3, 3>(3 * i, 3 * j);
            }
        }
    }
}
