//! One step of the real-time simulator: filter → collide → solve → commit → sleep.

use super::collide::{CollideInterval, collide};
use super::commit::commit;
use super::contact::chunk::split;
use super::contact::skin_projection::SkinProjection;
use super::error::ClothError;
use super::outfit_model::Model;
use super::patch::{begin, for_patches};
use super::repair::teleport::Teleport;
use super::report::StepReport;
use super::sleep::{
    BodyStep, follow_asleep, follow_sleeping, is_body_still, put_islands_to_sleep,
    update_stillness, wake_islands,
};
use super::solve::{Interval, SolveContacts, solve, substeps};
use super::state::State;
use super::workspace::Workspace;
use crate::contact::MapView;
use std::time::Instant;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::par;

/// Input of a step.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    /// Posed body, world (y up), metres; shape `[body vertices]`. Its velocity follows from the previous step.
    pub body: &'a [P3],
    /// Time since the previous step, s.
    pub dt: f64,
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// Advances an outfit by `input.dt`. A fault during the computation keeps the last good positions and is reported.
///
/// # Errors
/// A body of the wrong size or with a vertex that is not finite (named), a time step that is not positive. The state is
/// untouched then.
pub fn step(
    model: &Model,
    state: &mut State,
    input: &Input<'_>,
    work: &mut Workspace,
) -> Result<StepReport, ClothError> {
    check(model, state, input)?;
    let started = Instant::now();
    let (collision, dt) = (&model.collision, input.dt);
    state
        .body
        .filter(collision, input.body, dt, &mut work.collision);
    if let Some(mut report) = follow_asleep(model, state, &mut work.collision) {
        report.stages_ms.total = ms(started);
        return Ok(report);
    }
    work.body.before.clone_from(state.body.frame());
    state.body.separate(collision, &mut work.collision);
    let mut report = StepReport {
        softened: 1.0,
        ..StepReport::default()
    };
    let mut awake = AwakeStep::begin(model, state, work, dt);
    awake.repair(&mut report);
    awake.refresh_body(&mut report);
    report.stages_ms.contact = ms(started) - report.stages_ms.maps;
    for interval in 0..awake.intervals {
        let timer = Instant::now();
        awake.collide(interval);
        report.stages_ms.contact += ms(timer);
        let timer = Instant::now();
        awake.solve();
        report.stages_ms.solve += ms(timer);
    }
    let timer = Instant::now();
    awake.project();
    report.stages_ms.contact += ms(timer);
    let timer = Instant::now();
    awake.commit_and_sleep(&mut report);
    report.stages_ms.solve += ms(timer);
    report.stages_ms.total = ms(started);
    Ok(report)
}

fn check(model: &Model, state: &State, input: &Input<'_>) -> Result<(), ClothError> {
    model.collision.check(input.body)?;
    if !(input.dt > 0.0 && input.dt.is_finite()) {
        let why = format!("{} s is not a positive time", input.dt);
        return Err(ClothError::field("dt", &why));
    }
    let body = state.body.vertices().len();
    if state.garments.len() != model.garments.len() || body != input.body.len() {
        return Err(ClothError::Count {
            what: "garments in the state",
            got: state.garments.len(),
            expected: model.garments.len(),
        });
    }
    Ok(())
}

/// A step of an outfit that does not sleep as a whole, after its body has been filtered and separated.
struct AwakeStep<'a> {
    model: &'a Model,
    state: &'a mut State,
    work: &'a mut Workspace,
    /// Length of the step, clamped, s.
    dt: f64,
    /// The body is still.
    is_still: bool,
    teleported: bool,
    /// Fastest body vertex, m/s.
    fastest: f32,
    /// Contact intervals and their length, s.
    intervals: usize,
    span: f64,
}

impl<'a> AwakeStep<'a> {
    /// Stillness and motion of the body from `work.body.before` to the body of the state.
    fn begin(model: &'a Model, state: &'a mut State, work: &'a mut Workspace, dt: f64) -> Self {
        let (from, to) = (&work.body.before.vertices, state.body.vertices());
        let (config, time) = (&model.config, &model.config.time);
        let is_still = is_body_still(config, &state.sleep, &state.garments, to);
        // The mean: a waving hand is no teleport, and reskinning costs cloth its folds.
        let moved = from.iter().zip(to).map(|(a, b)| (a - b).norm());
        let mean = moved.map(f64::from).sum::<f64>() / to.len().max(1) as f64;
        let teleported = mean > config.teleport;
        let dt = dt.clamp(time.range[0], time.range[1]);
        let fastest = if teleported {
            0.0
        } else {
            let squares = from.iter().zip(to).map(|(a, b)| (a - b).norm_squared());
            squares.fold(0.0, f32::max).sqrt() / dt as f32
        };
        let interval = if fastest < time.calm_speed {
            time.calm_interval
        } else {
            time.contact_interval
        };
        let intervals = (dt / interval - time.interval_slack).ceil().max(1.0) as usize;
        state.frames += 1;
        let sleep = &mut state.sleep;
        sleep.still_time = if is_still { sleep.still_time + dt } else { 0.0 };
        Self {
            model,
            state,
            work,
            dt,
            is_still,
            teleported,
            fastest,
            intervals,
            span: dt / intervals as f64,
        }
    }

