//! Islands of cloth that sleep while others move: the subject stands and waves an arm, and the hem is not simulated.
//!
//! An island falls asleep when it, its neighbours and its supporting skin have been still for some steps and nothing
//! moves nearby. It wakes when that skin, an anchor or adjacent cloth moves, or when other cloth or skin comes near.

use super::follow_skin::skin_displacements;
use super::state::{Island, SleepState};
use super::wake_source::WakeSources;
use crate::live::outfit_model::Model;
use crate::live::patch::PatchWork;
use crate::live::state::{GarmentState, State};
use crate::settings::{Config, StillnessSettings};
use tryon_geometry::math::order_statistics::percentile;
use tryon_geometry::math::{P3, V3};

/// Percentage of an island's vertices that are at most as fast as its speed.
const SPEED_PERCENTILE: usize = 90;

/// Thresholds of sleep for a body that is exact or tracked.
struct Thresholds {
    /// Speed of cloth that may fall asleep, m/s.
    speed: f32,
    /// Displacement of skin below an island that falls asleep, metres.
    calm: f32,
    /// Displacement of skin below a sleeping island, since sleep began and per step, metres.
    sway: f32,
    per_step: f32,
}

impl Thresholds {
    fn new(config: &Config) -> Self {
        let settings = &config.stillness;
        let is_tracked = config.noise_deadband > 0.0;
        let calm = settings.still_skin(config.noise_deadband)[0];
        let [sway, per_step] = if is_tracked {
            settings.island_sway
        } else {
            [1.0; 2]
        };
        Self {
            speed: settings.island_speed[usize::from(is_tracked)],
            calm,
            sway: sway * calm,
            per_step: per_step * calm,
        }
    }
}

/// Motion of the body in a step.
#[derive(Clone, Copy)]
pub(in crate::live) struct BodyStep<'a> {
    /// Vertices before the step, metres; those after it are in the state.
    pub(in crate::live) from: &'a [P3],
    /// Time, s.
    pub(in crate::live) dt: f64,
    pub(in crate::live) teleported: bool,
}

/// Wakes islands that must not sleep on through a step, and gives the others the velocity of the skin below.
pub(in crate::live) fn wake_islands(model: &Model, state: &mut State, body: &BodyStep<'_>) {
    let c = &model.config;
    let State {
        garments,
        sleep,
        body: after,
        ..
    } = state;
    let to = after.vertices();
    if !(c.sleep && c.sleep_regions) {
        return sleep.reset_islands();
    }
    sleep.fit(&model.garments, to);
    let thresholds = Thresholds::new(c);
    let mut sources = follow_body(sleep, model, [body.from, to], &thresholds);
    if body.teleported {
        sleep.wake_all();
    }
    if sleep.is_all_awake() {
        return;
    }
    sources.push_moving_cloth(model, garments, sleep, thresholds.speed);
    let mut woken = Vec::new();
    for (g, islands) in sleep.islands.iter().enumerate() {
        for (r, island) in islands.iter().enumerate().filter(|i| i.1.asleep) {
            let boundary = &model.garments[g].islands.boundary_edges[r];
            if !(is_supported(island, [body.from, to], &thresholds)
                && is_boundary_still(&c.stillness, island, boundary, &garments[g].positions))
                || sources.reach(model, garments, g, r)
            {
                woken.push((g, r));
            }
        }
    }
    for (g, r) in woken {
        sleep.islands[g][r] = Island::default();
    }
    set_sleeping_velocities(model, garments, sleep, [body.from, to], body.dt);
}

/// Updates the references of the skin; returns skin that moved beyond what sleeping cloth follows.
fn follow_body(
    sleep: &mut SleepState,
    model: &Model,
    [from, to]: [&[P3]; 2],
    thresholds: &Thresholds,
) -> WakeSources {
    let is_all_awake = sleep.is_all_awake();
    let moved = |a: &P3, b: &P3, most: f32| (a - b).norm_squared() >= most * most;
    for ((at, steps), now) in sleep.calm.iter_mut().zip(to) {
        if moved(now, at, thresholds.calm) {
            (*at, *steps) = (*now, 0);
        } else {
            *steps = steps.saturating_add(1);
        }
    }
    let mut sources = WakeSources::default();
    for k in 0..model.skin_clusters.len() {
        let (mut points, mut farthest) = (Vec::new(), 0.0f32);
        for v in model.skin_clusters.members(k).iter().map(|v| *v as usize) {
            if moved(&to[v], &sleep.wake_reference[v], thresholds.sway) {
                sleep.wake_reference[v] = to[v];
                if !is_all_awake {
                    points.push(to[v]);
                    farthest = farthest.max((to[v] - from[v]).norm());
                }
            }
        }
        if !points.is_empty() {
            // It may have passed an island within this step.
            let distance = model.config.stillness.skin_distance;
            sources.push(points, distance + thresholds.sway + farthest, None);
        }
    }
    sources
}

