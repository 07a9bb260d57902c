//! Incremental potential: the energy whose minimum is the end of an implicit step.

use super::energy_term::ordered_sum;
use super::model::{OfflineCloth, PinTarget};
use super::newton::NewtonSystem;
use crate::elastic::SheetMotion;
use nalgebra::Matrix3;
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;

/// Inertia, gravity, pins and shape of one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct StepPotential<'a> {
    pub(super) cloth: &'a OfflineCloth,
    /// Positions of the cloth at the step's begin (m), from where angles are continued.
    pub(super) start: &'a [V3d],
    /// Positions without forces (m).
    pub(super) inertial: &'a [V3d],
    /// h (s).
    pub(super) step: f64,
    /// 1/(γh)² (1/s²).
    pub(super) rate_squared: f64,
    pub(super) pins: &'a [PinTarget],
    /// Stiffness of a pin (N/m).
    pub(super) pin_stiffness: f64,
    /// Vertices that sleep; empty for none.
    pub(super) asleep: &'a [bool],
}

impl StepPotential<'_> {
    /// Energy at `x` (J).
    pub(super) fn value(&self, par: Par, x: &[V3d]) -> f64 {
        let shape = self.cloth.terms().iter();
        self.pointwise(par, x) + shape.map(|t| t.value(par, &self.motion(x))).sum::<f64>()
    }

    fn motion<'b>(&'b self, x: &'b [V3d]) -> SheetMotion<'b> {
        SheetMotion {
            start: self.start,
            now: x,
            asleep: self.asleep,
            step: self.step,
        }
    }

    /// Energy of inertia, gravity and pins (J).
    fn pointwise(&self, par: Par, x: &[V3d]) -> f64 {
        let cloth = self.cloth;
        let inertia = ordered_sum(par, cloth.len(), |i| {
            let apart = x[i] - self.inertial[i];
            let kinetic = 0.5 * self.rate_squared * apart.norm_squared();
            // Measured from the inertial position, so that the sum stays small beside its changes.
            cloth.mass[i] * (kinetic - cloth.gravity.dot(&apart))
        });
        inertia
            + (self.pins.iter())
                .map(|p| p.value(x, self.pin_stiffness))
                .sum::<f64>()
    }

    /// Energy, gradient and Hessian at `x`, replacing those in `out`; `out.shape` has the cloth's pattern.
    pub(super) fn assemble(&self, par: Par, x: &[V3d], out: &mut NewtonSystem) {
        let cloth = self.cloth;
        out.shape.clear();
        out.gradient.clear();
        out.gradient.resize(x.len(), V3d::zeros());
        out.value = self.pointwise(par, x);
        for (i, m) in cloth.mass.iter().enumerate() {
            let pull = (x[i] - self.inertial[i]) * self.rate_squared - cloth.gravity;
            out.add_diagonal(
                i,
                pull * *m,
                Matrix3::from_diagonal_element(m * self.rate_squared),
            );
        }
        let block = Matrix3::from_diagonal_element(self.pin_stiffness);
        for pin in self.pins {
            let gradient = pin.gradient(x, self.pin_stiffness);
            out.add_diagonal(pin.vertex as usize, gradient, block);
        }
        for term in cloth.terms() {
            out.value += term.assemble(par, &self.motion(x), &mut out.gradient, &mut out.shape);
        }
    }
}

impl NewtonSystem {
    /// Adds a term of one vertex.
    pub(super) fn add_diagonal(&mut self, vertex: usize, gradient: V3d, block: Matrix3<f64>) {
        self.gradient[vertex] += gradient;
        let slot = self.shape.pattern().diagonal_slot(vertex);
        *self.shape.block_mut(slot) += block;
    }
}
