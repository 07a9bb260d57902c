//! Lenses: a pinhole and the distortion that its glass adds.

use super::{Calibration, Intrinsics};
use crate::math::{Camera, ColorCamera, Rigid};
use serde::{Deserialize, Serialize};

/// Brown–Conrady distortion with a rational radial part, on image coordinates of unit depth (x / z, y / z): OpenCV's
/// `plumb_bob` (radial[3..] zero) and `rational_polynomial`, and the Azure Kinect's.
///
/// With r² = x² + y² and the factor f = (1 + k₁r² + k₂r⁴ + k₃r⁶) / (1 + k₄r² + k₅r⁴ + k₆r⁶), a ray at (x, y) is drawn
/// at (x f + 2p₁xy + p₂(r² + 2x²), y f + p₁(r² + 2y²) + 2p₂xy) (OpenCV, "Camera Calibration and 3D Reconstruction").
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Distortion {
    /// k₁ … k₆.
    pub radial: [f64; 6],
    /// p₁, p₂.
    pub tangential: [f64; 2],
    /// Radius of rays √((x/z)² + (y/z)²) up to which the maker vouches for the coefficients; `None` if it states none.
    #[serde(default)]
    pub limit: Option<f64>,
}

/// Coefficients that are no distortion.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DistortionError {
    /// Neither of OpenCV's counts.
    #[error("{0} coefficients, expected 0, 4, 5 or 8 (k1, k2, p1, p2, k3, k4, k5, k6)")]
    Count(usize),
    /// A coefficient is NaN or infinite.
    #[error("coefficient {index} is {value}")]
    NotFinite {
        /// From zero.
        index: usize,
        /// Its value.
        value: f64,
    },
}

impl Distortion {
    /// Coefficients in OpenCV's order: k₁, k₂, p₁, p₂, k₃, k₄, k₅, k₆; none, four, five or eight of them. Zeros may
    /// follow (thin prism and tilt, unused).
    ///
    /// # Errors
    /// Another count, or a coefficient that is not finite.
    pub fn from_opencv(coefficients: &[f64]) -> Result<Self, DistortionError> {
        let used = coefficients.iter().rposition(|c| *c != 0.0);
        let count = match used.map_or(0, |last| last + 1) {
            n @ 0..=8 => n,
            _ => return Err(DistortionError::Count(coefficients.len())),
        };
        if !matches!(coefficients.len(), 0 | 4 | 5 | 8 | 12 | 14) {
            return Err(DistortionError::Count(coefficients.len()));
        }
        let mut c = [0.0; 8];
        c[..count].copy_from_slice(&coefficients[..count]);
        if let Some(index) = c.iter().position(|c| !c.is_finite()) {
            let value = c[index];
            return Err(DistortionError::NotFinite { index, value });
        }
        let [k1, k2, p1, p2, k3, k4, k5, k6] = c;
        Ok(Self {
            radial: [k1, k2, k3, k4, k5, k6],
            tangential: [p1, p2],
            limit: None,
        })
    }

    /// True if a lens with it is a pinhole that draws every ray.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Place at which a ray at `x`, `y` of unit depth is drawn, same units.
    pub fn distort(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ([k1, k2, k3, k4, k5, k6], [p1, p2]) = (self.radial, self.tangential);
        let r2 = x * x + y * y;
        let radial =
            (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)));
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ]
    }
}

/// A camera as it is made: a pinhole behind glass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lens {
    /// The pinhole, pixels.
    pub intrinsics: Intrinsics,
    /// Distortion of the glass.
    pub distortion: Distortion,
}

impl From<Intrinsics> for Lens {
    fn from(intrinsics: Intrinsics) -> Self {
        Self {
            intrinsics,
            distortion: Distortion::default(),
        }
    }
}

/// Calibration of a camera as its maker states it, distortion included.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LensCalibration {
    /// Depth camera.
    pub depth: Lens,
    /// Colour camera; `None` when there is no colour or it is registered to depth.
    pub color: Option<Lens>,
    /// From depth camera to colour camera; identity when registered.
    pub color_from_depth: Rigid<ColorCamera, Camera>,
}

impl LensCalibration {
    /// The cameras without their distortion.
    pub fn pinholes(&self) -> Calibration {
        Calibration {
            depth: self.depth.intrinsics,
            color: self.color.map(|lens| lens.intrinsics),
            color_from_depth: self.color_from_depth,
        }
    }
}

impl From<Calibration> for LensCalibration {
    fn from(c: Calibration) -> Self {
        Self {
            depth: c.depth.into(),
            color: c.color.map(Lens::from),
            color_from_depth: c.color_from_depth,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published formula, term by term.
    #[test]
    fn rays_are_drawn_where_the_formula_says() {
        let d = Distortion::from_opencv(&[0.1, -0.05, 0.001, -0.002, 0.02, 0.03, -0.01, 0.005])
            .expect("eight coefficients");
        let [x, y] = d.distort([0.3, -0.2]);
        let r2: f64 = 0.13;
        let f = (1.0 + 0.1 * r2 - 0.05 * r2 * r2 + 0.02 * r2.powi(3))
            / (1.0 + 0.03 * r2 - 0.01 * r2 * r2 + 0.005 * r2.powi(3));
        assert!((x - (0.3 * f + 2.0 * 0.001 * 0.3 * -0.2 - 0.002 * (r2 + 0.18))).abs() < 1e-12);
        assert!((y - (-0.2 * f + 0.001 * (r2 + 0.08) - 2.0 * 0.002 * 0.3 * -0.2)).abs() < 1e-12);
    }

    #[test]
    fn counts_and_values_are_checked() {
        assert!(Distortion::from_opencv(&[]).is_ok_and(|d| d.is_none()));
        assert!(Distortion::from_opencv(&[0.0; 14]).is_ok_and(|d| d.is_none()));
        let tilted = [0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0];
        for bad in [&[0.1; 3][..], &tilted] {
            let e = Distortion::from_opencv(bad);
            assert!(matches!(e, Err(DistortionError::Count(_))));
        }
        let e = Distortion::from_opencv(&[0.1, f64::NAN, 0.0, 0.0, 0.0]);
        assert!(matches!(
            e,
            Err(DistortionError::NotFinite { index: 1, .. })
        ));
    }
}
