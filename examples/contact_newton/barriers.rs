//! Barriers and Hessians that are compared.

use tryon::cloth::contact::{
    ActivePair, Barrier, BarrierSample, ContactPair, Curvature, ParallelMollifier,
};
use tryon::geometry::math::{ElementEnergy, V3d, project_psd};

/// Barrier as a function of the gap g = d − ξ over its activation, y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Profile {
    /// That of the library: −(y − 1)² ln y of squared distances.
    SquaredLog,
    /// −(y − 1)² ln y.
    Log,
    /// (1 − y)² / 2 above ½, a logarithm below, twice differentiable (Chen et al. 2025, OGC).
    QuadraticLog,
    /// (1 − y)³ / 3.
    Cubic,
}

/// Hessian that Newton's method uses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum HessianKind {
    /// Nearest semi-definite matrix, by eigenvalues.
    Nearest,
    /// Semi-definite parts of the terms.
    ByTerms,
    /// Curvature along the distance.
    AlongOnly,
}

/// Energy of contact pairs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactEnergy {
    pub(crate) profile: Profile,
    pub(crate) hessian: HessianKind,
    pub(crate) barrier: Barrier,
}

impl ContactEnergy {
    /// Barrier at a squared distance (m²).
    pub(crate) fn sample(&self, squared: f64) -> BarrierSample {
        let Barrier {
            stiffness,
            activation,
            thickness,
        } = self.barrier;
        let d = squared.sqrt();
        let y = (d - thickness) / activation;
        if self.profile == Profile::SquaredLog || !(y > 0.0 && y < 1.0) {
            return self.barrier.sample(squared);
        }
        let (z, log) = (1.0 - y, y.ln());
        let [value, first, second] = match self.profile {
            Profile::QuadraticLog if y < 0.5 => {
                let below = 0.125 - 0.25 * (2.0 * y).ln();
                [below, -0.25 / y, 0.25 / (y * y)]
            }
            Profile::QuadraticLog => [0.5 * z * z, -z, 1.0],
            Profile::Cubic => [z * z * z / 3.0, -z * z, 2.0 * z],
            _ => [
                -z * z * log,
                z * (2.0 * log - z / y),
                z * (4.0 + z / y) / y - 2.0 * log,
            ],
        }
        .map(|b| b * stiffness);
        let (first, second) = (first / activation, second / (activation * activation));
        BarrierSample {
            value,
            first: first / (2.0 * d),
            second: (second - first / d) / (4.0 * squared),
        }
    }
    pub(crate) fn value(&self, active: &ActivePair, corners: &[V3d; 4]) -> f64 {
        let value = self.sample(active.pair.separation(corners).squared).value;
        if value > 0.0 {
            value * mollifier(active, corners).map_or(1.0, |m| m.value())
        } else {
            0.0
        }
    }
    pub(crate) fn energy(&self, active: &ActivePair, corners: &[V3d; 4]) -> ElementEnergy<12> {
        let curvature = match self.hessian {
            HessianKind::ByTerms => Curvature::Projected,
            HessianKind::AlongOnly => Curvature::GaussNewton,
            HessianKind::Nearest => {
                let mut energy = self.exact(active, corners);
                energy.hessian = project_psd(&energy.hessian);
                return energy;
            }
        };
        let energy = self.barrier.energy(active, corners, curvature);
        energy.unwrap_or_default()
    }
    fn exact(&self, active: &ActivePair, corners: &[V3d; 4]) -> ElementEnergy<12> {
        let distance = active.pair.separation(corners).expansion::<12>();
        let b = self.sample(distance.value);
        let outer = distance.gradient * distance.gradient.transpose();
        let mut energy = ElementEnergy {
            value: b.value,
            gradient: distance.gradient * b.first,
            hessian: distance.hessian * b.first + outer * b.second,
        };
        if let Some(m) = mollifier(active, corners) {
            let m = m.expansion();
            let mixed = m.gradient * energy.gradient.transpose();
            energy.hessian = energy.hessian * m.value + m.hessian * b.value;
            energy.hessian += mixed + mixed.transpose();
            energy.gradient = energy.gradient * m.value + m.gradient * b.value;
            energy.value *= m.value;
        }
        energy
    }
}

fn mollifier(active: &ActivePair, [a0, a1, b0, b1]: &[V3d; 4]) -> Option<ParallelMollifier> {
    match active.pair {
        ContactPair::EdgeEdge { .. } => {
            ParallelMollifier::new(a1 - a0, b1 - b0, active.parallel_threshold)
        }
        _ => None,
    }
}
