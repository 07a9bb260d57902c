//! A scene through small explicit steps.

use super::run::{RunConfig, RunReport, deepest};
use super::{Scene, SceneError};
use crate::cloth::ClothError;
use crate::cloth::small_steps::{Borders, Fabric, Fit, Motion, Plan, Plane, Step, Tie, V4};
use crate::math::{P3, V3d};
use crate::par::{self, Par};
use nalgebra::Point3;
use std::ops::ControlFlow;
use std::time::Instant;

pub(super) fn v4(v: &V3d) -> V4 {
    V4::new(v.x as f32, v.y as f32, v.z as f32)
}

pub(super) fn v3d(v: V4) -> V3d {
    V3d::new(f64::from(v.0[0]), f64::from(v.0[1]), f64::from(v.0[2]))
}

/// Sunken cloth comes out at this speed at most, m/s.
pub(super) const RECOVERY: f32 = 1.0;
/// A sheet that is stable at this step needs no smoothing, s: with less, most of the time goes into waves that nobody
/// sees. Smoothing a coarse sheet shows (docs/benchmarks.md).
const LONG_ENOUGH: f64 = 1.0 / 4200.0;
/// Solids are looked at when they are nearer than twice the way a vertex may come until the next search, and this,
/// metres: what it may gain in speed in between, 1 m/s in 1 ms.
const ROOM: f64 = 2e-3;

pub(super) fn run(
    scene: &Scene,
    config: &RunConfig,
    mut frame: impl FnMut(usize, &[P3]) -> ControlFlow<()>,
) -> Result<RunReport, SceneError> {
    let sheet = &scene.sheet;
    let n = scene.start.len();
    let dt = 1.0 / scene.rate;
    let (smooth, step) = match config.smooth {
        Some(degree) => (degree, Plan::comfortable_step(sheet, config.ahead, degree)),
        None => Plan::comfortable(sheet, config.ahead, LONG_ENOUGH),
    };
    let substeps = match config.substeps {
        0 => (dt / step).ceil() as usize,
        given => given,
    };
    let h = dt / substeps as f64;
    let bend_every = if config.every[0] == 0 { Plan::bend_every(sheet, h) } else { config.every[0] };
    // Contacts are looked for again after so many evaluations of bending, where patches meet.
    let looks = config.every[1].max(1).div_ceil(bend_every);
    let plan = Plan::new(sheet, &Fit { h, ahead: config.ahead, springs_only: false, bend_every, smooth });
    // A step moves news by one ring and by one more for each degree, an evaluation of bending before it by one more.
    // Patches meet after every step: what ghosts cost is more than the meeting.
    let fabrics = plan.patches(config.patches, 1 + smooth + 1);
    let borders = Borders::new(fabrics.len());
    let start: Vec<V3d> = scene.start.iter().map(|p| p.coords.cast()).collect();
    let local: Vec<V3d> = match scene.pinned_to {
        Some(c) => {
            let back = scene.colliders[c].placement(0.0).inverse();
            start.iter().map(|p| (back * Point3::from(*p)).coords).collect()
        }
        None => start,
    };
    let mut flow = frame(0, &scene.start);
    let (mut finished, mut shown) = (1, Vec::new());
    let mut times = Vec::new();
    let mut scratch: Vec<Scratch> = fabrics.iter().map(|_| Scratch::default()).collect();
    let mut x: Vec<V4> = scene.start.iter().map(|p| V4::new(p.x, p.y, p.z)).collect();
    let mut velocity = vec![V4::default(); n];
    let gravity = v4(&scene.gravity);
    let (hf, ahead) = (h as f32, config.ahead as f32);
    let mut penetration: f64 = 0.0;
    let pinned: Vec<Vec<(u32, u32)>> = fabrics.iter().map(|f| pins_of(scene, f)).collect();
    for index in 1..scene.frames() {
        if flow.is_break() {
            break;
        }
        let started = Instant::now();
        let par = if fabrics.len() > 1 { Par::Rayon } else { Par::Seq };
        par::rounds(par, &mut scratch, substeps, |s, k, w| {
            let f = &fabrics[k];
            if s == 0 {
                let all = || f.vertices.iter().map(|v| *v as usize);
                w.motion.begin(all().map(|v| x[v]), all().map(|v| velocity[v]));
            } else {
                borders.hear(s - 1, f, &mut w.motion);
            }
            let since = s % (bend_every * looks);
            if since == 0 {
                let t0 = (index - 1) as f64 * dt + s as f64 * h;
                let span = (bend_every * looks).min(substeps - s) as f64 * h;
                look(scene, config.offset, &w.motion, t0, span, &mut w.planes, &mut w.clear);
                w.ties.clear();
                for &(i, p) in &pinned[k] {
                    let at = |t: f64| {
                        scene.pinned_to.map_or(local[p as usize], |c| {
                            (scene.colliders[c].placement(t) * Point3::from(local[p as usize])).coords
                        })
                    };
                    let speed = (at(t0 + span) - at(t0)) / span;
                    w.ties.push(Tie { vertex: i, place: v4(&at(t0)), speed: v4(&speed), firmness: 1.0 });
                }
            }
            if s % bend_every == 0 {
                w.motion.bend(f, hf * bend_every.min(substeps - s) as f32 * 0.5, smooth);
            }
            let t = since as f32 * hf;
            let step = Step { h: hf, t, ahead, gravity, rings: 0 };
            w.motion.accelerate(f, &step, &w.planes, &w.ties);
            w.motion.restrain(&w.planes, t, hf, RECOVERY);
            w.motion.tie(&w.ties, t, hf);
            w.motion.advance(f, &step, f32::INFINITY);
            borders.tell(s, k, f, &w.motion);
        });
        for (w, f) in scratch.iter().zip(&fabrics) {
            for (i, v) in f.vertices[..f.owned].iter().enumerate() {
                x[*v as usize] = w.motion.position(i);
                velocity[*v as usize] = w.motion.velocity[i];
            }
        }
        times.push(started.elapsed().as_secs_f64() * 1e3);
        if let Some(index) = x.iter().position(|p| !p.0.iter().all(|c| c.is_finite())) {
            return Err(ClothError::NotFinite { what: "cloth vertex", index }.into());
        }
        if !scene.colliders.is_empty() {
            let x: Vec<V3d> = x.iter().map(|p| v3d(*p)).collect();
            penetration = deepest(scene, index as f64 * dt, &x).max(penetration);
        }
        shown.clear();
        shown.extend(x.iter().map(|p| P3::new(p.0[0], p.0[1], p.0[2])));
        flow = frame(index, &shown);
        finished += 1;
    }
    let end: Vec<V3d> = x.iter().map(|p| v3d(*p)).collect();
    let v: Vec<V3d> = velocity.iter().map(|p| v3d(*p)).collect();
    Ok(RunReport {
        frames: finished,
        substeps,
        iterations: 1,
        penetration,
        softened: plan.softened,
        soft_elements: plan.soft_elements,
        ..RunReport::of(scene, times, &end, &v)
    })
}

