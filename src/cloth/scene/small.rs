//! A scene through small explicit steps.

use super::run::{RunConfig, RunReport, deepest};
use super::{Scene, SceneError};
use crate::cloth::ClothError;
use crate::cloth::folds::{FoldFrame, FoldModel, Search};
use crate::cloth::solver::explicit::{
    ContactPlane, HaloExchange, PatchModel, PatchState, Pin, StableSheet, StepSpec, Substep, V4,
};
use crate::contact::SurfaceModel;
use crate::math::{P3, V3, V3d};
use crate::mesh::{Topology, TriMesh};
use crate::par::{self, Par};
use nalgebra::{Matrix3, Point3};
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
/// The same for cloth in cloth, where a solid may be in the way.
const CLOTH_RECOVERY: f32 = 0.3;
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
        Some(degree) => (
            degree,
            StableSheet::stable_step(sheet, config.ahead, degree),
        ),
        // Smoothed accelerations move what other folds have stopped: drapes that press on themselves exploded.
        None if config.self_collision => (0, StableSheet::stable_step(sheet, config.ahead, 0)),
        None => StableSheet::choose_filter(sheet, config.ahead, LONG_ENOUGH),
    };
    let substeps = match config.substeps {
        0 => (dt / step).ceil() as usize,
        given => given,
    };
    let h = dt / substeps as f64;
    let bend_every = if config.every[0] == 0 {
        StableSheet::bending_interval(sheet, h)
    } else {
        config.every[0]
    };
    // Contacts are looked for again after so many evaluations of bending, where patches meet.
    let looks = config.every[1].max(1).div_ceil(bend_every);
    let plan = StableSheet::new(
        sheet,
        &StepSpec {
            h,
            lookahead: config.ahead,
            springs_only: false,
            bending_interval: bend_every,
            filter_degree: smooth,
        },
    );
    // A step moves news by one ring and by one more for each degree, an evaluation of bending before it by one more.
    // Patches meet after every step: what ghosts cost is more than the meeting.
    let fabrics = plan.compile_patches(config.patches, 1 + smooth + 1, 0);
    let borders = HaloExchange::new(fabrics.len());
    let start: Vec<V3d> = scene.start.iter().map(|p| p.coords.cast()).collect();
    let local: Vec<V3d> = match scene.pinned_to {
        Some(c) => {
            let back = scene.colliders[c].placement(0.0).inverse();
            start
                .iter()
                .map(|p| (back * Point3::from(*p)).coords)
                .collect()
        }
        None => start,
    };
    let mut flow = frame(0, &scene.start);
    let (mut finished, mut shown) = (1, Vec::new());
    let mut times = Vec::new();
    let mut scratch: Vec<Scratch> = fabrics.iter().map(|_| Scratch::default()).collect();
    let mut x: Vec<V4> = scene.start.iter().map(|p| V4::new(p.x, p.y, p.z)).collect();
    let mut velocity = vec![V4::default(); n];
    let mut folds = config
        .self_collision
        .then(|| Folds::new(scene, config, bend_every * looks, h))
        .transpose()?;
    let gravity = v4(&scene.gravity);
    let (hf, ahead) = (h as f32, config.ahead as f32);
    let mut penetration: f64 = 0.0;
    let mut fold_contacts = 0;
    let pinned: Vec<Vec<(u32, u32)>> = fabrics.iter().map(|f| pins_of(scene, f)).collect();
    for index in 1..scene.frames() {
        if flow.is_break() {
            break;
        }
        let started = Instant::now();
        let par = if fabrics.len() > 1 {
            Par::Rayon
        } else {
            Par::Seq
        };
        let mut s0 = 0;
        while s0 < substeps {
            let segment = folds
                .as_mut()
                .map_or(substeps, |f| f.begin(par, &x, &velocity));
            let steps = segment.min(substeps - s0);
            par::lockstep(par, &mut scratch, steps, |r, k, w| {
                let f = &fabrics[k];
                if r == 0 {
                    let all = || f.vertices.iter().map(|v| *v as usize);
                    w.motion
                        .reset(all().map(|v| x[v]), all().map(|v| velocity[v]));
                    if let Some(folds) = &folds {
                        folds.find(f, &pinned[k], w);
                    }
                } else {
                    borders.receive(r - 1, f, &mut w.motion);
                }
                let since = r % (bend_every * looks);
                if since == 0 {
                    let t0 = (index - 1) as f64 * dt + (s0 + r) as f64 * h;
                    let span = (bend_every * looks).min(steps - r) as f64 * h;
                    look(
                        scene,
                        config.offset,
                        &w.motion,
                        t0,
                        span,
                        &mut w.planes,
                        &mut w.clear,
                    );
                    w.solid = w.planes.len();
                    let t = r as f32 * hf;
                    w.motion
                        .find_reachable(&w.folds, t, span as f32, &mut w.planes);
                    // Times count from the last look, for folds too.
                    w.planes[w.solid..]
                        .iter_mut()
                        .for_each(|p| p.offset += p.normal.dot(p.velocity) * t);
                    w.ties.clear();
                    for &(i, p) in &pinned[k] {
                        let at = |t: f64| {
                            scene.pinned_to.map_or(local[p as usize], |c| {
                                (scene.colliders[c].placement(t) * Point3::from(local[p as usize]))
                                    .coords
                            })
                        };
                        let speed = (at(t0 + span) - at(t0)) / span;
                        w.ties.push(Pin {
                            vertex: i,
                            target: v4(&at(t0)),
                            velocity: v4(&speed),
                            stiffness: 1.0,
                        });
                    }
                }
                if r % bend_every == 0 {
                    w.motion
                        .update_bending(f, hf * bend_every.min(steps - r) as f32 * 0.5, smooth);
                }
                let t = since as f32 * hf;
                let step = Substep {
                    h: hf,
                    t,
                    lookahead: ahead,
                    gravity,
                    rings: 0,
                };
                w.motion.integrate_velocities(f, &step, &w.planes, &w.ties);
                // In this order: a solid has the last word.
                let (solid, cloth) = w.planes.split_at(w.solid);
                w.motion.resolve_contacts(cloth, t, hf, CLOTH_RECOVERY);
                w.motion.resolve_contacts(solid, t, hf, RECOVERY);
                w.motion.apply_pins(&w.ties, t, hf);
                w.motion.integrate_positions(f, &step, f32::INFINITY);
                borders.publish(r, k, f, &w.motion);
            });
            for (w, f) in scratch.iter().zip(&fabrics) {
                for (i, v) in f.vertices[..f.owned].iter().enumerate() {
                    x[*v as usize] = w.motion.position(i);
                    velocity[*v as usize] = w.motion.velocity[i];
                }
            }
            s0 += steps;
            if let Some(f) = &mut folds {
                f.touches = scratch.iter().map(|w| w.folds.len()).sum();
            }
            fold_contacts = fold_contacts.max(scratch.iter().map(|w| w.held_off).sum());
        }
        times.push(started.elapsed().as_secs_f64() * 1e3);
        if let Some(index) = x.iter().position(|p| !p.0.iter().all(|c| c.is_finite())) {
            return Err(ClothError::NotFinite {
                what: "cloth vertex",
                index,
            }
            .into());
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
        softened: plan.kept_stiffness,
        soft_elements: plan.soft_elements,
        fold_contacts,
        fold_searches_skipped: scratch.iter().map(|w| w.spared).sum(),
        ..RunReport::of(scene, times, &end, &v)
    })
}

