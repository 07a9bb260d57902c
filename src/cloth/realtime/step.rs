//! One call of the real-time simulator.

use super::carry::{carry, put_back, ride};
use super::cloth_touch::{ClothTouch, sheets};
use super::finish::finish;
use super::model::{Model, RECALLED};
use super::piece::{Piece, cut};
use super::regions::{carry_on, fall_asleep, wake, wake_all};
use super::state::{Input, PatchScratch, State, StepReport, Workspace, check_body};
use super::steady::follow;
use super::still::{coming_to_rest, is_quiet, sleeps_on};
use super::touch::{Settled, Touch, anchors, settle};
use crate::cloth::ClothError;
use crate::cloth::solver::explicit::{Exemptions, FoldLimit, Substep, V4, run_substeps};
use crate::math::{P3, V3};
use crate::par::{self, Par};
use std::time::Instant;

/// No fabric moves faster, m/s: keeps one bad frame from becoming many.
const FASTEST: f32 = 12.0;
/// Longest and shortest time step of a call, s.
const DT_RANGE: [f64; 2] = [1e-4, 0.1];
/// Time between two searches for contacts, s: at 3 m/s a limb moves 25 mm, half of what a search reaches.
const SEARCH: f64 = 1.0 / 120.0;
/// The same for a body none of which is faster than [`CALM`]: half as often.
const CALM_SEARCH: f64 = 1.0 / 60.0;
/// m/s.
const CALM: f32 = 1.0;
/// Depth maps of the body that are drawn in a second: each of four directions 15 times. Twice as many cost time and keep
/// cloth no higher (docs/benchmarks.md).
const VIEWS: f64 = 60.0;
/// Cloth of which 95 % is slower than this is still, m/s.
const STILL_SPEED: f32 = 0.02;
/// The same on a body that trembles: a skirt that is shaken by a millimetre swings at 0.04 to 0.13 m/s, m/s.
const TREMBLING_SPEED: f32 = 0.15;
/// Calls with everything still before the cloth falls asleep.
const STILL_FRAMES: u32 = 10;

/// Sunken cloth comes out of the body at this speed at most, m/s: faster, and a body that closes on itself throws it.
const RECOVERY: f32 = 1.0;
/// The same for cloth in cloth, where the body may be in the way.
const CLOTH_RECOVERY: f32 = 0.3;

/// Cloth longer than this, over its rest length, may fold as sharply as it must and move as fast on a still body: held open in an armpit, sleeves of 3 cm
/// edges tore (p99 0.26 instead of 0.16).
const DRAWN: f32 = 1.15;
/// Cloth longer than this, over its rest length, is about to tear: more than knitwear is worn at.
const TORN: f32 = 1.5;

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
    check_body(model, input.body)?;
    if !(input.dt > 0.0 && input.dt.is_finite()) {
        return Err(ClothError::Field {
            field: "dt".into(),
            why: format!("{} s is not a positive time", input.dt),
        });
    }
    if state.garments.len() != model.garments.len() || state.body.len() != input.body.len() {
        return Err(ClothError::Count {
            what: "garments in the state",
            got: state.garments.len(),
            expected: model.garments.len(),
        });
    }
    let started = Instant::now();
    let mut followed = std::mem::take(&mut work.followed);
    let known = state.followed.len() == input.body.len();
    followed.clone_from(if known { &state.followed } else { &state.body });
    follow(
        model.config.par,
        &mut followed,
        input.body,
        model.config.steady,
        input.dt,
    );
    let mut roomy = std::mem::take(&mut work.roomy);
    if let Some(mut report) = ride_asleep(model, state, &followed, &mut roomy.vertices) {
        std::mem::swap(&mut state.followed, &mut followed);
        (work.followed, work.roomy) = (followed, roomy);
        report.stages_ms.total = ms(started);
        return Ok(report);
    }
    if followed == state.followed {
        roomy.vertices.clone_from(&state.body);
    } else {
        roomy.vertices.clone_from(&followed);
        state.apart.make_room(
            model.config.par,
            &model.surface,
            &model.pressing,
            &mut roomy,
            model.room(),
        );
        model
            .creases
            .iter()
            .for_each(|c| c.make_room(&mut roomy.vertices, model.room()));
        std::mem::swap(&mut state.followed, &mut followed);
    }
    work.followed = followed;
    let before = ms(started);
    let mut report = step_on(
        model,
        state,
        &Input {
            body: &roomy.vertices,
            dt: input.dt,
        },
        work,
    );
    report.stages_ms.contact += before;
    report.stages_ms.total += before;
    work.roomy = roomy;
    Ok(report)
}

