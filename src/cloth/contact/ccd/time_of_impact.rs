//! First time of impact of a pair, by covering time with certificates of separation.

use super::arithmetic::{Arithmetic, DoubleDouble, Vector};
use super::closest_direction::{closest_direction, feature_directions, projects_inside};
use super::coplanarity::Coplanarity;
use super::pair_motion::PairMotion;
use super::separating_plane::PlaneTest;

/// Certificates tried before a pair counts as in impact at the time reached. More cost time on grazing pairs, fewer
/// cause false alarms there.
const MAX_STEPS: usize = 64;
/// Time after which a plain impact shows by the sides changing. Longer mistakes a near miss, shorter asks for more
/// digits than f64 has.
const CROSSING_TIME: f64 = 1e-9;
/// Distance of a plain impact from every side, in parts of the polygon's double area.
const CROSSING_MARGIN: f64 = 1e-4;

/// Lower bound of the first time in [0, 1] at which the distance of the pair falls to `min_separation` (metres).
///
/// `None` if it doesn't. The motion scaled by the result keeps the separation, including the roundings of the scaling;
/// 0 where the pair starts within the separation, and where a position isn't finite.
pub fn time_of_impact(motion: &PairMotion, min_separation: f64) -> Option<f64> {
    time_of_impact_before(1.0, motion, min_separation)
}

/// True if the pair touches on its way, the motion taken as exact.
///
/// Pairs that f64 leaves open are decided with twice its digits: what touches by less than some 10⁻³⁰ of its size and
/// distance travelled counts as touching.
pub fn has_impact(motion: &PairMotion) -> bool {
    let Some(cover) = Cover::<f64>::new(motion, 0.0) else {
        return false;
    };
    let Some(time) = cover.first_uncovered(0.0, 1.0) else {
        return false;
    };
    if cover.crosses_at(time) {
        return true;
    }
    let (time, end) = (DoubleDouble::of(time), DoubleDouble::of(1.0));
    Cover::new(motion, 0.0).is_some_and(|fine| fine.first_uncovered(time, end).is_some())
}

/// [`time_of_impact`], `None` as well for an impact later than `horizon`. The horizon changes no other result.
pub(super) fn time_of_impact_before(
    horizon: f64,
    motion: &PairMotion,
    min_separation: f64,
) -> Option<f64> {
    let separation = min_separation + motion.scaling_error();
    Cover::<f64>::new(motion, separation)?.first_uncovered(0.0, horizon)
}

/// Certificates of one pair.
struct Cover<S> {
    planes: PlaneTest<S>,
    coplanarity: Coplanarity<S>,
}

impl<S: Arithmetic> Cover<S> {
    /// `None` if the boxes of the pair keep the separation.
    fn new(motion: &PairMotion, separation: f64) -> Option<Self> {
        let planes = PlaneTest::new(motion.polygon(), separation);
        if planes.axes_separate() {
            return None;
        }
        let coplanarity = Coplanarity::new(&motion.frames(), separation);
        Some(Self {
            planes,
            coplanarity,
        })
    }

    /// First time after `start` that no certificate covers, `None` if it is `horizon` or later.
    fn first_uncovered(&self, start: S, horizon: S) -> Option<S> {
        let mut time = start;
        for _ in 0..MAX_STEPS {
            let Some(next) = self.advance(time) else {
                return Some(time);
            };
            if next >= horizon {
                return None;
            }
            time = next;
        }
        Some(time)
    }

    /// A later time up to which the pair stays separated, `None` if no certificate holds at `time`.
    fn advance(&self, time: S) -> Option<S> {
        let clear = self.coplanarity.clear_until(time);
        if clear >= S::of(1.0) {
            return Some(clear);
        }
        let corners = self.planes.polygon().at(time);
        let normal = self.coplanarity.normal_at(time);
        let reach = |n: Vector<S>| {
            let span = self.planes.span(&n);
            (span.low <= time && span.high > time).then_some(span.high)
        };
        let fixed = reach(closest_direction(&corners, &normal)).unwrap_or(time);
        let best = if fixed > clear { fixed } else { clear };
        if best > time {
            return Some(best);
        }
        feature_directions(&corners, &normal).find_map(reach)
    }