    /// Reskins cloth of a body that teleported, and wakes islands.
    fn repair(&mut self, report: &mut StepReport) {
        let Self {
            model, state, work, ..
        } = self;
        let before = &mut work.body.before;
        if self.teleported {
            let teleport = Teleport {
                joint_vertices: model.config.repair.joint_vertices,
                weights: &model.weights,
                joints: model.joints,
                from: &before.vertices,
                to: state.body.vertices(),
            };
            for (g, m) in state.garments.iter_mut().zip(&model.garments) {
                teleport.reskin(&m.sheet.edges, &g.nearest, &mut g.positions);
                g.velocities.iter_mut().for_each(|v| *v = V3::zeros());
            }
            before.vertices.copy_from_slice(state.body.vertices());
            before.normals.clear();
        }
        let motion = BodyStep {
            from: &before.vertices,
            dt: self.dt,
            teleported: self.teleported,
        };
        wake_islands(model, state, &motion);
        let surface = model.collision.surface();
        if before.normals.len() != before.vertices.len() {
            surface.update_normals(model.config.par, before);
        }
        report.teleported = self.teleported;
    }

    /// Renders depth maps, untangles garments, completes the collision body, and splits the patches into chunks.
    fn refresh_body(&mut self, report: &mut StepReport) {
        let views = self.due_views();
        let Self {
            model, state, work, ..
        } = self;
        let Workspace {
            maps,
            body: motion,
            collision,
            skin_grid,
            untangle,
            ..
        } = &mut **work;
        let (par, dt) = (model.config.par, self.dt);
        let mut body = std::mem::take(&mut state.body);
        motion.now.vertices.clone_from(&body.frame().vertices);
        ((report.stages_ms.maps, report.crossings), report.buried) = par::join(
            par,
            || {
                let timer = Instant::now();
                let faces = model.collision.surface().faces();
                maps.render(par, views, &motion.now.vertices, faces);
                let rendered = ms(timer);
                (
                    rendered,
                    untangle.untangle_due(model, state, &motion.before, dt),
                )
            },
            || {
                let interior = body.refresh(&model.collision, collision);
                skin_grid.fill(model.collision.surface(), body.frame());
                interior
            },
        );
        state.body = body;
        begin(model, state, &mut work.patches);
        split(model, state, &mut work.chunks);
    }

    /// Views of the depth maps in turn, all of them after a teleport: maps only seed the contact queries.
    fn due_views(&self) -> &'a [MapView] {
        let all = &self.model.views;
        let wanted = if self.teleported {
            all.len()
        } else {
            ((self.dt * self.model.config.time.maps_per_second).round() as usize)
                .clamp(1, all.len())
        };
        let turn = self.state.frames as usize % all.len().div_ceil(wanted);
        all.chunks(wanted).nth(turn).unwrap_or_default()
    }

    fn collide(&mut self, index: usize) {
        let interval = CollideInterval {
            index,
            count: self.intervals,
            span: self.span as f32,
            dt: self.dt as f32,
            fastest: self.fastest,
        };
        collide(self.model, self.state, self.work, interval);
    }

    fn solve(&mut self) {
        let (sleep, settings) = (self.model.config.sleep, &self.model.config.stillness);
        let still_time = self.state.sleep.still_time;
        let interval = Interval {
            span: self.span,
            speed_limit: settings.speed_limit_after(still_time).filter(|_| sleep),
        };
        let work = &mut *self.work;
        let contacts = SolveContacts {
            chunks: &work.chunks,
            pairs: &mut work.pairs,
        };
        solve(self.model, &mut work.patches, contacts, interval);
    }

    /// Projects cloth that is below the skin at the end of the step.
    fn project(&mut self) {
        let work = &mut *self.work;
        let projection = SkinProjection {
            model: self.model,
            body: &self.state.body,
            grid: &work.skin_grid,
            since_query: self.span as f32,
        };
        let patches = &work.patches;
        par::for_chunks(self.model.config.par, &mut work.chunks, 1, |_, c| {
            let c = &mut c[0];
            projection.project(&patches[c.at], c);
        });
        for c in &work.chunks {
            let displacement = &mut work.patches[c.at].motion.displacement;
            for (i, moved) in &c.projected {
                displacement[*i as usize] = *moved;
            }
        }
    }

    /// Commits positions, and puts still cloth to sleep.
    fn commit_and_sleep(&mut self, report: &mut StepReport) {
        let Self {
            model,
            state,
            work,
            dt,
            ..
        } = self;
        let dt = *dt;
        for_patches(model, &mut work.patches, |_, _, p| follow_sleeping(p, dt));
        let speed = commit(model, state, work, dt, report);
        report.cloth_contacts = work.pairs.len();
        let steps = |g| self.intervals * substeps(g, self.span);
        report.steps = model.garments.iter().map(steps).max().unwrap_or(0);
        report.speed = f64::from(speed);
        report.sleeping = state.sleep.sleeping(&model.garments);
        if report.kept_last_good.is_some() {
            state.sleep.wake_all();
            state.stale += 1;
        } else {
            put_islands_to_sleep(model, state, &work.patches, dt);
            state.stale = 0;
        }
        update_stillness(model, state, self.is_still, speed);
    }
}