/// Cloth all of which sleeps rides on the body as it is `followed` now, if it sleeps on. Its body keeps the room that was
/// made for the cloth when it fell asleep.
fn ride_asleep(
    model: &Model,
    state: &mut State,
    followed: &[P3],
    body: &mut Vec<P3>,
) -> Option<StepReport> {
    let config = &model.config;
    if !config.sleep || state.still < STILL_FRAMES || state.followed.len() != followed.len() {
        return None;
    }
    if *followed != *state.followed {
        par::map_into(config.par, followed.len(), 4096, body, |v| {
            state.body[v] + (followed[v] - state.followed[v])
        });
        if !sleeps_on(config.steady, state, body) {
            return None;
        }
        let from = &state.body;
        par::for_chunks(config.par, &mut state.garments, 1, |k, g| {
            let g = &mut g[0];
            ride(
                &model.garments[k].sheet.edges,
                &g.nearest,
                from,
                body,
                &mut g.positions,
            );
        });
        state.body.copy_from_slice(body);
    }
    state.frames += 1;
    Some(StepReport {
        sleeping: state.garments.iter().map(|g| g.positions.len()).sum(),
        ..StepReport::default()
    })
}

/// As [`step`], on a body that fits the model, taken as it is, of someone whose cloth does not all sleep.
fn step_on(
    model: &Model,
    state: &mut State,
    input: &Input<'_>,
    work: &mut Workspace,
) -> StepReport {
    let started = Instant::now();
    let config = &model.config;
    let moved = |from: &[P3]| {
        from.iter()
            .zip(input.body)
            .map(|(a, b)| (a - b).norm_squared())
            .fold(0.0, f32::max)
            .sqrt()
    };
    state.frames += 1;
    // On this body, not the last one: who walks off shall find her cloth free.
    let quiet = is_quiet(config.steady, state, input.body);
    // The mean, not the farthest vertex: a waving hand is no teleport, and carrying cloth costs it its folds.
    let sum: f64 = state
        .body
        .iter()
        .zip(input.body)
        .map(|(a, b)| f64::from((a - b).norm()))
        .sum();
    let teleported = sum / input.body.len().max(1) as f64 > config.teleport;
    if teleported {
        for (g, m) in state.garments.iter_mut().zip(&model.garments) {
            carry(
                model,
                &m.sheet.edges,
                &g.nearest,
                &state.body,
                input.body,
                &mut g.positions,
            );
            g.velocities.iter_mut().for_each(|v| *v = V3::zeros());
        }
        state.body.copy_from_slice(input.body);
    }
    let dt = input.dt.clamp(DT_RANGE[0], DT_RANGE[1]);
    state.quiet_for = if quiet { state.quiet_for + dt } else { 0.0 };
    let limit = if config.sleep {
        coming_to_rest(state.quiet_for)
    } else {
        None
    };
    wake(model, state, input.body, dt, teleported);
    let mut report = StepReport {
        teleported,
        softened: 1.0,
        ..StepReport::default()
    };
    let timer = Instant::now();
    // The body at both ends of the call; in between it moves evenly.
    std::mem::swap(&mut work.before, &mut work.after);
    if work.before.vertices != state.body || work.before.normals.len() != state.body.len() {
        work.before.vertices.clone_from(&state.body);
        model.surface.update_normals(config.par, &mut work.before);
    }
    report.sleeves_put_back = put_back(model, state);
    // Some views in turn: a map only proposes where to begin looking, and all are wanted after a jump.
    let wanted = if teleported {
        model.views.len()
    } else {
        ((dt * VIEWS).round() as usize).clamp(1, model.views.len())
    };
    let turns: Vec<_> = model.views.chunks(wanted).collect();
    let views = turns[state.frames as usize % turns.len()];
    let mut buried = std::mem::take(&mut state.buried);
    let Workspace {
        maps,
        before,
        after,
        near_skin,
        untangle,
        ..
    } = work;
    ((report.stages_ms.maps, report.crossings), ()) = par::join(
        config.par,
        || {
            let timer = Instant::now();
            maps.render(config.par, views, input.body, model.surface.faces());
            (ms(timer), untangle.look(model, state, before, dt))
        },
        || {
            after.vertices.clear();
            after.vertices.extend_from_slice(input.body);
            model.surface.update_normals(config.par, after);
            near_skin.fill(after);
            buried.update(config.par, &model.surface, &model.opposite, after);
        },
    );
    report.buried = buried.count();
    state.buried = buried;
    let fastest = moved(&state.body) / dt as f32;
    report.stages_ms.contact = ms(timer) - report.stages_ms.maps;
    begin(model, state, &mut work.patches);
    cut(model, state, &mut work.pieces);
    work.piled.measure(model, state, &work.before);
    let search = if fastest < CALM { CALM_SEARCH } else { SEARCH };
    // A hair less, so that 1/30 s are two rounds and not three.
    let rounds = (dt / search - 1e-3).ceil().max(1.0) as usize;
    let span = dt / rounds as f64;
    for r in 0..rounds {
        let timer = Instant::now();
        lerp(
            config.par,
            &work.before,
            &work.after,
            r as f32 / rounds as f32,
            &mut work.now,
        );
        let touch = Touch {
            model,
            buried: &state.buried,
            now: &work.now,
            before: &work.before.vertices,
            after: &work.after.vertices,
            dt: dt as f32,
            fastest,
            span: span as f32,
            turn: state.frames,
            piled: &work.piled,
            nearest: &state.garments,
        };
        let maps = (r == 0).then_some(&work.maps);
        sheets(model, &work.patches, span as f32, &mut work.sheets);
        let cloth = ClothTouch {
            model,
            sheets: &work.sheets,
            span: span as f32,
        };
        for_patches(model, &mut work.patches, |g, k, p| {
            anchors(model, g, k, &touch, p);
            let fabric = &model.garments[g].patches[k];
            p.motion.find_overstretched(fabric, TORN, &mut p.torn);
            p.motion.find_overstretched(fabric, DRAWN, &mut p.drawn);
            let excepted = Exemptions {
                fixed: &p.tied,
                unlimited: &p.drawn,
            };
            FoldLimit::find_active(
                fabric,
                &p.motion,
                config.sharpest as f32,
                span as f32,
                &excepted,
                &mut p.struts,
            );
        });
        let patches = &work.patches;
        par::for_chunks(config.par, &mut work.pieces, 1, |_, q| {
            let q = &mut q[0];
            touch.find(maps, &patches[q.at], q);
            cloth.find(&patches[q.at], q);
        });
        report.stages_ms.contact += ms(timer);
        let timer = Instant::now();
        advance(model, &mut work.patches, &work.pieces, span, limit);
        report.stages_ms.solve += ms(timer);
    }
    let timer = Instant::now();
    let body = Settled {
        skin: &work.after,
        near: &work.near_skin,
        buried: &state.buried,
    };
    let patches = &work.patches;
    par::for_chunks(config.par, &mut work.pieces, 1, |_, q| {
        let q = &mut q[0];
        settle(model, &body, &patches[q.at], q);
    });
    for q in &work.pieces {
        q.lifted
            .iter()
            .for_each(|(i, moved)| work.patches[q.at].motion.displacement[*i as usize] = *moved);
    }
    report.stages_ms.contact += ms(timer);
    let timer = Instant::now();
    for_patches(model, &mut work.patches, |_, _, p| carry_on(p, dt));
    let speed = finish(model, state, &work.patches, &work.pieces, dt, &mut report);
    report.steps = model
        .garments
        .iter()
        .map(|g| rounds * steps(g.h, span))
        .max()
        .unwrap_or(0);
    report.speed = f64::from(speed);
    report.sleeping = state.rest.sleeping(model);
    if report.kept_last_good.is_some() {
        wake_all(state);
    } else {
        fall_asleep(model, state, &work.patches, input.body, dt);
    }
    state.stale = if report.kept_last_good.is_some() {
        state.stale + 1
    } else {
        0
    };
    if !quiet {
        state.awake_body.copy_from_slice(input.body);
    }
    let slow = speed
        < if config.steady > 0.0 {
            TREMBLING_SPEED
        } else {
            STILL_SPEED
        };
    state.still = if quiet && slow { state.still + 1 } else { 0 };
    state.body.copy_from_slice(input.body);
    report.stages_ms.solve += ms(timer);
    report.stages_ms.total = ms(started);
    report
}

