//! Logarithmic barrier of the distance (Li et al. 2020, IPC, eq. 6) beyond a thickness (Li et al. 2021, Codimensional
//! IPC, eq. 6), of one contact pair.

use super::composition::{BarrierSample, Curvature, compose};
use super::mollified::compose_mollified;
use crate::contact::distance::ParallelMollifier;
use crate::contact::pair::{ActivePair, ContactPair};
use tryon_geometry::math::{ElementEnergy, V3d};

/// Barrier κ b(y) = −κ (y − 1)² ln y of y = (d² − ξ²) / ((ξ + d̂)² − ξ²): zero from y = 1 on, infinite at y = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Barrier {
    /// κ (J), of a pair of weight 1.
    pub stiffness: f64,
    /// d̂ (m): distance beyond the thickness at which the barrier begins.
    pub activation: f64,
    /// ξ (m): distance that nothing goes below.
    pub thickness: f64,
}

impl Barrier {
    /// Distance at which the barrier begins, ξ + d̂ (m).
    pub fn reach(&self) -> f64 {
        self.thickness + self.activation
    }
    /// Barrier at a squared distance (m²); at and below the thickness an infinite value with derivatives of zero.
    pub fn sample(&self, squared: f64) -> BarrierSample {
        let (floor, reach) = (self.thickness * self.thickness, self.reach());
        let range = reach * reach - floor;
        let y = (squared - floor) / range;
        if y >= 1.0 {
            return BarrierSample::default();
        }
        if !(y > 0.0) {
            return BarrierSample {
                value: f64::INFINITY,
                ..BarrierSample::default()
            };
        }
        let (log, z) = (y.ln(), y - 1.0);
        let first = -z * (2.0 * log + z / y);
        let second = -2.0 * log - z * (4.0 - z / y) / y;
        BarrierSample {
            value: -self.stiffness * z * z * log,
            first: self.stiffness * first / range,
            second: self.stiffness * second / (range * range),
        }
    }
    /// Energy of a pair at these [`ContactPair::corners`] (J); infinite at and below the thickness.
    pub fn value(&self, active: &ActivePair, corners: &[V3d; 4]) -> f64 {
        if active.pair.box_gap_squared(corners) >= self.reach() * self.reach() {
            return 0.0;
        }
        let value = self.sample(active.pair.separation(corners).squared).value;
        let mollifier = mollifier(active, corners).map_or(1.0, |m| m.value());
        if value > 0.0 {
            value * mollifier * active.weight
        } else {
            0.0
        }
    }
    /// Force that pushes the two features of a pair apart (N): |dE/dd| without that of the mollifier.
    pub fn load(&self, active: &ActivePair, corners: &[V3d; 4]) -> f64 {
        let squared = active.pair.separation(corners).squared;
        let mollifier = mollifier(active, corners).map_or(1.0, |m| m.value());
        -2.0 * self.sample(squared).first * squared.sqrt() * mollifier * active.weight
    }
    /// Energy of a pair with its derivatives at these corners; `None` out of reach.
    ///
    /// At and below the thickness the value is infinite and the derivatives are zero.
    pub fn energy(
        &self,
        active: &ActivePair,
        corners: &[V3d; 4],
        curvature: Curvature,
    ) -> Option<ElementEnergy<12>> {
        let separation = active.pair.separation(corners);
        let reach = self.reach();
        if separation.squared >= reach * reach {
            return None;
        }
        let sample = self.sample(separation.squared).scaled(active.weight);
        if !sample.value.is_finite() {
            return Some(ElementEnergy {
                value: f64::INFINITY,
                ..ElementEnergy::default()
            });
        }
        Some(match mollifier(active, corners) {
            None => compose(&separation, &sample, curvature),
            Some(m) => compose_mollified(&separation, &sample, &m, curvature),
        })
    }
}

/// Mollifier of the pair, where it is not 1.
fn mollifier(active: &ActivePair, [a0, a1, b0, b1]: &[V3d; 4]) -> Option<ParallelMollifier> {
    match active.pair {
        ContactPair::EdgeEdge { .. } => {
            ParallelMollifier::new(a1 - a0, b1 - b0, active.parallel_threshold)
        }
        ContactPair::VertexFace { .. } => None,
    }
}