/// The supporting skin moves within the thresholds.
fn is_supported(island: &Island, [from, to]: [&[P3]; 2], thresholds: &Thresholds) -> bool {
    let within = |v: usize, p: &P3, most: f32| (to[v] - p).norm_squared() < most * most;
    island.skin.iter().all(|(v, at)| {
        let v = *v as usize;
        within(v, at, thresholds.sway) && within(v, &from[v], thresholds.per_step)
    })
}

/// Its boundary edges are as they were when it fell asleep.
fn is_boundary_still(
    settings: &StillnessSettings,
    island: &Island,
    edges: &[[u32; 2]],
    positions: &[P3],
) -> bool {
    edges.iter().zip(&island.boundary).all(|([a, b], was)| {
        let is = positions[*b as usize] - positions[*a as usize];
        let length = was.norm();
        (is.norm() - length).abs() <= settings.wake_elongation * length
            && (is - was).norm() <= settings.wake_rotation * length
    })
}

/// Sleeping vertices move with the skin of a tracked body and stand on an exact one.
fn set_sleeping_velocities(
    model: &Model,
    garments: &mut [GarmentState],
    sleep: &SleepState,
    [from, to]: [&[P3]; 2],
    dt: f64,
) {
    let follows_skin = model.config.noise_deadband > 0.0 && from != to;
    for (g, (m, s)) in model.garments.iter().zip(garments).enumerate() {
        if !sleep.islands[g].iter().any(|island| island.asleep) {
            continue;
        }
        let sleeps = |v: usize| sleep.is_asleep(&m.islands, g, v as u32);
        let all = s.velocities.iter_mut().enumerate();
        if follows_skin {
            let edges = &m.sheet.edges;
            let moved = skin_displacements(edges, &s.nearest, from, to, sleeps);
            all.filter(|(v, _)| sleeps(*v))
                .for_each(|(v, u)| *u = moved[v] / dt as f32);
        } else {
            all.filter(|(v, _)| sleeps(*v))
                .for_each(|(_, u)| *u = V3::zeros());
        }
    }
}

/// Moves the sleeping vertices of a patch by their velocities through `dt` seconds.
pub(in crate::live) fn follow_sleeping(p: &mut PatchWork, dt: f64) {
    for i in (0..p.asleep.len()).filter(|i| p.asleep[*i]) {
        p.motion.displacement[i] = p.motion.velocity[i].scale(dt as f32);
    }
}

/// Puts islands to sleep after a step of `dt` seconds.
pub(in crate::live) fn put_islands_to_sleep(
    model: &Model,
    state: &mut State,
    patches: &[PatchWork],
    dt: f64,
) {
    let c = &model.config;
    if !(c.sleep && c.sleep_regions) {
        return;
    }
    let thresholds = Thresholds::new(c);
    let State {
        garments,
        sleep,
        body,
        ..
    } = state;
    measure_speeds(model, sleep, patches, &thresholds, dt);
    let slow_steps = c.stillness.slow_steps;
    let is_slow = |island: &Island| !island.asleep && island.slow_steps >= slow_steps;
    if !sleep.islands.iter().flatten().any(is_slow) {
        return;
    }
    let mut sources = WakeSources::default();
    sources.push_moving_cloth(model, garments, sleep, thresholds.speed);
    let mut tired = Vec::new();
    for (g, m) in model.garments.iter().enumerate() {
        let all = &sleep.islands[g];
        for (r, island) in all.iter().enumerate().filter(|i| is_slow(i.1)) {
            let is_fast = |q: &u32| all[*q as usize].speed >= thresholds.speed;
            if m.islands.adjacent[r].iter().any(is_fast) {
                continue;
            }
            let skin = supporting_skin(model, g, r, &garments[g], body.vertices());
            let is_calm = |v: &u32| sleep.calm[*v as usize].1 >= slow_steps;
            if skin.iter().all(is_calm) && !sources.reach(model, garments, g, r) {
                let slow_steps = island.slow_steps;
                tired.push((g, r, skin, slow_steps));
            }
        }
    }
    for (g, r, skin, slow_steps) in tired {
        let (m, s) = (&model.garments[g].islands, &mut garments[g]);
        for v in &m.members[r] {
            s.velocities[*v as usize] = V3::zeros();
        }
        let edge = |[a, b]: &[u32; 2]| s.positions[*b as usize] - s.positions[*a as usize];
        let at = |v: u32| (v, body.vertices()[v as usize]);
        sleep.islands[g][r] = Island {
            asleep: true,
            slow_steps,
            speed: 0.0,
            skin: skin.into_iter().map(at).collect(),
            boundary: m.boundary_edges[r].iter().map(edge).collect(),
        };
    }
}