fn steps(h: f64, span: f64) -> usize {
    (span / h).ceil().max(1.0) as usize
}

fn lerp(
    par: Par,
    from: &crate::contact::SurfaceFrame,
    to: &crate::contact::SurfaceFrame,
    t: f32,
    out: &mut crate::contact::SurfaceFrame,
) {
    par::map_into(par, from.vertices.len(), 4096, &mut out.vertices, |i| {
        from.vertices[i] + (to.vertices[i] - from.vertices[i]) * t
    });
    par::map_into(par, from.normals.len(), 4096, &mut out.normals, |i| {
        from.normals[i] + (to.normals[i] - from.normals[i]) * t
    });
}

/// Runs `f(garment, patch, scratch)` on every patch, each on its own thread when allowed.
fn for_patches(
    model: &Model,
    all: &mut [PatchScratch],
    f: impl Fn(usize, usize, &mut PatchScratch) + Sync,
) {
    let index: Vec<(usize, usize)> = model
        .garments
        .iter()
        .enumerate()
        .flat_map(|(g, m)| (0..m.patches.len()).map(move |k| (g, k)))
        .collect();
    par::for_chunks(model.config.par, all, 1, |i, p| {
        f(index[i].0, index[i].1, &mut p[0])
    });
}

fn begin(model: &Model, state: &State, all: &mut Vec<PatchScratch>) {
    all.resize_with(
        model.garments.iter().map(|g| g.patches.len()).sum(),
        PatchScratch::default,
    );
    for_patches(model, all, |g, k, p| {
        let (from, fabric) = (&state.garments[g], &model.garments[g].patches[k]);
        let local = || fabric.vertices.iter().map(|v| *v as usize);
        let v4 = |x: f32, y: f32, z: f32| V4::new(x, y, z);
        p.motion.reset(
            local().map(|v| {
                v4(
                    from.positions[v].x,
                    from.positions[v].y,
                    from.positions[v].z,
                )
            }),
            local().map(|v| {
                v4(
                    from.velocities[v].x,
                    from.velocities[v].y,
                    from.velocities[v].z,
                )
            }),
        );
        p.asleep.clear();
        p.asleep.extend(
            fabric
                .vertices
                .iter()
                .map(|v| state.rest.sleeps(model, g, *v)),
        );
        p.motion.set_sleeping(fabric, &p.asleep);
    });
}