    /// True if the points pass through one plane just after `time`, the origin well inside the polygon.
    fn crosses_at(&self, time: S) -> bool {
        let later = time + S::of(CROSSING_TIME);
        if !(later <= S::of(1.0)) {
            return false;
        }
        let is_inside = |t| {
            let normal = self.coplanarity.normal_at(t);
            projects_inside(&self.planes.polygon().at(t), &normal, CROSSING_MARGIN)
        };
        let earlier = time - S::of(CROSSING_TIME);
        let sides = [earlier, later].map(|t| self.coplanarity.side_at(t));
        sides[0] * sides[1] < 0 && is_inside(time) && is_inside(later)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ccd::PairKind;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use tryon_geometry::math::V3d;

    const KINDS: [PairKind; 2] = [PairKind::VertexFace, PairKind::EdgeEdge];

    fn pair(kind: PairKind, start: [[f64; 3]; 4], end: [[f64; 3]; 4]) -> PairMotion {
        PairMotion {
            kind,
            start: start.map(V3d::from),
            end: end.map(V3d::from),
        }
    }

    const FACE: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];

    fn drop(from: [f64; 3], to: [f64; 3]) -> PairMotion {
        let [a, b, c] = FACE;
        pair(PairKind::VertexFace, [from, a, b, c], [to, a, b, c])
    }

    fn random_vector(random: &mut Pcg64Mcg) -> V3d {
        V3d::from_fn(|_, _| random.random_range(-1.0..1.0))
    }

    /// A pair whose simplices meet at a known time, at a known scale and offset.
    fn meeting(
        random: &mut Pcg64Mcg,
        kind: PairKind,
        scale: f64,
        offset: f64,
    ) -> (PairMotion, f64) {
        let time = random.random_range(0.0..1.0);
        let mut points: [V3d; 4] = std::array::from_fn(|_| random_vector(random));
        let [u, v] = [0; 2].map(|_| random.random_range(0.0..1.0f64));
        match kind {
            PairKind::VertexFace => {
                let [u, v] = if u + v > 1.0 {
                    [1.0 - u, 1.0 - v]
                } else {
                    [u, v]
                };
                points[0] = points[1] * (1.0 - u - v) + points[2] * u + points[3] * v;
            }
            PairKind::EdgeEdge => {
                let contact = points[0].lerp(&points[1], u);
                let shift = contact - points[2].lerp(&points[3], v);
                (points[2], points[3]) = (points[2] + shift, points[3] + shift);
            }
        }
        let offset = random_vector(random) * offset;
        let velocity: [V3d; 4] = std::array::from_fn(|_| random_vector(random));
        let at = |t: f64| {
            std::array::from_fn(|k| (points[k] + velocity[k] * (t - time)) * scale + offset)
        };
        let (start, end) = (at(0.0), at(1.0));
        (PairMotion { kind, start, end }, time)
    }

    fn scaled(motion: &PairMotion, t: f64) -> PairMotion {
        let end = std::array::from_fn(|k| motion.start[k] + (motion.end[k] - motion.start[k]) * t);
        PairMotion { end, ..*motion }
    }

    #[test]
    fn a_falling_vertex_hits_the_face_and_misses_beside_it() {
        let time =
            time_of_impact(&drop([0.2, 1.0, 0.2], [0.2, -1.0, 0.2]), 0.0).expect("an impact");
        assert!(time <= 0.5 && time > 0.5 - 1e-12, "{time}");
        assert_eq!(
            time_of_impact(&drop([0.6, 1.0, 0.6], [0.6, -1.0, 0.6]), 0.0),
            None
        );
        assert_eq!(
            time_of_impact(&drop([0.2, 1.0, 0.2], [0.2, 1e-9, 0.2]), 0.0),
            None
        );
        let time =
            time_of_impact(&drop([0.2, 1.0, 0.2], [0.2, -1.0, 0.2]), 0.1).expect("an impact");
        assert!(time <= 0.45 && time > 0.45 - 1e-9, "{time}");
    }

