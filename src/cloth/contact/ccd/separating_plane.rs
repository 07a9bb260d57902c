//! Time span over which a fixed plane through the origin separates it from a moving polygon, rounded inwards.
//!
//! Each corner's height over the plane is linear in time, so one plane is a certificate for a whole interval.

use super::arithmetic::{Arithmetic, UNDERFLOW, Vector, dot, magnitudes};
use super::pair_motion::MovingPolygon;
use tryon_geometry::math::V3d;

/// Roundings of a height (difference 1, product 1, sums 2) and of its zero (12), in units of the arithmetic.
const HEIGHT_ROUNDINGS: f64 = 16.0;
/// Roundings of a quotient (4), doubled, and of a product with them.
const QUOTIENT_ROUNDINGS: f64 = 8.0;

/// Closed interval of time; empty where `low > high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TimeSpan<S> {
    pub(super) low: S,
    pub(super) high: S,
}

/// Separation test of one polygon at one minimum separation.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneTest<S> {
    polygon: MovingPolygon<S>,
    /// Error of a height per unit of each component of the direction, metres.
    error: V3d,
    /// Distance to keep, metres.
    separation: f64,
}

impl<S: Arithmetic> PlaneTest<S> {
    pub(super) fn new(polygon: MovingPolygon<S>, separation: f64) -> Self {
        Self {
            error: polygon.extent() * (HEIGHT_ROUNDINGS * S::UNIT),
            polygon,
            separation,
        }
    }

    pub(super) fn polygon(&self) -> &MovingPolygon<S> {
        &self.polygon
    }

    /// Height that counts as separated along a direction with components of these magnitudes (any length).
    fn threshold(&self, n: &V3d) -> f64 {
        let kept = if self.separation > 0.0 {
            self.separation * n.norm() * (1.0 + 16.0 * f64::EPSILON)
        } else {
            0.0
        };
        kept + self.error.dot(n) + UNDERFLOW
    }

    /// True if a plane along an axis separates over the whole of [0, 1]: the test of bounding boxes.
    pub(super) fn axes_separate(&self) -> bool {
        let all = || self.polygon.start.iter().chain(&self.polygon.end);
        (0..3).any(|c| {
            let threshold = S::of(self.separation + self.error[c] + UNDERFLOW);
            all().all(|p| p[c] > threshold) || all().all(|p| -p[c] > threshold)
        })
    }

    /// Times at which all corners lie further along `n` than the minimum separation.
    pub(super) fn span(&self, n: &Vector<S>) -> TimeSpan<S> {
        let threshold = S::of(self.threshold(&magnitudes(n)));
        let (zero, one) = (S::of(0.0), S::of(1.0));
        let shrink = S::of(QUOTIENT_ROUNDINGS * S::UNIT);
        let (mut low, mut high) = (zero, one);
        for (a, b) in self.polygon.start.iter().zip(&self.polygon.end) {
            let (a, b) = (dot(n, a) - threshold, dot(n, b) - threshold);
            match (a > zero, b > zero) {
                (true, true) => {}
                (true, false) => {
                    let until = a / (a - b) * (one - shrink);
                    high = if until < high { until } else { high };
                }
                (false, true) => {
                    let from = a / (a - b) * (one + shrink);
                    low = if from > low { from } else { low };
                }
                // Also NaN: nothing is separated.
                (false, false) => {
                    return TimeSpan {
                        low: one,
                        high: zero,
                    };
                }
            }
        }
        TimeSpan { low, high }
    }
}
