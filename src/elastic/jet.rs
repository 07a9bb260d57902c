//! Second-order jet in three variables: value, gradient and Hessian carried through arithmetic.

use nalgebra::{Matrix3, Vector3};
use std::ops::{Add, Mul, Sub};

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
    /// Constant.
    pub fn constant(value: f64) -> Self {
        Self {
            value,
            gradient: Vector3::zeros(),
            hessian: Matrix3::zeros(),
        }
    }
    /// Variable number `axis` with this value.
    pub fn variable(axis: usize, value: f64) -> Self {
        let mut jet = Self::constant(value);
        jet.gradient[axis] = 1.0;
        jet
    }
    /// Quadratic form ½ zᵀ C z at `z`, C symmetric.
    pub fn quadratic(c: &Matrix3<f64>, z: &Vector3<f64>) -> Self {
        let gradient = c * z;
        Self {
            value: 0.5 * z.dot(&gradient),
            gradient,
            hessian: *c,
        }
    }
    /// f(self) of a scalar function with these values of f, f′ and f″.
    pub fn chain(self, [f, f1, f2]: [f64; 3]) -> Self {
        Self {
            value: f,
            gradient: self.gradient * f1,
            hessian: self.hessian * f1 + self.gradient * self.gradient.transpose() * f2,
        }
    }
    /// Square root of a positive value.
    pub fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain([root, 0.5 / root, -0.25 / (root * self.value)])
    }
    /// Reciprocal of a value other than zero.
    pub fn recip(self) -> Self {
        let r = self.value.recip();
        self.chain([r, -r * r, 2.0 * r * r * r])
    }
    /// Nearest positive semi-definite matrix to the Hessian.
    pub fn positive_hessian(&self) -> Matrix3<f64> {
        if self.hessian.cholesky().is_some() {
            return self.hessian;
        }
        let e = self.hessian.symmetric_eigen();
        let kept = Matrix3::from_diagonal(&e.eigenvalues.map(|v| v.max(0.0)));
        e.eigenvectors * kept * e.eigenvectors.transpose()
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
