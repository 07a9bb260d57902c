//! Membrane of measured tension curves: linear and orthotropic at rest, stiffer by b E³ along warp and weft in tension.

use super::jet::Smooth;
use super::{Jet, Stretching};
use nalgebra::{Matrix3, Vector3};
use tryon_garment::CubicTension;

/// Tension law of a woven sheet by its curves along weft and warp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TensionLaw {
    /// Stiffness at rest (N/m).
    pub(super) at_rest: Stretching,
    /// Curves along the weft and along the warp.
    curves: [CubicTension; 2],
}

impl TensionLaw {
    /// Law of curves (weft, warp) with the stiffness of `at_rest`.
    pub fn new(at_rest: Stretching, curves: [CubicTension; 2]) -> Self {
        Self { at_rest, curves }
    }
    /// Energy per rest area (N/m), stress and tangent of a strain (εᵤᵤ, εᵥᵥ, γ).
    pub fn expand(&self, strain: &Vector3<f64>) -> Jet {
        self.evaluate(&self.at_rest.matrix(), strain)
    }
    /// Energy per rest area (N/m) of a strain (εᵤᵤ, εᵥᵥ, γ).
    pub fn value(&self, strain: &Vector3<f64>) -> f64 {
        self.evaluate(&self.at_rest.matrix(), strain)
    }
    fn evaluate<T: Smooth>(&self, at_rest: &Matrix3<f64>, strain: &Vector3<f64>) -> T {
        let linear = T::quadratic(at_rest, strain);
        (0..2).fold(linear, |sum, axis| {
            let own = T::variable(axis, strain[axis]);
            sum + own.chain(stiffening(&self.curves[axis], strain[axis]))
        })
    }
}

/// Energy of b E³ and its derivatives: none in compression, of constant tangent beyond the data.
fn stiffening(curve: &CubicTension, strain: f64) -> [f64; 3] {
    if strain <= 0.0 {
        return [0.0; 3];
    }
    let (b, e) = (curve.cubic, strain.min(curve.end));
    let [value, slope, tangent] = [0.25 * b * e.powi(4), b * e.powi(3), 3.0 * b * e * e];
    let beyond = strain - e;
    [
        value + slope * beyond + 0.5 * tangent * beyond * beyond,
        slope + tangent * beyond,
        tangent,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use tryon_garment::Material;
    use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};

    fn law() -> TensionLaw {
        let m = Material::preset("wool").expect("a preset");
        let curves = m.tensile.expect("curves");
        let strips = [m.stretch_weft, m.stretch_warp];
        TensionLaw::new(
            Stretching::orthotropic(strips, m.poisson(), m.shear),
            [curves.weft, curves.warp].map(|c| c.cubic()),
        )
    }

    #[test]
    fn stress_and_tangent_are_derivatives_of_the_energy() {
        let evaluate = |x: &[f64], weight: f64| {
            let strain = Vector3::from_column_slice(x);
            let w = law().expand(&strain) * weight;
            assert!((law().value(&strain) * weight - w.value).abs() <= 1e-14 * w.value);
            Derivatives::energy(w.value, w.gradient.as_slice().to_vec())
                .with_hessian(DMatrix::from_column_slice(3, 3, w.hessian.as_slice()))
        };
        let points = [
            vec![0.05, -0.01, 0.02],
            vec![0.2, 0.3, -0.1], // beyond the data
            vec![-0.1, 0.04, 0.0],
        ];
        let check = DerivativeCheck {
            step: 1e-6,
            ..DerivativeCheck::default()
        };
        check.run(&points, evaluate);
        check.run_degenerate(&[vec![0.0; 3]], evaluate);
    }

    /// A strip free to contract carries 490.3 N/m at the extension that KES-FB1 reports.
    #[test]
    fn strips_have_the_measured_tension() {
        let m = Material::preset("wool").expect("a preset");
        let curves = m.tensile.expect("curves");
        for (axis, extension) in [(0, curves.weft.extension), (1, curves.warp.extension)] {
            let c = law().at_rest.matrix();
            let other = 1 - axis;
            let mut strain = Vector3::zeros();
            strain[axis] = extension * (1.0 + 0.5 * extension);
            strain[other] = -c[(0, 1)] / c[(other, other)] * strain[axis];
            let stress = law().expand(&strain).gradient;
            assert!(stress[other].abs() < 1e-9);
            let tension = (1.0 + extension) * stress[axis];
            assert!((tension / 490.332_5 - 1.0).abs() < 1e-9, "{tension}");
        }
    }
}