/// All patches through `span` seconds; what is neither held nor drawn is no faster than `limit` m/s if there is one. Garments
/// do not wait for each other, patches of one garment do.
fn advance(
    model: &Model,
    all: &mut [PatchScratch],
    pieces: &[Piece],
    span: f64,
    limit: Option<f32>,
) {
    let gravity = V4::new(
        model.config.gravity[0] as f32,
        model.config.gravity[1] as f32,
        model.config.gravity[2] as f32,
    );
    let ahead = model.config.ahead as f32;
    let mut rest = all;
    let mut garments = Vec::with_capacity(model.garments.len());
    for (g, m) in model.garments.iter().enumerate() {
        let (mine, others) = rest.split_at_mut(m.patches.len());
        garments.push((g, m, mine));
        rest = others;
    }
    par::for_chunks(model.config.par, &mut garments, 1, |_, g| {
        let (g, m, patches) = &mut g[0];
        let n = steps(m.h, span);
        let h = (span / n as f64) as f32;
        let (models, par) = (&m.patches, model.config.par);
        run_substeps(par, models, patches, n, |s, k, p| {
            let f = &models[k];
            let t = s as f32 * h;
            if s % (RECALLED * m.bend_every) == 0 {
                let alone = (RECALLED * m.bend_every).min(n - s) as f32 * h;
                let found = || pieces.iter().filter(|q| (q.garment, q.patch) == (*g, k));
                p.near.clear();
                found().for_each(|q| p.motion.find_reachable(&q.body, t, alone, &mut p.near));
                p.body_near = p.near.len();
                found().for_each(|q| p.motion.find_reachable(&q.cloth, t, alone, &mut p.near));
            }
            if s % m.bend_every == 0 {
                p.motion
                    .update_bending(f, h * m.bend_every.min(n - s) as f32 * 0.5, m.smooth);
            }
            let step = Substep {
                h,
                t,
                lookahead: ahead,
                gravity,
                rings: 0,
            };
            p.motion.integrate_velocities(f, &step, &p.near, &p.ties);
            p.motion.apply_pins(&p.ties, t, h);
            FoldLimit::apply(&p.struts, &mut p.motion, h);
            // In this order: the body has the last word.
            let (body, cloth) = p.near.split_at(p.body_near);
            p.motion.resolve_contacts(cloth, t, h, CLOTH_RECOVERY);
            p.contacts = p.motion.resolve_contacts(body, t, h, RECOVERY);
            if let Some(limit) = limit {
                p.motion.limit_speed(
                    limit,
                    &Exemptions {
                        fixed: &p.tied,
                        unlimited: &p.drawn,
                    },
                );
            }
            p.motion.integrate_positions(f, &step, FASTEST);
        });
    });
}
