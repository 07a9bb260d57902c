//! Motion of each vertex shortened as far as its own contacts ask, instead of one share for all.

use super::pair_motion::PairMotion;
use super::time_of_impact::time_of_impact_before;
use crate::contact::pair::ContactPair;
use crate::math::V3d;
use crate::par::{self, Par};

/// Pairs that one thread tests in a row.
const CHUNK: usize = 512;
/// Share of their distance that nearing pairs leave. Larger: vertices hold one another up in long chains; smaller: pairs
/// end where the barrier is steep.
const ROOM: f64 = 0.1;
/// Rounds of shortening before the rest shares one bound.
const ROUNDS: usize = 24;

/// Shortened vertices of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionLimits {
    /// Vertices that go less than the whole way.
    pub vertices: usize,
    /// Smallest share of the way; 1 if none is shortened.
    pub smallest: f64,
    /// Rounds of detection.
    pub rounds: usize,
}

/// Room that a motion leaves between the elements of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionRoom {
    /// Distance that no pair may fall to (m).
    pub min_separation: f64,
    /// Distance beyond it (m) of which pairs from farther apart leave a share; nearer ones leave that share of their own.
    pub reach: f64,
}

impl MotionRoom {
    /// Distance that a pair keeps (m).
    fn of(&self, pair: &ContactPair, start: &[V3d]) -> f64 {
        let distance = pair.separation(&pair.corners(start)).squared.sqrt();
        let beyond = (distance - self.min_separation).max(0.0);
        self.min_separation + ROOM * beyond.min(self.reach)
    }
}

/// Shortens `motion` (m) of each vertex so that every pair keeps its room while all move straight from `start`: vertices of
/// a pair that comes too close go to that time, then the pairs that they belong to are tested again. The same bits at any
/// thread count. Every candidate of the whole motion must be among the pairs.
///
/// # Panics
/// With fewer positions than the pairs' indices need.
pub fn free_motion(
    pairs: &[ContactPair],
    start: &[V3d],
    motion: &mut [V3d],
    room: &MotionRoom,
    par: Par,
) -> MotionLimits {
    let mut shares = vec![1.0; motion.len()];
    let mut tested: Vec<u32> = (0..pairs.len() as u32).collect();
    let mut end: Vec<V3d> = start.iter().zip(&*motion).map(|(x, d)| x + d).collect();
    let mut limits = MotionLimits::default();
    while !tested.is_empty() {
        limits.rounds += 1;
        let impacts = impacts(pairs, &tested, (start, &end), room, par);
        if limits.rounds > ROUNDS {
            let first = impacts.iter().map(|(_, time)| *time).fold(1.0, f64::min);
            shares.iter_mut().for_each(|s| *s *= first);
            break;
        }
        let changed = shorten(pairs, &impacts, &mut shares);
        for (v, _) in changed.iter().enumerate().filter(|(_, c)| **c) {
            end[v] = start[v] + motion[v] * shares[v];
        }
        let touched = |p: &ContactPair| p.stencil().iter().any(|v| changed[*v as usize]);
        tested.clear();
        if limits.rounds == ROUNDS {
            tested.extend(0..pairs.len() as u32);
            continue;
        }
        let again = pairs.iter().enumerate().filter(|(_, p)| touched(p));
        tested.extend(again.map(|(k, _)| k as u32));
    }
    for (d, share) in motion.iter_mut().zip(&shares) {
        *d *= *share;
    }
    limits.vertices = shares.iter().filter(|s| **s < 1.0).count();
    limits.smallest = shares.iter().copied().fold(1.0, f64::min);
    limits
}

/// Tested pairs that come too close, with the time.
fn impacts(
    pairs: &[ContactPair],
    tested: &[u32],
    (start, end): (&[V3d], &[V3d]),
    room: &MotionRoom,
    par: Par,
) -> Vec<(u32, f64)> {
    let mut times: Vec<Vec<(u32, f64)>> = Vec::new();
    par::map_into(par, tested.len().div_ceil(CHUNK), 1, &mut times, |chunk| {
        let own = &tested[chunk * CHUNK..((chunk + 1) * CHUNK).min(tested.len())];
        let impact = |k: &u32| {
            let pair = &pairs[*k as usize];
            let moving = PairMotion::of(pair, start, end);
            Some((
                *k,
                time_of_impact_before(1.0, &moving, room.of(pair, start))?,
            ))
        };
        own.iter().filter_map(impact).collect()
    });
    times.concat()
}

/// Shortens the vertices of pairs that come too close; true for those that changed.
fn shorten(pairs: &[ContactPair], impacts: &[(u32, f64)], shares: &mut [f64]) -> Vec<bool> {
    let mut factors = vec![1.0f64; shares.len()];
    for (k, time) in impacts {
        for v in pairs[*k as usize].stencil() {
            let factor = &mut factors[v as usize];
            *factor = factor.min(*time);
        }
    }
    for (share, factor) in shares.iter_mut().zip(&factors) {
        *share *= factor;
    }
    factors.iter().map(|f| *f < 1.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOMY: MotionRoom = MotionRoom {
        min_separation: 0.0,
        reach: 1e-3,
    };

    /// A triangle, a vertex 20 mm above it and one far away.
    fn start() -> Vec<V3d> {
        let corner = |x: f64, y: f64, z: f64| V3d::new(x, y, z);
        vec![
            corner(0.0, 0.0, 0.0),
            corner(0.1, 0.0, 0.0),
            corner(0.0, 0.0, 0.1),
            corner(0.03, 0.02, 0.03),
            corner(5.0, 0.0, 0.0),
        ]
    }

    #[test]
    fn only_vertices_that_would_meet_are_shortened_and_leave_room() {
        let pairs = [ContactPair::VertexFace { v: 3, f: [0, 1, 2] }];
        let x = start();
        let mut motion = vec![V3d::zeros(); 5];
        motion[3] = V3d::new(0.0, -0.05, 0.0);
        motion[4] = V3d::new(0.0, -0.05, 0.0);
        let limits = free_motion(&pairs, &x, &mut motion, &ROOMY, Par::Seq);
        assert_eq!(motion[4], V3d::new(0.0, -0.05, 0.0));
        let left = x[3].y + motion[3].y;
        assert!((ROOM * ROOMY.reach..2e-3).contains(&left), "{left}");
        assert!(limits.vertices == 4 && limits.smallest < 0.4, "{limits:?}");
    }

    #[test]
    fn what_moves_along_is_not_shortened() {
        let pairs = [ContactPair::VertexFace { v: 3, f: [0, 1, 2] }];
        let mut motion = vec![V3d::new(0.3, -2.0, 1.0); 5];
        let before = motion.clone();
        let limits = free_motion(&pairs, &start(), &mut motion, &ROOMY, Par::Seq);
        assert_eq!((limits.vertices, limits.smallest), (0, 1.0));
        assert_eq!(motion, before);
    }
}
