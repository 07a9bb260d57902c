//! Which regions of the cloth sleep while others move: someone stands and waves an arm, and her hem is not computed.
//!
//! A region falls asleep when it, its neighbours and the skin it lies on have been still for some calls and nothing that
//! moves is near. It wakes when that skin, an anchor, or cloth sewn to it moves, or when other cloth or skin comes near.

use super::carry::ways;
use super::finish::percentile;
use super::model::Model;
use super::state::{GarmentState, PatchScratch, State};
use super::still::stillness;
use crate::cloth::model::partition::{Partition, cut};
use crate::cloth::solver::explicit::PatchModel;
use crate::contact::SurfaceModel;
use crate::math::{P3, V3};
use serde::{Deserialize, Serialize};

/// Vertices of a region at most: with edges of 12 mm the palm of a hand.
pub(super) const REGION: usize = 96;
/// A region of which 90 % is slower than this may fall asleep, m/s.
/// At 5 mm/s a ninth of what sleeps now did, and at 10 mm/s cloth of coarse edges never slept.
const SLOW: f32 = 0.02;
/// The same on a body that trembles, m/s.
const TREMBLING: f32 = 0.05;
/// Calls of that before it does.
const SLOW_CALLS: u32 = 10;
/// How far, in what skin may move while a region falls asleep, a region rides on skin that sways, and how far in one call.
/// At what the whole outfit may (5 and 2) sleeves fell asleep where a waving arm turns, and were 2 cm off.
const RIDES: [f32; 2] = [2.5, 1.0];
/// Of a hundred vertices of a region, so many are as slow as it is said to be.
const MOST: usize = 90;
/// Skin of other parts of the body counts as what a region lies on, and skin that moves wakes it, within this, metres.
const SKIN: f32 = 0.03;
/// Other cloth that moves wakes a region within this and so many lengths of its edges, metres.
const CLOTH: (f32, f32) = (0.008, 0.6);
/// An edge that leaves a sleeping region wakes it when it is longer or shorter by this share, or turned by this, rad.
const PULLED: (f32, f32) = (0.01, 0.07);
/// Skin vertices that are tested together.
const CLUSTER: usize = 64;

/// The regions of one garment.
#[derive(Debug, Default)]
pub(super) struct Regions {
    /// Vertices of each.
    members: Vec<Vec<u32>>,
    /// Region of each vertex.
    of: Vec<u32>,
    /// Regions that share an edge with each.
    beside: Vec<Vec<u32>>,
    /// Edges that leave each: its own vertex first.
    leaving: Vec<Vec<[u32; 2]>>,
    /// The first region of each patch.
    first: Vec<usize>,
    /// Other cloth nearer than this matters, metres.
    near: f32,
}

impl Regions {
    pub(super) fn new(
        patches: &[PatchModel],
        vertices: usize,
        edges: &[([u32; 2], f64)],
        edge: f32,
    ) -> Self {
        let (mut members, mut first) = (Vec::new(), Vec::new());
        for f in patches {
            first.push(members.len());
            members.extend(
                f.islands
                    .windows(2)
                    .map(|r| f.vertices[r[0]..r[1]].to_vec()),
            );
        }
        let mut of = vec![0u32; vertices];
        members
            .iter()
            .enumerate()
            .for_each(|(r, m)| m.iter().for_each(|v| of[*v as usize] = r as u32));
        let mut beside = vec![Vec::new(); members.len()];
        let mut leaving = vec![Vec::new(); members.len()];
        for ([a, b], _) in edges {
            for [a, b] in [[*a, *b], [*b, *a]] {
                let [p, q] = [of[a as usize], of[b as usize]];
                if p != q {
                    beside[p as usize].push(q);
                    leaving[p as usize].push([a, b]);
                }
            }
        }
        for b in &mut beside {
            b.sort_unstable();
            b.dedup();
        }
        Self {
            members,
            of,
            beside,
            leaving,
            first,
            near: CLOTH.0 + CLOTH.1 * edge,
        }
    }
}

/// The body's vertices in clusters.
pub(super) fn clusters(surface: &SurfaceModel) -> Partition {
    let n = surface.vertices();
    cut(
        n,
        |v| surface.neighbours(v),
        (0..n as u32).collect(),
        CLUSTER,
        1,
    )
}

/// One region.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Region {
    /// Calls that it has been slow for.
    slow_for: u32,
    asleep: bool,
    /// m/s, in the last call.
    speed: f32,
    /// Body vertices that it lies on or is tied to, and where they were when it fell asleep; empty while it is awake.
    skin: Vec<(u32, P3)>,
    /// The edges that leave it as they were then.
    leaving: Vec<V3>,
}

