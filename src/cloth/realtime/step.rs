//! One call of the real-time simulator.

use super::carry::carry;
use super::model::{GarmentModel, Model, USUAL_SUBSTEP};
use super::state::{GarmentScratch, GarmentState, Input, Outcome, State, StepReport, Workspace, check_body};
use crate::cloth::ClothError;
use crate::cloth::quasi_newton::{Hold, QuasiNewton};
use crate::contact::{Closest, SurfaceFrame};
use crate::math::{P3, V3, V3d};
use crate::par;
use std::time::Instant;

/// A surface a vertex must stay outside of during one substep.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Contact {
    /// The vertex's own parts, then the others; the own ones have the last word.
    planes: [Plane; 2],
}

#[derive(Clone, Copy, Debug, Default)]
struct Plane {
    point: V3d,
    normal: V3d,
    /// Motion of the surface at the point during the substep, metres.
    moved: V3d,
    /// Only then the rest means anything.
    near: bool,
    /// How far inertia alone would sink the vertex, metres: stands for the normal force in Coulomb's law.
    load: f64,
}

/// Surfaces further than this from a vertex cannot be reached within a substep at 3 m/s, metres.
const REACH: f64 = 0.06;
/// A vertex this much above its offset counts as touching, metres; less makes contacts flicker.
const TOUCH: f64 = 1e-3;
/// A contact plane says nothing about places further from its point than this, metres.
const PLANE_SIZE: f64 = 0.08;
/// Cloth nearer to the skin than this starts a substep moved along with it, metres.
const CARRIED: f32 = 0.03;
/// Stiffness of a contact in units of the matrix diagonal. The hold acts in all directions and follows the vertex, so
/// it slows sliding. At 2 cloth sticks where it first touches (skirts hung in folds on the thighs); in units of inertia
/// (8 m/h², a hundredth of this) the solve ignores contact, garments contract through the body and tangle.
const CONTACT_STIFFNESS: f64 = 0.04;
/// No fabric moves faster, m/s: keeps one bad frame from becoming many.
const FASTEST: f64 = 12.0;
/// Longest and shortest time step of a call, s.
const DT_RANGE: [f64; 2] = [1e-4, 0.1];
/// Longer calls are cut into more substeps, s: a chain that drops frames must not sink limbs into cloth.
const LONGEST_SUBSTEP: f64 = 1.0 / 45.0;
/// Cloth slower than this on average is still, m/s.
const STILL_SPEED: f64 = 0.02;
/// A body that has moved less than this since the cloth was last computed is still, metres.
const STILL_BODY: f32 = 1e-3;
/// Calls with everything still before the cloth falls asleep.
const STILL_FRAMES: u32 = 10;

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// Advances an outfit by `input.dt`. On an error the state is untouched; a fault during the computation keeps the last
/// good positions and says so in the report.
///
/// # Errors
/// A body of the wrong size or with a vertex that is not finite (named), a time step that is not positive.
pub fn step(
    model: &Model,
    state: &mut State,
    input: &Input<'_>,
    work: &mut Workspace,
) -> Result<StepReport, ClothError> {
    let started = Instant::now();
    check_body(model, input.body)?;
    if !(input.dt > 0.0 && input.dt.is_finite()) {
        return Err(ClothError::Field { field: "dt".into(), why: format!("{} s is not a positive time", input.dt) });
    }
    if state.garments.len() != model.garments.len() || state.body.len() != input.body.len() {
        return Err(ClothError::Count {
            what: "garments in the state",
            got: state.garments.len(),
            expected: model.garments.len(),
        });
    }
    let config = &model.config;
    let moved =
        |from: &[P3]| from.iter().zip(input.body).map(|(a, b)| (a - b).norm_squared()).fold(0.0, f32::max).sqrt();
    state.frames += 1;
    if config.sleep && state.still >= STILL_FRAMES && moved(&state.awake_body) < STILL_BODY {
        let mut report =
            StepReport { sleeping: state.garments.iter().map(|g| g.positions.len()).sum(), ..StepReport::default() };
        report.stages_ms.total = ms(started);
        return Ok(report);
    }
    // The mean, not the farthest vertex: a waving hand is no teleport, and carrying cloth costs it its folds.
    let sum: f64 = state.body.iter().zip(input.body).map(|(a, b)| f64::from((a - b).norm())).sum();
    let teleported = sum / input.body.len().max(1) as f64 > config.teleport;
    if teleported {
        for (g, m) in state.garments.iter_mut().zip(&model.garments) {
            carry(model, &m.sheet.edges, &g.nearest, &state.body, input.body, &mut g.positions);
            g.velocities.iter_mut().for_each(|v| *v = V3::zeros());
        }
        state.body.copy_from_slice(input.body);
    }
    let dt = input.dt.clamp(DT_RANGE[0], DT_RANGE[1]);
    let maps_started = Instant::now();
    work.maps.render(config.par, &model.views, input.body, model.surface.faces());
    let maps_ms = ms(maps_started);
    // The body at every substep.
    let n = config.substeps.max((dt / LONGEST_SUBSTEP).ceil() as usize);
    work.frames.resize_with(n, SurfaceFrame::default);
    work.start.vertices.clone_from(&state.body);
    for (s, frame) in work.frames.iter_mut().enumerate() {
        let t = (s + 1) as f32 / n as f32;
        par::map_into(config.par, input.body.len(), 2048, &mut frame.vertices, |i| {
            state.body[i] + (input.body[i] - state.body[i]) * t
        });
        model.surface.update_normals(config.par, frame);
    }
    let body_ms = ms(maps_started) - maps_ms;
    work.garments.resize_with(model.garments.len(), GarmentScratch::default);
    let (frames, start, maps) = (&work.frames, &work.start, &work.maps);
    let gs = &state.garments;
    par::for_chunks(config.par, &mut work.garments, 1, |k, scratch| {
        let scratch = &mut scratch[0];
        scratch.outcome = Outcome::default();
        let run = Run { model, garment: &model.garments[k], index: k, frames, start, maps, h: dt / n as f64 };
        if let Err(fault) = run.advance(&gs[k], scratch) {
            scratch.outcome.fault = Some(fault);
        }
    });
    let mut report = StepReport { teleported, ..StepReport::default() };
    let mut speed = 0.0f64;
    for (k, scratch) in work.garments.iter().enumerate() {
        let r = &scratch.outcome.report;
        report.iterations += r.iterations;
        report.residual = report.residual.max(r.residual);
        report.contacts += r.contacts;
        report.factorisations_skipped += r.factorisations_skipped;
        report.max_strain = report.max_strain.max(r.max_strain);
        report.p99_strain = report.p99_strain.max(r.p99_strain);
        report.penetration = report.penetration.max(r.penetration);
        report.penetration_left = report.penetration_left.max(r.penetration_left);
        report.stages_ms.contact += r.stages_ms.contact;
        report.stages_ms.factor += r.stages_ms.factor;
        report.stages_ms.solve += r.stages_ms.solve;
        let g = &mut state.garments[k];
        match &scratch.outcome.fault {
            Some(fault) => {
                report.kept_last_good = Some(format!("garment `{}`: {fault}", model.outfit.garments[k].name));
                g.velocities.iter_mut().for_each(|v| *v = V3::zeros());
            }
            None => {
                g.positions.iter_mut().zip(&scratch.x).for_each(|(p, x)| *p = P3::from(x.cast::<f32>()));
                g.velocities.iter_mut().zip(&scratch.velocity).for_each(|(p, v)| *p = v.cast());
                g.nearest.clone_from(&scratch.nearest);
            }
        }
        let sum: f64 = scratch.velocity.iter().map(V3d::norm_squared).sum();
        speed = speed.max((sum / scratch.velocity.len().max(1) as f64).sqrt());
    }
    state.stale = if report.kept_last_good.is_some() { state.stale + 1 } else { 0 };
    state.still = if speed < STILL_SPEED && moved(&state.awake_body) < STILL_BODY { state.still + 1 } else { 0 };
    if state.still == 0 {
        state.awake_body.copy_from_slice(input.body);
    }
    state.body.copy_from_slice(input.body);
    report.stages_ms.maps = maps_ms;
    report.stages_ms.contact += body_ms;
    report.stages_ms.total = ms(started);
    Ok(report)
}