/// Speed of each island in a step of `dt` seconds, and its slow steps.
fn measure_speeds(
    model: &Model,
    sleep: &mut SleepState,
    patches: &[PatchWork],
    thresholds: &Thresholds,
    dt: f64,
) {
    let mut patches = patches.iter();
    for (m, islands) in model.garments.iter().zip(&mut sleep.islands) {
        for (f, first) in m.patches.iter().zip(&m.islands.first) {
            let Some(p) = patches.next() else { return };
            for (island, r) in islands[*first..].iter_mut().zip(f.islands.windows(2)) {
                let moved = p.motion.displacement[r[0]..r[1]].iter();
                let mut squares: Vec<f32> = moved.map(|d| d.dot(*d)).collect();
                let square = percentile(&mut squares, SPEED_PERCENTILE).unwrap_or(0.0);
                island.speed = if island.asleep {
                    0.0
                } else {
                    square.sqrt() / dt as f32
                };
                island.slow_steps = if island.speed < thresholds.speed {
                    island.slow_steps + 1
                } else {
                    0
                };
            }
        }
    }
}

/// Body vertices that support an island or anchor it, in ascending order.
fn supporting_skin(
    model: &Model,
    garment: usize,
    island: usize,
    s: &GarmentState,
    body: &[P3],
) -> Vec<u32> {
    let islands = &model.garments[garment].islands;
    let near = model.config.stillness.skin_distance;
    let mut skin = Vec::new();
    for v in &islands.members[island] {
        let (x, [own, other]) = (s.positions[*v as usize], s.nearest[*v as usize]);
        skin.push(own);
        if (body[other as usize] - x).norm_squared() < near * near {
            skin.push(other);
        }
    }
    for a in &model.outfit.anchors[garment] {
        if islands.of[a.vertex as usize] as usize == island {
            skin.extend(a.body);
        }
    }
    skin.sort_unstable();
    skin.dedup();
    skin
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::CollisionBody;
    use crate::live::patch::begin;
    use crate::live::test_outfit::square_in_front;

    const DT: f64 = 1.0 / 60.0;
    /// Vertices that move, and a distance from them beyond all that wakes cloth, metres.
    const AT: usize = 0;
    const FAR: f32 = 0.1;

    fn wake(model: &Model, state: &mut State, from: &[P3], teleported: bool) {
        let body = BodyStep {
            from,
            dt: DT,
            teleported,
        };
        wake_islands(model, state, &body);
    }

    /// A square that sleeps after some still steps, and their number.
    fn asleep() -> (Model, State, Vec<P3>, u32) {
        let (model, mut state, body) = square_in_front(24, 0.01);
        let mut patches = Vec::new();
        let mut steps = 0;
        while !state.sleep.islands.iter().flatten().any(|i| i.asleep) {
            wake(&model, &mut state, &body, false);
            begin(&model, &state, &mut patches);
            put_islands_to_sleep(&model, &mut state, &patches, DT);
            steps += 1;
            assert!(steps < 100, "it never sleeps");
        }
        (model, state, body, steps)
    }

    fn moved(body: &[P3], is_moved: impl Fn(&P3) -> bool) -> Vec<P3> {
        let by = V3::new(0.0, 0.0, 0.004);
        let all = body.iter();
        all.map(|p| if is_moved(p) { p + by } else { *p }).collect()
    }

    #[test]
    fn still_islands_sleep_together_after_their_slow_steps() {
        let (model, state, _, steps) = asleep();
        assert_eq!(steps, model.config.stillness.slow_steps);
        assert!(state.sleep.islands[0].len() > 4);
        assert!(state.sleep.islands[0].iter().all(|i| i.asleep));
        let vertices = state.garments[0].positions.len();
        assert_eq!(state.sleep.sleeping(&model.garments), vertices);
    }

    #[test]
    fn moving_skin_wakes_what_it_supports_and_not_what_is_far_from_it() {
        let (model, mut state, body, _) = asleep();
        wake(&model, &mut state, &body, false);
        assert!(
            state.sleep.islands[0].iter().all(|i| i.asleep),
            "nothing moved"
        );
        let at = body[state.sleep.islands[0][AT].skin[0].0 as usize];
        let near = |p: &P3| (p - at).norm() < 0.01;
        let before = state.sleep.islands[0].clone();
        state.body = CollisionBody::unfiltered(&moved(&body, near));
        wake(&model, &mut state, &body, false);
        let mut far = 0;
        for (r, was) in before.iter().enumerate() {
            let is_asleep = state.sleep.islands[0][r].asleep;
            if was.skin.iter().any(|(_, p)| near(p)) {
                assert!(!is_asleep, "island {r} hangs on skin that moved");
            }
            let members = model.garments[0].islands.members[r].iter();
            let distance = members.map(|v| (state.garments[0].positions[*v as usize] - at).norm());
            if distance.fold(f32::MAX, f32::min) > FAR {
                assert!(is_asleep, "island {r} is far");
                far += 1;
            }
        }
        assert!(far > 0);
    }

    #[test]
    fn teleports_and_switches_wake_everything() {
        let (model, mut state, body, _) = asleep();
        wake(&model, &mut state, &body, true);
        assert!(state.sleep.is_all_awake());
        let (mut model, mut state, body, _) = asleep();
        model.config.sleep_regions = false;
        wake(&model, &mut state, &body, false);
        assert!(state.sleep.islands.is_empty());
    }
}