/// What rests.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Rest {
    /// Of each garment.
    regions: Vec<Vec<Region>>,
    /// Where each body vertex was when it last stirred, and calls since.
    calm: Vec<(P3, u32)>,
    /// Where each body vertex was when it last went far enough to wake cloth that it is near to.
    strayed: Vec<P3>,
}

/// Bounds of what counts as still.
struct Bounds {
    slow: f32,
    /// Skin under a region that falls asleep, metres.
    calm: f32,
    /// Skin under one that sleeps, from where it fell asleep, and from call to call, metres.
    sway: f32,
    hop: f32,
}

impl Bounds {
    fn new(steady: f64) -> Self {
        let calm = stillness(steady)[0];
        if steady > 0.0 {
            Self {
                slow: TREMBLING,
                calm,
                sway: RIDES[0] * calm,
                hop: RIDES[1] * calm,
            }
        } else {
            Self {
                slow: SLOW,
                calm,
                sway: calm,
                hop: calm,
            }
        }
    }
}

/// A box, or nothing.
#[derive(Clone, Copy, Debug)]
struct Around([V3; 2]);

impl Around {
    fn of(points: impl Iterator<Item = P3>) -> Self {
        let none = [V3::repeat(f32::INFINITY), V3::repeat(f32::NEG_INFINITY)];
        Self(points.fold(none, |[a, b], p| [a.inf(&p.coords), b.sup(&p.coords)]))
    }
    fn meets(&self, o: &Self, within: f32) -> bool {
        (0..3).all(|d| self.0[0][d] - within <= o.0[1][d] && o.0[0][d] - within <= self.0[1][d])
    }
    fn holds(&self, p: &P3, within: f32) -> bool {
        (0..3).all(|d| self.0[0][d] - within <= p[d] && p[d] <= self.0[1][d] + within)
    }
}

/// Some points that move.
struct Moving {
    points: Vec<P3>,
    around: Around,
    /// How near they matter, metres.
    within: f32,
    /// Garment and region, if they are cloth.
    cloth: Option<(usize, usize)>,
}

impl Moving {
    fn new(points: Vec<P3>, within: f32, cloth: Option<(usize, usize)>) -> Self {
        Self {
            around: Around::of(points.iter().copied()),
            points,
            within,
            cloth,
        }
    }
    fn touches(&self, cloth: &[P3], around: &Around) -> bool {
        if !self.around.meets(around, self.within) {
            return false;
        }
        let here: Vec<&P3> = self
            .points
            .iter()
            .filter(|p| around.holds(p, self.within))
            .collect();
        let there = cloth.iter().filter(|p| self.around.holds(p, self.within));
        let far = self.within * self.within;
        there
            .into_iter()
            .any(|p| here.iter().any(|q| (p - **q).norm_squared() < far))
    }
}

/// All that moves, near to which nothing may sleep.
struct Disturbance(Vec<Moving>);

impl Disturbance {
    fn by_cloth(&mut self, model: &Model, garments: &[GarmentState], rest: &Rest, slow: f32) {
        for (g, (m, s)) in model.garments.iter().zip(garments).enumerate() {
            for (r, region) in rest.regions[g]
                .iter()
                .enumerate()
                .filter(|r| !r.1.asleep && r.1.speed >= slow)
            {
                let points = m.regions.members[r]
                    .iter()
                    .map(|v| s.positions[*v as usize])
                    .collect();
                debug_assert!(region.skin.is_empty());
                self.0
                    .push(Moving::new(points, m.regions.near, Some((g, r))));
            }
        }
    }
    /// Something moves near region `r` of garment `g`, beside what it is sewn to.
    fn reaches(&self, model: &Model, garments: &[GarmentState], g: usize, r: usize) -> bool {
        let regions = &model.garments[g].regions;
        let own: Vec<P3> = regions.members[r]
            .iter()
            .map(|v| garments[g].positions[*v as usize])
            .collect();
        let around = Around::of(own.iter().copied());
        let sewn = |m: &Moving| {
            m.cloth
                .is_some_and(|(h, q)| h == g && regions.beside[r].contains(&(q as u32)))
        };
        self.0.iter().any(|m| !sewn(m) && m.touches(&own, &around))
    }
}