#[derive(Default)]
struct Scratch {
    motion: PatchState,
    planes: Vec<ContactPlane>,
    clear: Vec<f32>,
    ties: Vec<Pin>,
    /// How many of the planes, the first ones, are the solids'.
    solid: usize,
    /// Planes of other folds since they were looked for.
    folds: Vec<ContactPlane>,
    /// How much nearer other folds may come to each vertex before they are looked for, metres.
    room: Vec<f32>,
    /// Searches left out for that.
    spared: usize,
    neighbour_of: Vec<u32>,
    /// Owned vertices that another fold is as near as its thickness.
    held_off: usize,
}

/// Fills `rest` with the speeds that are left without the rigid motion nearest to all, m/s; returns how fast that turns,
/// rad/s. What turns as one does not come nearer to itself.
fn rigid_part(x: &[P3], v: &[V3], rest: &mut Vec<f32>) -> f32 {
    let n = x.len().max(1) as f32;
    let centre = x.iter().fold(V3::zeros(), |a, p| a + p.coords) / n;
    let mean = v.iter().fold(V3::zeros(), |a, v| a + v) / n;
    let (mut inertia, mut momentum) = (Matrix3::zeros(), V3::zeros());
    for (x, v) in x.iter().zip(v) {
        let r = x.coords - centre;
        inertia += Matrix3::identity() * r.norm_squared() - r * r.transpose();
        momentum += r.cross(&(v - mean));
    }
    let turn = inertia.try_inverse().map_or(V3::zeros(), |i| i * momentum);
    let turn = if turn.iter().all(|c| c.is_finite()) {
        turn
    } else {
        V3::zeros()
    };
    rest.clear();
    rest.extend(
        x.iter()
            .zip(v)
            .map(|(x, v)| (v - mean - turn.cross(&(x.coords - centre))).norm()),
    );
    turn.norm()
}

/// Contact of the sheet with itself.
struct Folds {
    model: FoldModel,
    frame: FoldFrame,
    search: Search,
    thickness: f32,
    /// Speed of each vertex beside the rigid motion of the whole, and the most of it that a neighbour may have, m/s.
    speeds: Vec<f32>,
    fastest: f32,
    span: f32,
    /// Planes after the last search.
    touches: usize,
    /// Steps between two looks at the solids, their length, s, and the most looks from one search to the next.
    looks: usize,
    h: f32,
    most: usize,
}