    #[test]
    fn known_impacts_are_never_missed_nor_late() {
        let mut random = Pcg64Mcg::seed_from_u64(1);
        for (scale, offset) in [
            (1.0, 0.0),
            (1e-3, 0.0),
            (1e3, 0.0),
            (1e-3, 1e3),
            (1.0, 1e3),
            (1e3, 1e3),
        ] {
            for kind in KINDS {
                for _ in 0..3000 {
                    let (motion, latest) = meeting(&mut random, kind, scale, offset);
                    let time = time_of_impact(&motion, 0.0);
                    // The construction itself rounds by this much of the time.
                    let rounding = 1e-12 * (1.0 + offset / scale);
                    let early = time.unwrap_or_else(|| panic!("{motion:?} at {latest}"));
                    assert!(
                        early <= latest + rounding,
                        "{motion:?}: {early} after {latest}"
                    );
                }
            }
        }
    }

    #[test]
    fn scaled_motions_are_free() {
        let mut random = Pcg64Mcg::seed_from_u64(2);
        for kind in KINDS {
            for separation in [0.0, 1e-3] {
                for _ in 0..2000 {
                    let (motion, _) = meeting(&mut random, kind, 1.0, 10.0);
                    let time = time_of_impact(&motion, separation).expect("an impact");
                    if time == 0.0 {
                        continue; // starts within the separation
                    }
                    // A last bit of the margin covers the rounding of scaling; the next query asks for it anew.
                    let next = time_of_impact(&scaled(&motion, time * (1.0 - 1e-9)), separation);
                    assert!(next.is_none_or(|t| t > 0.999), "{motion:?} {time} {next:?}");
                }
            }
        }
    }

    #[test]
    fn degenerate_pairs_hit_and_miss_as_their_points_do() {
        let still = [0.0; 3];
        for (start, end, meets) in [
            // A point at rest on a point, and away from it.
            ([still; 4], [still; 4], true),
            (
                [[1.0, 0.0, 0.0], still, still, still],
                [[2.0, 0.0, 0.0], still, still, still],
                false,
            ),
            (
                [[1.0, 0.0, 0.0], still, still, still],
                [[-1.0, 0.0, 0.0], still, still, still],
                true,
            ),
            // A point past a needle, and through it.
            (
                [[1.0, 0.1, 0.0], still, [0.0, 1.0, 0.0], [0.0, 2.0, 0.0]],
                [[-1.0, 0.1, 1e-6], still, [0.0, 1.0, 0.0], [0.0, 2.0, 0.0]],
                false,
            ),
            (
                [[1.0, 0.1, 0.0], still, [0.0, 1.0, 0.0], [0.0, 2.0, 0.0]],
                [[-1.0, 0.1, 0.0], still, [0.0, 1.0, 0.0], [0.0, 2.0, 0.0]],
                true,
            ),
        ] {
            let found = has_impact(&pair(PairKind::VertexFace, start, end));
            assert_eq!(found, meets, "{start:?} {end:?}");
        }
        // Parallel edges: meet sideways, pass over each other, slide along one line.
        let edges = |y: f64, z: f64| [still, [1.0, 0.0, 0.0], [0.2, y, z], [1.2, y, z]];
        for (from, to, meets) in [
            (edges(1.0, 0.0), edges(-1.0, 0.0), true),
            (edges(1.0, 1e-9), edges(-1.0, 1e-9), false),
            (edges(0.0, 0.0), edges(0.0, 0.0), true),
            (edges(1.0, 1.0), edges(0.5, 0.5), false),
        ] {
            assert_eq!(
                has_impact(&pair(PairKind::EdgeEdge, from, to)),
                meets,
                "{from:?} {to:?}"
            );
        }
        let far = |x: f64| {
            [
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [x, 0.0, 0.0],
                [x + 1.0, 0.0, 0.0],
            ]
        };
        assert!(!has_impact(&pair(PairKind::EdgeEdge, far(3.0), far(1.5))));
        assert!(has_impact(&pair(PairKind::EdgeEdge, far(3.0), far(0.5))));
    }

    #[test]
    fn positions_that_are_not_finite_allow_no_step() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let moved = drop([0.2, 1.0, 0.2], [0.2, bad, 0.2]);
            assert_eq!(time_of_impact(&moved, 0.0), Some(0.0), "{bad}");
        }
    }
}