impl Rest {
    fn fit(&mut self, model: &Model, body: &[P3]) {
        let counts = || model.garments.iter().map(|g| g.regions.members.len());
        if !self.regions.iter().map(Vec::len).eq(counts()) || self.calm.len() != body.len() {
            self.regions = counts().map(|n| vec![Region::default(); n]).collect();
            self.calm = body.iter().map(|p| (*p, 0)).collect();
            self.strayed = body.to_vec();
        }
    }
    fn forget(&mut self) {
        self.regions
            .iter_mut()
            .flatten()
            .for_each(|r| *r = Region::default());
    }
    /// Nothing sleeps.
    fn awake(&self) -> bool {
        self.regions.iter().flatten().all(|r| !r.asleep)
    }
    /// Follows the body; returns skin that went far.
    fn follow(
        &mut self,
        model: &Model,
        before: &[P3],
        body: &[P3],
        bounds: &Bounds,
    ) -> Disturbance {
        let awake = self.awake();
        for ((at, calls), now) in self.calm.iter_mut().zip(body) {
            let still = (now - *at).norm_squared() < bounds.calm * bounds.calm;
            *calls = if still { calls.saturating_add(1) } else { 0 };
            if !still {
                *at = *now;
            }
        }
        let mut all = Vec::new();
        for k in 0..model.clusters.len() {
            let (mut points, mut farthest) = (Vec::new(), 0.0f32);
            for v in model.clusters.members(k).iter().map(|v| *v as usize) {
                if (body[v] - self.strayed[v]).norm_squared() >= bounds.sway * bounds.sway {
                    self.strayed[v] = body[v];
                    if awake {
                        continue;
                    }
                    points.push(body[v]);
                    farthest = farthest.max((body[v] - before[v]).norm());
                }
            }
            if !points.is_empty() {
                // It went unseen until now, and may have come by a region within this call.
                all.push(Moving::new(points, SKIN + bounds.sway + farthest, None));
            }
        }
        Disturbance(all)
    }
    /// Vertices that sleep.
    pub(super) fn sleeping(&self, model: &Model) -> usize {
        let of = |(m, r): (&super::model::GarmentModel, &Vec<Region>)| {
            r.iter()
                .zip(&m.regions.members)
                .filter(|r| r.0.asleep)
                .map(|r| r.1.len())
                .sum::<usize>()
        };
        model.garments.iter().zip(&self.regions).map(of).sum()
    }
    /// Whether a vertex sleeps.
    pub(super) fn sleeps(&self, model: &Model, garment: usize, vertex: u32) -> bool {
        let region = || model.garments[garment].regions.of[vertex as usize] as usize;
        self.regions
            .get(garment)
            .is_some_and(|r| r[region()].asleep)
    }
}

/// Wakes what must not sleep on now that the body goes from where it was to `body` within `dt` seconds, and lets the rest
/// ride on skin that sways.
pub(super) fn wake(model: &Model, state: &mut State, body: &[P3], dt: f64, jumped: bool) {
    let c = &model.config;
    if !(c.sleep && c.sleep_regions) {
        state.rest = Rest::default();
        return;
    }
    let State {
        garments,
        rest,
        body: before,
        ..
    } = state;
    rest.fit(model, body);
    let bounds = Bounds::new(c.steady);
    let mut disturbance = rest.follow(model, before, body, &bounds);
    if jumped {
        rest.forget();
    }
    if rest.awake() {
        return;
    }
    disturbance.by_cloth(model, garments, rest, bounds.slow);
    let within = |v: usize, from: &P3, most: f32| (body[v] - from).norm_squared() < most * most;
    let mut woken = Vec::new();
    for (g, (m, s)) in model.garments.iter().zip(garments.iter()).enumerate() {
        for (r, region) in rest.regions[g].iter().enumerate().filter(|r| r.1.asleep) {
            let skin = region.skin.iter().map(|(v, p)| (*v as usize, p));
            let lies = skin
                .into_iter()
                .all(|(v, p)| within(v, p, bounds.sway) && within(v, &before[v], bounds.hop));
            let hangs = m.regions.leaving[r]
                .iter()
                .zip(&region.leaving)
                .all(|([a, b], was)| {
                    let is = s.positions[*b as usize] - s.positions[*a as usize];
                    let length = was.norm();
                    (is.norm() - length).abs() <= PULLED.0 * length
                        && (is - was).norm() <= PULLED.1 * length
                });
            if !(lies && hangs) || disturbance.reaches(model, garments, g, r) {
                woken.push((g, r));
            }
        }
    }
    woken
        .iter()
        .for_each(|(g, r)| rest.regions[*g][*r] = Region::default());
    for (g, (m, s)) in model.garments.iter().zip(garments.iter_mut()).enumerate() {
        let rides = |v: usize| rest.sleeps(model, g, v as u32);
        if !rest.regions[g].iter().any(|r| r.asleep) {
            continue;
        }
        if c.steady > 0.0 && before != body {
            let ways = ways(&m.sheet.edges, &s.nearest, before, body, rides);
            let all = s.velocities.iter_mut().zip(&ways).enumerate();
            all.filter(|(v, _)| rides(*v))
                .for_each(|(_, (u, way))| *u = way / dt as f32);
        } else {
            s.velocities
                .iter_mut()
                .enumerate()
                .filter(|(v, _)| rides(*v))
                .for_each(|(_, u)| *u = V3::zeros());
        }
    }
}