impl Folds {
    /// Searches after a whole number of `looks`, which are so many steps of `h` seconds.
    fn new(scene: &Scene, config: &RunConfig, looks: usize, h: f64) -> Result<Self, SceneError> {
        let fault = |why: String| SceneError::Field {
            scene: "scene".into(),
            field: "mesh".into(),
            why,
        };
        let mesh = TriMesh::new(scene.start.clone(), scene.faces.clone())
            .map_err(|e| fault(e.to_string()))?;
        let topology = Topology::new(&mesh).map_err(|e| fault(e.to_string()))?;
        let surface = SurfaceModel::new(scene.faces.clone(), topology, vec![1; scene.start.len()]);
        let model = FoldModel::new(surface, scene.sheet.edges.iter().map(|e| e.1 as f32));
        let most = ((config.fold_search / (looks as f64 * h)) as usize).max(1);
        let thickness = config.thickness as f32;
        let search = model.search_all(thickness, 0.0);
        let (frame, speeds, h) = (FoldFrame::default(), Vec::new(), h as f32);
        Ok(Self {
            model,
            frame,
            search,
            thickness,
            speeds,
            fastest: 0.0,
            span: 0.0,
            touches: 0,
            looks,
            h,
            most,
        })
    }
    /// The sheet is here now. Returns after how many steps it must be looked at again: none come together by more than
    /// their thickness before, if that can be.
    fn begin(&mut self, par: Par, x: &[V4], velocity: &[V4]) -> usize {
        let frame = &mut self.frame;
        frame.surface.vertices.clear();
        frame
            .surface
            .vertices
            .extend(x.iter().map(|p| P3::new(p.0[0], p.0[1], p.0[2])));
        frame.velocities.clear();
        frame
            .velocities
            .extend(velocity.iter().map(|v| V3::new(v.0[0], v.0[1], v.0[2])));
        let turn = rigid_part(&frame.surface.vertices, &frame.velocities, &mut self.speeds);
        self.fastest = self.speeds.iter().copied().fold(0.0, f32::max);
        let look = self.looks as f32 * self.h;
        let looks = ((self.thickness / (2.0 * self.fastest * look)) as usize).clamp(1, self.most);
        self.span = looks as f32 * look;
        self.search = self
            .model
            .search_all(self.thickness, 2.0 * self.fastest * self.span);
        self.fastest += turn * self.search.corner;
        self.model
            .begin(par, frame, Some(&self.search), self.touches);
        looks * self.looks
    }
    /// Planes between the vertices of a patch and other folds.
    fn find(&self, f: &PatchModel, pinned: &[(u32, u32)], w: &mut Scratch) {
        w.folds.clear();
        w.held_off = 0;
        w.room.resize(f.vertices.len(), 0.0);
        w.neighbour_of
            .resize(self.frame.surface.vertices.len(), u32::MAX);
        pinned
            .iter()
            .for_each(|p| w.room[p.0 as usize] = f32::INFINITY);
        for (i, &v) in f.vertices.iter().enumerate() {
            let way = (self.speeds[v as usize] + self.fastest) * self.span;
            if w.room[i] > way {
                w.room[i] -= way;
                w.spared += 1;
                continue;
            }
            let x = self.frame.surface.vertices[v as usize];
            let corner = self
                .model
                .corner(&self.frame, v, &x, &self.search, &mut w.neighbour_of);
            w.room[i] = FoldModel::room(&self.search, corner);
            let Some((corner, _)) = corner.filter(|_| w.room[i] < 0.0) else {
                continue;
            };
            if let Some((plane, far)) =
                self.model
                    .plane(&self.frame, i, v, &x, corner, &self.search)
            {
                w.folds.push(plane);
                w.held_off += usize::from(i < f.owned && far <= self.search.thickness);
            }
        }
    }
}

/// Local and sheet numbers of a patch's pinned vertices.
fn pins_of(scene: &Scene, f: &PatchModel) -> Vec<(u32, u32)> {
    let local = f.vertices.iter().enumerate();
    local
        .filter(|(_, v)| scene.pins.contains(v))
        .map(|(i, v)| (i as u32, *v))
        .collect()
}

/// Planes of the solids near each vertex, as they will move for `span` seconds from `t`. `clear` remembers how far
/// each vertex may come before it must be looked at again, metres: one list for all solids, kept by the caller.
pub(super) fn look(
    scene: &Scene,
    offset: f64,
    motion: &PatchState,
    t: f64,
    span: f64,
    planes: &mut Vec<ContactPlane>,
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
            planes.push(ContactPlane {
                vertex: i as u32,
                normal: v4(&normal),
                offset: (normal.dot(&on.coords) + offset) as f32,
                velocity: v4(&speed),
                friction: c.friction as f32,
            });
        }
    }
}