#[derive(Default)]
struct Scratch {
    motion: Motion,
    planes: Vec<Plane>,
    clear: Vec<f32>,
    ties: Vec<Tie>,
}

/// Local and sheet numbers of a patch's pinned vertices.
fn pins_of(scene: &Scene, f: &Fabric) -> Vec<(u32, u32)> {
    let local = f.vertices.iter().enumerate();
    local.filter(|(_, v)| scene.pins.contains(v)).map(|(i, v)| (i as u32, *v)).collect()
}

/// Planes of the solids near each vertex, as they will move for `span` seconds from `t`. `clear` remembers how far
/// each vertex may come before it must be looked at again, metres: one list for all solids, kept by the caller.
pub(super) fn look(
    scene: &Scene,
    offset: f64,
    motion: &Motion,
    t: f64,
    span: f64,
    planes: &mut Vec<Plane>,
    clear: &mut Vec<f32>,
) {
    planes.clear();
    let n = motion.start.len();
    clear.resize(n * scene.colliders.len(), 0.0);
    for (c, clear) in scene.colliders.iter().zip(clear.chunks_mut(n.max(1))) {
        let (was, will) = (c.placement(t), c.placement(t + span));
        let change = will * was.inverse();
        let fastest = c.shape.fastest(&was, &will) / span;
        for (i, clear) in clear.iter_mut().enumerate() {
            let v = motion.velocity[i];
            let travel = ((f64::from(v.dot(v).sqrt()) + fastest) * span) as f32;
            if *clear > travel {
                *clear -= travel;
                continue;
            }
            let x = Point3::from(v3d(motion.position(i)));
            let (d, normal) = c.shape.distance(&was.inverse_transform_point(&x).coords);
            let reach = offset + ROOM + 2.0 * f64::from(travel);
            *clear = (d - reach).max(0.0) as f32;
            if d > reach {
                continue;
            }
            let normal = was.rotation * normal;
            let on = x - normal * d;
            let speed = (change * on - on) / span;
            planes.push(Plane {
                vertex: i as u32,
                normal: v4(&normal),
                level: (normal.dot(&on.coords) + offset) as f32,
                speed: v4(&speed),
                friction: c.friction as f32,
            });
        }
    }
}