struct Run<'a> {
    model: &'a Model,
    garment: &'a GarmentModel,
    index: usize,
    frames: &'a [SurfaceFrame],
    start: &'a SurfaceFrame,
    maps: &'a crate::contact::DepthMaps,
    h: f64,
}

impl Run<'_> {
    fn advance(&self, from: &GarmentState, w: &mut GarmentScratch) -> Result<(), ClothError> {
        let sheet = &self.garment.sheet;
        let config = &self.model.config;
        let h = self.h;
        let n = from.positions.len();
        w.x.clear();
        w.x.extend(from.positions.iter().map(|p| p.coords.cast::<f64>()));
        w.velocity.clear();
        w.velocity.extend(from.velocities.iter().map(|v| v.cast::<f64>()));
        w.nearest.clone_from(&from.nearest);
        let gravity = V3d::from(config.gravity);
        let drag = (-sheet.damping * h).exp();
        let solver = w.solver.get_or_insert_with(|| QuasiNewton::new(self.garment.symbolic.clone()));
        for s in 0..self.frames.len() {
            let frame = &self.frames[s];
            let before = if s == 0 { self.start } else { &self.frames[s - 1] };
            let timer = Instant::now();
            w.before.clone_from(&w.x);
            w.y.clear();
            for i in 0..n {
                let y = w.x[i] + w.velocity[i] * (h * drag) + gravity * (h * h);
                w.y.push(y);
                // Look for contact from where the skin would carry the vertex, so that a limb that moves past it still
                // has it on the outside.
                let v = w.nearest[i][0] as usize;
                let near = (before.vertices[v].coords - w.x[i].cast::<f32>()).norm() < CARRIED;
                w.x[i] = if near { w.x[i] + (frame.vertices[v] - before.vertices[v]).cast::<f64>() } else { y };
            }
            if s == 0 {
                self.propose(frame, &w.x, &mut w.nearest);
            }
            self.find(frame, before, &w.x, &w.y, &mut w.nearest, &mut w.contacts);
            w.outcome.report.stages_ms.contact += ms(timer);
            let timer = Instant::now();
            w.holds.clear();
            w.holds.resize(n, Hold::default());
            w.stiffness.clear();
            w.stiffness.resize(n, 0.0);
            let scale = (USUAL_SUBSTEP / h).powi(2).max(1.0); // keeps holds stiff against small steps' inertia
            for i in 0..n {
                if w.contacts[i].planes.iter().any(|p| self.gap(p, &w.x[i]) < TOUCH || self.gap(p, &w.y[i]) < TOUCH) {
                    w.stiffness[i] = CONTACT_STIFFNESS * self.garment.unit[i] * scale;
                    w.outcome.report.contacts += 1;
                }
            }
            for a in &self.model.outfit.anchors[self.index] {
                let i = a.vertex as usize;
                if a.strength > 0.0 {
                    // 0 → a hundredth of the diagonal, ½ → 1, 1 → 100.
                    w.stiffness[i] = self.garment.unit[i] * scale * 100f64.powf(2.0 * a.strength - 1.0);
                }
            }
            let made = solver.factorisations;
            solver.prepare(sheet, h, &w.stiffness)?;
            w.outcome.report.factorisations_skipped += usize::from(solver.factorisations == made);
            w.outcome.report.stages_ms.factor += ms(timer);
            let timer = Instant::now();
            for _ in 0..config.iterations {
                for i in 0..n {
                    w.x[i] = self.outside(&w.contacts[i], &w.before[i], w.x[i]);
                    w.holds[i] = Hold { target: w.x[i], stiffness: w.stiffness[i] };
                }
                for a in &self.model.outfit.anchors[self.index] {
                    if a.strength > 0.0 {
                        w.holds[a.vertex as usize].target = anchor_target(a, frame);
                    }
                }
                w.outcome.report.residual = solver.iterate(sheet, &w.y, &w.holds, &mut w.x);
                w.outcome.report.iterations += 1;
            }
            w.outcome.report.stages_ms.solve += ms(timer);
            let timer = Instant::now();
            if let Some(index) = w.x.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
                return Err(ClothError::NotFinite { what: "cloth vertex", index });
            }
            // Speed comes from the solve, not from the push-out: lifting a sunken vertex must not throw it.
            for i in 0..n {
                let v = (w.x[i] - w.before[i]) / h;
                let speed = v.norm();
                w.velocity[i] = if speed > FASTEST { v * (FASTEST / speed) } else { v };
                for p in w.contacts[i].planes.iter().rev() {
                    if self.gap(p, &w.x[i]) < TOUCH {
                        let into = p.normal.dot(&(w.velocity[i] - p.moved / h)).min(0.0);
                        w.velocity[i] -= p.normal * into;
                    }
                }
                w.x[i] = self.outside(&w.contacts[i], &w.before[i], w.x[i]);
            }
            let last = s + 1 == self.frames.len();
            let (deepest, left) = self.push_out(frame, &mut w.x, &mut w.nearest, last);
            w.outcome.report.penetration = w.outcome.report.penetration.max(deepest);
            w.outcome.report.penetration_left = left;
            w.outcome.report.stages_ms.contact += ms(timer);
        }
        let (worst, p99) = sheet.strain(&w.x);
        w.outcome.report.max_strain = worst;
        w.outcome.report.p99_strain = p99;
        Ok(())
    }

    /// Better starting points for the walks, from the depth maps.
    fn propose(&self, frame: &SurfaceFrame, x: &[V3d], nearest: &mut [[u32; 2]]) {
        let surface = &self.model.surface;
        for (i, near) in nearest.iter_mut().enumerate() {
            let p = P3::from(x[i].cast::<f32>());
            let masks = [self.garment.own[i], self.garment.other[i]];
            let mut best = near.map(|v| (frame.vertices[v as usize] - p).norm_squared());
            for face in self.maps.proposals(&p) {
                let v = surface.faces()[face as usize][0];
                let d = (frame.vertices[v as usize] - p).norm_squared();
                for k in 0..2 {
                    if d < best[k] && surface.part(v) & masks[k] != 0 {
                        best[k] = d;
                        near[k] = v;
                    }
                }
            }
        }
    }

    fn closest(&self, frame: &SurfaceFrame, x: &V3d, i: usize, k: usize, nearest: &mut [u32; 2]) -> Closest {
        let mask = if k == 0 { self.garment.own[i] } else { self.garment.other[i] };
        let c = self.model.surface.closest(frame, &P3::from(x.cast::<f32>()), nearest[k], mask);
        nearest[k] = c.vertex;
        c
    }

    fn find(
        &self,
        frame: &SurfaceFrame,
        before: &SurfaceFrame,
        x: &[V3d],
        y: &[V3d],
        nearest: &mut [[u32; 2]],
        out: &mut Vec<Contact>,
    ) {
        out.clear();
        for i in 0..x.len() {
            let mut contact = Contact::default();
            for k in 0..2 {
                let c = self.closest(frame, &x[i], i, k, &mut nearest[i]);
                if c.rim || f64::from(c.signed) > REACH {
                    continue;
                }
                let f = self.model.surface.faces()[c.face as usize];
                let was = (0..3).fold(V3::zeros(), |s, j| s + before.vertices[f[j] as usize].coords * c.weights[j]);
                let (point, normal) = (c.point.coords.cast::<f64>(), c.normal.cast::<f64>());
                contact.planes[k] = Plane {
                    point,
                    normal,
                    moved: (c.point.coords - was).cast::<f64>(),
                    near: true,
                    load: (self.garment.offset - normal.dot(&(y[i] - point))).max(0.0),
                };
            }
            out.push(contact);
        }
    }

    fn gap(&self, p: &Plane, x: &V3d) -> f64 {
        let d = x - p.point;
        if p.near && d.norm_squared() < PLANE_SIZE * PLANE_SIZE {
            p.normal.dot(&d) - self.garment.offset
        } else {
            f64::INFINITY
        }
    }

    /// The nearest allowed place: outside both planes, tangential motion reduced by friction. The other parts first,
    /// so that the vertex's own parts have the last word.
    fn outside(&self, c: &Contact, before: &V3d, mut x: V3d) -> V3d {
        for p in c.planes.iter().rev() {
            let gap = self.gap(p, &x);
            if gap < 0.0 {
                x -= p.normal * gap;
                let slip = x - before - p.moved;
                let slip = slip - p.normal * p.normal.dot(&slip);
                let length = slip.norm();
                if length > 0.0 {
                    x -= slip * (self.garment.sheet.friction * p.load / length).min(1.0);
                }
            }
        }
        x
    }

    /// Looks again and pushes every vertex to its offset. Returns the deepest penetration found and, when `check`, left.
    fn push_out(&self, frame: &SurfaceFrame, x: &mut [V3d], nearest: &mut [[u32; 2]], check: bool) -> (f64, f64) {
        let mut deepest = 0.0f64;
        let mut left = 0.0f64;
        for i in 0..x.len() {
            for k in [1, 0] {
                let c = self.closest(frame, &x[i], i, k, &mut nearest[i]);
                if c.rim {
                    continue;
                }
                let signed = f64::from(c.signed);
                if k == 0 {
                    deepest = deepest.max(-signed);
                }
                if signed < self.garment.offset {
                    x[i] = c.point.coords.cast::<f64>() + c.normal.cast::<f64>() * self.garment.offset;
                    if check && k == 0 && signed < 0.0 {
                        let again = self.closest(frame, &x[i], i, 0, &mut nearest[i]);
                        left = left.max(-f64::from(again.signed));
                    }
                }
            }
        }
        (deepest, left.max(0.0))
    }
}

fn anchor_target(a: &super::AnchorBinding, frame: &SurfaceFrame) -> V3d {
    let [p, q, r] = a.body.map(|v| frame.vertices[v as usize].coords);
    let on = p * a.weights[0] + q * a.weights[1] + r * a.weights[2];
    let normal = (q - p).cross(&(r - p)).try_normalize(0.0).unwrap_or_else(V3::zeros);
    (on + normal * a.height).cast::<f64>()
}
