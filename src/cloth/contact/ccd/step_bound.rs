//! Largest step along which no pair comes too close.

use super::pair_motion::PairMotion;
use super::time_of_impact::time_of_impact_before;
use crate::contact::pair::ContactPair;
use tryon_geometry::math::V3d;
use tryon_geometry::par::{self, Par};

/// Pairs that one thread tests in a row.
const CHUNK: usize = 512;

/// Linear motion of all vertices, and the separation to keep.
#[derive(Clone, Copy, Debug)]
pub struct StepMotion<'a> {
    /// Positions at time 0, shape `[vertices]`, metres.
    pub start: &'a [V3d],
    /// Positions at time 1.
    pub end: &'a [V3d],
    /// Distance that no pair may fall to, metres.
    pub min_separation: f64,
}

/// First impact among many pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstImpact {
    /// Lower bound of its time: the motion scaled by it keeps the separation.
    pub time: f64,
    /// Index of the pair; the first of those at the same time.
    pub pair: usize,
}

/// First impact of some pairs, `None` if the whole step is free. The same bits at any thread count.
///
/// # Panics
/// With fewer positions than the pairs' indices need.
pub fn first_impact(
    pairs: &[ContactPair],
    motion: &StepMotion<'_>,
    par: Par,
) -> Option<FirstImpact> {
    let mut firsts: Vec<Option<FirstImpact>> = Vec::new();
    par::map_into(par, pairs.len().div_ceil(CHUNK), 1, &mut firsts, |chunk| {
        let mut first: Option<FirstImpact> = None;
        let last = ((chunk + 1) * CHUNK).min(pairs.len());
        for pair in chunk * CHUNK..last {
            let moving = PairMotion::of(&pairs[pair], motion.start, motion.end);
            // A later impact is not looked for to the end.
            let horizon = first.map_or(1.0, |f| f.time);
            let time = time_of_impact_before(horizon, &moving, motion.min_separation);
            if let Some(time) = time.filter(|t| first.is_none_or(|f| *t < f.time)) {
                first = Some(FirstImpact { time, pair });
            }
        }
        first
    });
    firsts
        .into_iter()
        .flatten()
        .reduce(|a, b| if b.time < a.time { b } else { a })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ccd::time_of_impact;
    use rand::{Rng, SeedableRng};

    #[test]
    fn the_first_impact_is_the_least_time_of_all_pairs() {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(4);
        let mut points = |size: f64| -> Vec<V3d> {
            let mut point = || V3d::from_fn(|_, _| random.random_range(-size..size));
            (0..400).map(|_| point()).collect()
        };
        let start = points(1.0);
        let end: Vec<V3d> = start.iter().zip(points(0.05)).map(|(p, m)| p + m).collect();
        let pairs: Vec<ContactPair> = (0..4000u32)
            .map(|k| {
                let [a, b, c, d] = [k, 7 * k + 1, 11 * k + 2, 13 * k + 3].map(|i| i % 400);
                match k % 2 {
                    0 => ContactPair::VertexFace { v: a, f: [b, c, d] },
                    _ => ContactPair::EdgeEdge {
                        a: [a, b],
                        b: [c, d],
                    },
                }
            })
            .filter(|p| {
                let mut v = p.stencil();
                v.sort_unstable();
                v.windows(2).all(|w| w[0] != w[1])
            })
            .collect();
        let motion = StepMotion {
            start: &start,
            end: &end,
            min_separation: 0.0,
        };
        let times = pairs
            .iter()
            .map(|p| time_of_impact(&PairMotion::of(p, &start, &end), 0.0));
        let least = times.flatten().fold(f64::INFINITY, f64::min);
        let found = first_impact(&pairs, &motion, Par::Seq).expect("an impact");
        assert_eq!(found.time, least);
        assert!(found.time > 0.0 && found.time < 1.0);
        assert_eq!(first_impact(&pairs, &motion, Par::Rayon), Some(found));
        let still = StepMotion {
            end: &start,
            ..motion
        };
        assert_eq!(first_impact(&pairs, &still, Par::Seq), None);
    }
}