/// Brings sleeping vertices of a patch to where their speeds lead in a call of `dt` seconds.
pub(super) fn carry_on(p: &mut PatchScratch, dt: f64) {
    for i in (0..p.asleep.len()).filter(|i| p.asleep[*i]) {
        p.motion.displacement[i] = p.motion.velocity[i].scale(dt as f32);
    }
}

/// Lets regions fall asleep after a call of `dt` seconds that ended on `body`.
pub(super) fn fall_asleep(
    model: &Model,
    state: &mut State,
    patches: &[PatchScratch],
    body: &[P3],
    dt: f64,
) {
    let c = &model.config;
    if !(c.sleep && c.sleep_regions) {
        return;
    }
    let bounds = Bounds::new(c.steady);
    let State { garments, rest, .. } = state;
    let mut patches = patches.iter();
    for (m, regions) in model.garments.iter().zip(&mut rest.regions) {
        for (f, first) in m.patches.iter().zip(&m.regions.first) {
            let Some(p) = patches.next() else { return };
            for (region, r) in regions[*first..].iter_mut().zip(f.islands.windows(2)) {
                let mut ways: Vec<f32> = p.motion.displacement[r[0]..r[1]]
                    .iter()
                    .map(|w| w.dot(*w))
                    .collect();
                let way = percentile(&mut ways, MOST).unwrap_or(0.0);
                region.speed = if region.asleep {
                    0.0
                } else {
                    way.sqrt() / dt as f32
                };
                region.slow_for = if region.speed < bounds.slow {
                    region.slow_for + 1
                } else {
                    0
                };
            }
        }
    }
    let awhile = |r: &Region| !r.asleep && r.slow_for >= SLOW_CALLS;
    if !rest.regions.iter().flatten().any(awhile) {
        return;
    }
    let mut disturbance = Disturbance(Vec::new());
    disturbance.by_cloth(model, garments, rest, bounds.slow);
    let mut tired = Vec::new();
    for (g, (m, s)) in model.garments.iter().zip(garments.iter()).enumerate() {
        let all = &rest.regions[g];
        for (r, region) in all.iter().enumerate().filter(|r| awhile(r.1)) {
            if m.regions.beside[r]
                .iter()
                .any(|q| all[*q as usize].speed >= bounds.slow)
            {
                continue;
            }
            let skin = skin_of(model, g, r, s, body);
            let calm = |v: &u32| rest.calm[*v as usize].1 >= SLOW_CALLS;
            if !skin.iter().all(calm) || disturbance.reaches(model, garments, g, r) {
                continue;
            }
            let leaving = m.regions.leaving[r].iter();
            tired.push((
                g,
                r,
                Region {
                    asleep: true,
                    slow_for: region.slow_for,
                    speed: 0.0,
                    skin: skin.into_iter().map(|v| (v, body[v as usize])).collect(),
                    leaving: leaving
                        .map(|[a, b]| s.positions[*b as usize] - s.positions[*a as usize])
                        .collect(),
                },
            ));
        }
    }
    for (g, r, region) in tired {
        model.garments[g].regions.members[r]
            .iter()
            .for_each(|v| garments[g].velocities[*v as usize] = V3::zeros());
        rest.regions[g][r] = region;
    }
}

/// Body vertices that a region lies on or is tied to.
fn skin_of(
    model: &Model,
    garment: usize,
    region: usize,
    s: &GarmentState,
    body: &[P3],
) -> Vec<u32> {
    let regions = &model.garments[garment].regions;
    let mut skin = Vec::new();
    for v in &regions.members[region] {
        let (x, [own, other]) = (s.positions[*v as usize], s.nearest[*v as usize]);
        skin.push(own);
        if (body[other as usize] - x).norm_squared() < SKIN * SKIN {
            skin.push(other);
        }
    }
    for a in &model.outfit.anchors[garment] {
        if regions.of[a.vertex as usize] as usize == region {
            skin.extend(a.body);
        }
    }
    skin.sort_unstable();
    skin.dedup();
    skin
}

/// Forgets that anything rested.
pub(super) fn wake_all(state: &mut State) {
    state.rest.forget();
}
