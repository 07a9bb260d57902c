//! Solve stage: explicit substeps of all patches through one interval.

use super::contact::chunk::ContactChunk;
use super::garment_model::GarmentModel;
use super::outfit_model::Model;
use super::patch::PatchWork;
use super::solver::explicit::{Exemptions, FoldLimit, Substep, V4, run_substeps};
use tryon_geometry::par;

/// Speed at which cloth below the skin comes out, m/s; faster, a body that closes on itself throws it.
const BODY_RECOVERY: f32 = 1.0;
/// The same for cloth on the wrong side of cloth, where the body may be in the way.
const CLOTH_RECOVERY: f32 = 0.3;
/// Evaluations of bending between two selections of the contact planes within reach.
const PLANE_INTERVAL: usize = 2;

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

/// Advances all patches through an interval. Garments are independent, patches of one garment exchange halos.
pub(super) fn solve(
    model: &Model,
    all: &mut [PatchWork],
    chunks: &[ContactChunk],
    interval: Interval,
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
            substeps: n,
            h: (interval.span / n as f64) as f32,
        };
        let par = model.config.par;
        run_substeps(par, &m.patches, patches, n, |s, k, p| {
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
    substeps: usize,
    /// Substep, s.
    h: f32,
}

impl GarmentSolver<'_> {
    /// Substep `s` of patch `k`.
    fn substep(&self, s: usize, k: usize, p: &mut PatchWork) {
        let (f, h, every) = (&self.m.patches[k], self.h, self.m.bending_interval);
        let t = s as f32 * h;
        if s.is_multiple_of(PLANE_INTERVAL * every) {
            self.select_planes(s, k, p);
        }
        if s.is_multiple_of(every) {
            let lookahead = h * every.min(self.substeps - s) as f32 * 0.5;
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
        FoldLimit::apply(&p.fold_limits, &mut p.motion, h);
        // The body has the last word.
        let (body, cloth) = p.planes.split_at(p.body_planes);
        p.motion.resolve_contacts(cloth, t, h, CLOTH_RECOVERY);
        p.contacts = p.motion.resolve_contacts(body, t, h, BODY_RECOVERY);
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
        let steps = (PLANE_INTERVAL * self.m.bending_interval).min(self.substeps - s);
        let (t, span) = (s as f32 * self.h, steps as f32 * self.h);
        let is_own = |c: &&ContactChunk| (c.garment, c.patch) == (self.garment, k);
        let (motion, planes) = (&p.motion, &mut p.planes);
        planes.clear();
        for c in self.chunks.iter().filter(is_own) {
            motion.find_reachable(&c.body_planes, t, span, planes);
        }
        p.body_planes = planes.len();
        for c in self.chunks.iter().filter(is_own) {
            motion.find_reachable(&c.cloth_planes, t, span, planes);
        }
    }
}
