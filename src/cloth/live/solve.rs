//! Solve stage: explicit substeps of all patches through one interval.

use super::contact::chunk::ContactChunk;
use super::contact::pair_contact::{Block, PairContacts};
use super::garment_model::GarmentModel;
use super::outfit_model::Model;
use super::patch::{PatchWork, for_patches};
use super::solver::explicit::{Exemptions, Recovery, Substep, V4, run_substeps};
use std::ops::Range;
use tryon_geometry::par;

/// One interval of a step.
#[derive(Clone, Copy)]
pub(super) struct Interval {
    /// Length, s.
    pub(super) span: f64,
    /// Speed limit of cloth that comes to rest, m/s.
    pub(super) speed_limit: Option<f32>,
}

/// Substeps of a garment in `span` seconds.
pub(super) fn substeps(m: &GarmentModel, span: f64) -> usize {
    (span / m.h).ceil().max(1.0) as usize
}

/// Contacts of an interval.
pub(super) struct SolveContacts<'a> {
    pub(super) chunks: &'a [ContactChunk],
    pub(super) pairs: &'a mut PairContacts,
}

/// Advances all patches through an interval, block by block. Garments are independent within a block, patches of one
/// garment exchange halos.
pub(super) fn solve(
    model: &Model,
    all: &mut [PatchWork],
    contacts: SolveContacts<'_>,
    interval: Interval,
) {
    let SolveContacts { chunks, pairs } = contacts;
    let blocks = Block::count(interval.span, &model.config.contact.pairs);
    let span = (interval.span / blocks as f64) as f32;
    for index in 0..blocks {
        if index > 0 {
            pairs.advance(model, all);
        }
        let t = index as f32 * span;
        pairs.lay(model, all, chunks, Block { t, span });
        for_patches(model, all, |g, k, p| pairs.planes(model, g, k, p));
        solve_block(model, all, chunks, (interval, [index, blocks]));
    }
}

/// Advances all patches through one of some equal blocks.
fn solve_block(
    model: &Model,
    all: &mut [PatchWork],
    chunks: &[ContactChunk],
    (interval, [index, blocks]): (Interval, [usize; 2]),
) {
    let mut rest = all;
    let mut garments = Vec::with_capacity(model.garments.len());
    for m in &model.garments {
        let (own, others) = rest.split_at_mut(m.patches.len());
        garments.push((m, own));
        rest = others;
    }
    par::for_chunks(model.config.par, &mut garments, 1, |g, garment| {
        let (m, patches) = &mut garment[0];
        let n = substeps(m, interval.span);
        let solver = GarmentSolver {
            model,
            m,
            garment: g,
            chunks,
            interval,
            range: n * index / blocks..n * (index + 1) / blocks,
            h: (interval.span / n as f64) as f32,
        };
        let par = model.config.par;
        run_substeps(par, &m.patches, patches, solver.range.len(), |s, k, p| {
            solver.substep(s, k, p)
        });
    });
}

/// Substeps of one garment in an interval.
struct GarmentSolver<'a> {
    model: &'a Model,
    m: &'a GarmentModel,
    garment: usize,
    chunks: &'a [ContactChunk],
    interval: Interval,
    /// Substeps of the block among those of the interval.
    range: Range<usize>,
    /// Substep, s.
    h: f32,
}

impl GarmentSolver<'_> {
    /// Substep `s` of the block in patch `k`.
    fn substep(&self, s: usize, k: usize, p: &mut PatchWork) {
        let (f, h, every) = (&self.m.patches[k], self.h, self.m.bending_interval);
        let t = (self.range.start + s) as f32 * h;
        if s.is_multiple_of(every) {
            self.select_planes(s, k, p);
            let lookahead = h * every.min(self.range.len() - s) as f32 * 0.5;
            p.motion.update_bending(f, lookahead, self.m.filter_degree);
        }
        let [x, y, z] = self.model.config.gravity.map(|g| g as f32);
        let step = Substep {
            h,
            t,
            lookahead: self.model.config.force_lookahead as f32,
            gravity: V4::new(x, y, z),
            rings: 0,
        };
        p.motion.integrate_velocities(f, &step, &p.planes, &p.pins);
        p.motion.apply_pins(&p.pins, t, h);
        let settings = &self.model.config.solver;
        let recovery = [settings.cloth_recovery, settings.body_recovery].map(|speed| Recovery {
            share: settings.recovered,
            speed,
        });
        p.contacts = p.motion.resolve_contacts(&p.planes, [t, h], recovery);
        if let Some(limit) = self.interval.speed_limit {
            let exempt = Exemptions {
                fixed: &p.pinned,
                unlimited: &p.taut,
            };
            p.motion.limit_speed(limit, &exempt);
        }
        p.motion
            .integrate_positions(f, &step, self.model.config.max_speed);
    }

    /// Selects the planes that vertices can reach until the next selection.
    fn select_planes(&self, s: usize, k: usize, p: &mut PatchWork) {
        let steps = self.m.bending_interval.min(self.range.len() - s);
        let t = (self.range.start + s) as f32 * self.h;
        let span = steps as f32 * self.h;
        let gain = self.model.config.solver.speed_gain;
        let is_own = |c: &&ContactChunk| (c.garment, c.patch) == (self.garment, k);
        let body = self
            .chunks
            .iter()
            .filter(is_own)
            .flat_map(|c| &c.body_planes);
        (p.planes).select(&p.motion, &p.cloth_planes, body, [t, span, gain]);
    }
}
