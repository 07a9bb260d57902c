//! Solve stage: explicit substeps of all patches through one interval.

use super::contact::chunk::ContactChunk;
use super::garment_model::GarmentModel;
use super::outfit_model::Model;
use super::patch::PatchWork;
use super::solver::explicit::{
    ContactPlane, Exemptions, FoldLimit, PatchState, Recovery, Substep, V4, run_substeps,
};
use tryon_geometry::par;

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
        let settings = &self.model.config.solver;
        FoldLimit::apply(&p.fold_limits, &mut p.motion, h, &settings.folds);
        // The body has the last word.
        let (body, cloth) = p.planes.split_at(p.body_planes);
        let recovery = |speed| Recovery {
            share: settings.recovered,
            speed,
        };
        p.motion
            .resolve_contacts(cloth, t, h, recovery(settings.cloth_recovery));
        p.contacts = (p.motion).resolve_contacts(body, t, h, recovery(settings.body_recovery));
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
        let gain = self.model.config.solver.speed_gain;
        let reach = |motion: &PatchState, planes: &[ContactPlane], out: &mut Vec<_>| {
            motion.find_reachable(planes, [t, span], gain, out);
        };
        let is_own = |c: &&ContactChunk| (c.garment, c.patch) == (self.garment, k);
        let (motion, planes) = (&p.motion, &mut p.planes);
        planes.clear();
        for c in self.chunks.iter().filter(is_own) {
            reach(motion, &c.body_planes, planes);
        }
        p.body_planes = planes.len();
        for c in self.chunks.iter().filter(is_own) {
            reach(motion, &c.cloth_planes, planes);
        }
    }
}
