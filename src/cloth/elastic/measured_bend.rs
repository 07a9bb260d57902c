//! Measured bending as an energy: the data of Wang, O'Brien & Ramamoorthi 2011.
//!
//! The data give the rigidity B of a sheet bent about 0°, 45° and 90° to the weft, at five curvatures, as the secant of
//! the moment. A sheet bent about the weft curves along the warp. The orthotropic D of each curvature has these B along
//! its three directions and no coupling of weft and warp where that leaves its twist stiffness positive. The energy is
//! radial, W(κ) = κᵀ [∫₀ˢ t D(t) dt] κ / s² with s = |κ|: it does the measured work of bending along each direction.

use super::Jet;
use super::jet::Smooth;
use crate::settings::ElasticSettings;
use nalgebra::{Matrix3, Vector3};
use tryon_formats::fabric_json::MeasuredFabric;

/// Distance of the data's curvatures (1/m): 5 1/m of Bridson's l sin(θ/2)/A, half the curvature (ARCSim 0.2).
const SPACING: f64 = 10.0;
/// Curvatures of the data.
const CURVATURES: usize = 5;

/// Bending law of a measured fabric.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredBend {
    /// C₀, C₁, C₂ of ∫₀ˢ t D dt = C₀ + C₁ s² + C₂ s³ between one curvature and the next; the last without end.
    pieces: [[Matrix3<f64>; 3]; CURVATURES],
}

impl MeasuredBend {
    /// Law of a fabric.
    pub fn new(fabric: &MeasuredFabric, settings: &ElasticSettings) -> Self {
        let at = |row: usize, k: usize| {
            let entry = fabric.bending.get(row).and_then(|r| r.get(k));
            entry.copied().unwrap_or(0.0).max(settings.least_bend)
        };
        let d: [_; CURVATURES] =
            std::array::from_fn(|k| orthotropic([2, 0, 1].map(|row| at(row, k)), settings));
        let mut integral = Matrix3::zeros();
        let pieces = std::array::from_fn(|k| {
            let from = k as f64 * SPACING;
            let slope = match d.get(k + 1) {
                Some(next) => (next - d[k]) / SPACING,
                None => Matrix3::zeros(),
            };
            let (square, cube) = ((d[k] - slope * from) * 0.5, slope / 3.0);
            let polynomial = |s: f64| square * (s * s) + cube * s.powi(3);
            let constant = integral - polynomial(from);
            integral = constant + polynomial(from + SPACING);
            [constant, square, cube]
        });
        Self { pieces }
    }
    /// Stiffness of a flat sheet (N·m).
    pub fn at_rest(&self) -> Matrix3<f64> {
        self.pieces[0][1] * 2.0
    }
    /// Energy per rest area (N/m), moment (N) and tangent (N·m) of a curvature (κᵤᵤ, κᵥᵥ, 2 κᵤᵥ).
    pub fn expand(&self, curvature: &Vector3<f64>) -> Jet {
        let [u, v, g] = [0, 1, 2].map(|k| Jet::variable(k, curvature[k]));
        let square = u * u + v * v + g * g * 0.5;
        let piece = ((square.value.sqrt() / SPACING) as usize).min(CURVATURES - 1);
        let [c0, c1, c2] = &self.pieces[piece];
        let form = |c: &Matrix3<f64>| Jet::quadratic(&(c * 2.0), curvature);
        // s has no derivative at zero; s κᵀ C κ has two, both zero.
        if square.value < f64::EPSILON {
            return form(c1);
        }
        let linear = form(c1) + form(c2) * square.sqrt();
        if piece == 0 {
            return linear;
        }
        linear + form(c0) * square.recip()
    }
}

/// Stiffness (N·m) of an orthotropic sheet with these rigidities when it curves along u, along v and along the bias.
fn orthotropic([u, v, bias]: [f64; 3], settings: &ElasticSettings) -> Matrix3<f64> {
    let twist = (bias - 0.25 * (u + v)).max(settings.least_twist * bias);
    let most = settings.largest_coupling * (u * v).sqrt();
    let coupling = (2.0 * (bias - twist) - 0.5 * (u + v)).clamp(-most, most);
    Matrix3::new(u, coupling, 0.0, coupling, v, 0.0, 0.0, 0.0, twist)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use tryon_formats::fabric_json::read_fabric;
    use tryon_formats::shared_data;
    use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};

    fn fabric() -> MeasuredFabric {
        MeasuredFabric {
            density: 0.2,
            stretching: vec![vec![100.0, 0.0, 100.0, 50.0]; 6],
            bending: vec![
                vec![2.0, 2.5, 3.0, 3.2, 2.8],
                vec![1.5, 1.4, 1.6, 1.7, 1.8],
                vec![1.0, 1.2, 1.1, 1.0, 0.9],
            ],
        }
    }

    /// Uniaxial curvature bent about an axis at this angle to the weft.
    fn bent(curvature: f64, axis: f64) -> Vector3<f64> {
        let (s, c) = axis.sin_cos();
        Vector3::new(s * s, c * c, -2.0 * s * c) * curvature
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let law = MeasuredBend::new(&fabric(), &ElasticSettings::default());
        let evaluate = |x: &[f64], weight: f64| {
            let w = law.expand(&Vector3::from_column_slice(x)) * weight;
            Derivatives::energy(w.value, w.gradient.as_slice().to_vec())
                .with_hessian(DMatrix::from_column_slice(3, 3, w.hessian.as_slice()))
        };
        let points = [bent(4.0, 0.3), bent(-17.0, 1.0), bent(60.0, 0.1)];
        let points = points.map(|p| (p + Vector3::new(0.0, 1.0, 0.3)).as_slice().to_vec());
        DerivativeCheck::default().run(&points, evaluate);
        DerivativeCheck::default().run_degenerate(&[vec![0.0; 3], vec![10.0, 0.0, 0.0]], evaluate);
    }

    /// Moment of bending about a measured axis over the curvature is the measured rigidity.
    fn worst_error(data: &MeasuredFabric) -> f64 {
        let law = MeasuredBend::new(data, &ElasticSettings::default());
        let mut worst = 0.0f64;
        for (row, rigidities) in data.bending.iter().enumerate() {
            for (k, b) in rigidities.iter().enumerate().skip(1) {
                let curvature = k as f64 * SPACING;
                let z = bent(curvature, row as f64 * std::f64::consts::FRAC_PI_4);
                let moment = law.expand(&z).gradient.dot(&z) / curvature;
                worst = worst.max((moment / (b * curvature) - 1.0).abs());
            }
        }
        worst
    }

    #[test]
    fn moments_are_the_measured_ones() {
        assert!(worst_error(&fabric()) < 1e-12);
        let Some(folder) = shared_data("materials/wang2011_arcsim_NONCOMMERCIAL") else {
            return;
        };
        for file in std::fs::read_dir(folder).expect("folder") {
            let path = file.expect("entry").path();
            if path.extension().is_some_and(|e| e == "json") {
                let error = worst_error(&read_fabric(&path).expect("fabric"));
                assert!(error < 1e-12, "{path:?}: {error}");
            }
        }
    }

    #[test]
    fn isotropic_data_give_an_isotropic_plate_without_coupling() {
        let d = orthotropic([2.0; 3], &ElasticSettings::default());
        assert_eq!(d, Matrix3::new(2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0));
    }
}
