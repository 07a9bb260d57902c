//! Second-order jet in three variables: value, gradient and Hessian carried through arithmetic.

use nalgebra::{Matrix3, Vector3};
use std::ops::{Add, Mul, Sub};
use tryon_geometry::math::project_psd;

/// Function of three variables expanded to second order at a point.
///
/// As the energy density of a sheet: `value` (N/m), `gradient` the stress (N/m) conjugate to the strain, `hessian` the
/// tangent stiffness (N/m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet {
    /// Value.
    pub value: f64,
    /// First derivatives.
    pub gradient: Vector3<f64>,
    /// Second derivatives, symmetric.
    pub hessian: Matrix3<f64>,
}

impl Jet {
    /// Nearest positive semi-definite matrix to the Hessian.
    pub fn positive_hessian(&self) -> Matrix3<f64> {
        if self.hessian.cholesky().is_some() {
            return self.hessian;
        }
        project_psd(&self.hessian)
    }
}

/// Number of three variables: a [`Jet`], or its value alone.
pub(super) trait Smooth:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Mul<f64, Output = Self>
{
    /// Constant.
    fn constant(value: f64) -> Self;
    /// Variable number `axis`.
    fn variable(axis: usize, value: f64) -> Self;
    /// ½ zᵀ C z.
    fn quadratic(c: &Matrix3<f64>, z: &Vector3<f64>) -> Self;
    /// Value.
    fn real(self) -> f64;
    /// Function with these values of f, f′ and f″.
    fn chain(self, derivatives: [f64; 3]) -> Self;
    /// Square root of a positive number.
    fn sqrt(self) -> Self {
        let root = self.real().sqrt();
        self.chain([root, 0.5 / root, -0.25 / (root * self.real())])
    }
    /// Reciprocal of a number other than zero.
    fn recip(self) -> Self {
        let r = self.real().recip();
        self.chain([r, -r * r, 2.0 * r * r * r])
    }
}

impl Smooth for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn variable(_: usize, value: f64) -> Self {
        value
    }
    fn quadratic(c: &Matrix3<f64>, z: &Vector3<f64>) -> Self {
        0.5 * z.dot(&(c * z))
    }
    fn real(self) -> f64 {
        self
    }
    fn chain(self, derivatives: [f64; 3]) -> Self {
        derivatives[0]
    }
}

impl Smooth for Jet {
    fn constant(value: f64) -> Self {
        Self {
            value,
            gradient: Vector3::zeros(),
            hessian: Matrix3::zeros(),
        }
    }
    fn variable(axis: usize, value: f64) -> Self {
        let mut jet = Self::constant(value);
        jet.gradient[axis] = 1.0;
        jet
    }
    fn quadratic(c: &Matrix3<f64>, z: &Vector3<f64>) -> Self {
        let gradient = c * z;
        Self {
            value: 0.5 * z.dot(&gradient),
            gradient,
            hessian: *c,
        }
    }
    fn real(self) -> f64 {
        self.value
    }
    fn chain(self, [f, f1, f2]: [f64; 3]) -> Self {
        Self {
            value: f,
            gradient: self.gradient * f1,
            hessian: self.hessian * f1 + self.gradient * self.gradient.transpose() * f2,
        }
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            gradient: self.gradient + other.gradient,
            hessian: self.hessian + other.hessian,
        }
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, k: f64) -> Self {
        Self {
            value: self.value * k,
            gradient: self.gradient * k,
            hessian: self.hessian * k,
        }
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let cross = self.gradient * other.gradient.transpose();
        Self {
            value: self.value * other.value,
            gradient: self.gradient * other.value + other.gradient * self.value,
            hessian: self.hessian * other.value
                + other.hessian * self.value
                + cross
                + cross.transpose(),
        }
    }
}
