//! Boxes of elements along a step, inflated so that two elements may come within the contact distance only if their boxes
//! overlap.

use super::ContactSweep;
use tryon_geometry::math::V3d;

/// Axis-aligned box, rounded outwards to single precision, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ElementBox {
    pub(super) low: [f32; 3],
    pub(super) high: [f32; 3],
}

impl Default for ElementBox {
    /// Overlaps nothing.
    fn default() -> Self {
        Self {
            low: [f32::INFINITY; 3],
            high: [f32::NEG_INFINITY; 3],
        }
    }
}

/// A sweep seen from the mean motion of all vertices, which changes no distance: what moves together keeps small boxes.
#[derive(Clone, Copy, Debug)]
pub(super) struct SweepFrame<'a> {
    sweep: ContactSweep<'a>,
    /// Distance by which boxes grow (m).
    growth: f64,
    /// Mean displacement, metres; zero where it isn't finite.
    shift: V3d,
}

impl<'a> SweepFrame<'a> {
    pub(super) fn new(sweep: &ContactSweep<'a>) -> Self {
        let moves = sweep.start.iter().zip(sweep.end).map(|(a, b)| b - a);
        let mean = moves.sum::<V3d>() / sweep.start.len().max(1) as f64;
        let is_finite = mean.iter().all(|c| c.is_finite());
        Self {
            sweep: *sweep,
            growth: 0.5 * sweep.distance,
            shift: if is_finite { mean } else { V3d::zeros() },
        }
    }

    /// The same for the boxes of the obstacle, which make up the rest of its distance.
    pub(super) fn of_obstacle(&self) -> Self {
        Self {
            growth: self.sweep.obstacle_distance - self.growth,
            ..*self
        }
    }
}

impl ElementBox {
    /// Box of the vertices of one element over the whole step. An element whose position isn't finite fills space.
    pub(super) fn of(vertices: &[u32], frame: &SweepFrame<'_>) -> Self {
        let (sweep, shift, grown) = (&frame.sweep, &frame.shift, frame.growth);
        let (mut low, mut high) = (V3d::repeat(f64::INFINITY), V3d::repeat(f64::NEG_INFINITY));
        let mut is_finite = true;
        for v in vertices {
            let ends = [sweep.start[*v as usize], sweep.end[*v as usize] - shift];
            for p in ends {
                low = low.inf(&p);
                high = high.sup(&p);
                is_finite &= p.iter().all(|c| c.is_finite());
            }
        }
        if !is_finite {
            return Self {
                low: [f32::NEG_INFINITY; 3],
                high: [f32::INFINITY; 3],
            };
        }
        // Bounds the rounding of the sums, also where they cancel.
        let outwards = |k: usize, c: f64| {
            grown + 4.0 * f64::EPSILON * (c.abs() + grown.abs() + 2.0 * shift[k].abs())
        };
        Self {
            low: std::array::from_fn(|k| ((low[k] - outwards(k, low[k])) as f32).next_down()),
            high: std::array::from_fn(|k| ((high[k] + outwards(k, high[k])) as f32).next_up()),
        }
    }

    pub(super) fn overlaps(&self, other: &Self) -> bool {
        (0..3).fold(true, |meets, c| {
            meets & (self.low[c] <= other.high[c]) & (other.low[c] <= self.high[c])
        })
    }
}
