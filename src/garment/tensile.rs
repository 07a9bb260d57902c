//! Tension of a strip by its extension, from the two numbers that KES-FB1 reports.
//!
//! In Green strain E the stress is S = k E + b E³. Its end, 490.3 N/m at the extension EM, and its work, LT times that of
//! a straight line, determine k and b. Beyond the end the tangent is that of the end.

use serde::{Deserialize, Serialize};

/// Largest load of the KES-FB1 tensile test (N/m): 500 gf/cm.
const LARGEST_LOAD: f64 = 490.332_5;

/// Tension curve of a strip: Kawabata 1980, "The standardization and analysis of hand evaluation".
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TensionCurve {
    /// EM: extension at 490.3 N/m, as a share of the length.
    pub extension: f64,
    /// LT: work up to there over that of a straight line, ½ to 1.
    pub linearity: f64,
}

/// Tension curves of both directions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tensile {
    /// Along the warp.
    pub warp: TensionCurve,
    /// Along the weft.
    pub weft: TensionCurve,
}

/// Coefficients of S = k E + b E³ (N/m), and the Green strain at which the data end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CubicTension {
    /// k: stiffness at rest (N/m).
    pub stiffness: f64,
    /// b (N/m).
    pub cubic: f64,
    /// Green strain of the largest load.
    pub end: f64,
}

impl TensionCurve {
    /// Coefficients of the curve. The work ∫S dE = ½ k E² + ¼ b E⁴ is ½ LT F EM; with S = F/(1 + EM) and E = EM + ½ EM² at
    /// the end, b E³/S = 2 (1 − LT (1 + EM)/(1 + ½ EM)).
    pub fn cubic(&self) -> CubicTension {
        let (stretch, end) = (
            1.0 + self.extension,
            self.extension * (1.0 + 0.5 * self.extension),
        );
        let stress = LARGEST_LOAD / stretch;
        let share = 2.0 * (1.0 - self.linearity * stretch / (1.0 + 0.5 * self.extension));
        let share = share.clamp(0.0, 1.0);
        CubicTension {
            stiffness: (1.0 - share) * stress / end,
            cubic: share * stress / end.powi(3),
            end,
        }
    }
    /// Field and value of each number, zero where it is impossible.
    pub(crate) fn fields(&self) -> [(&'static str, f64); 2] {
        let linearity = Some(self.linearity).filter(|l| (0.5..=1.0).contains(l));
        [
            ("tensile.extension", self.extension),
            ("tensile.linearity (½ to 1)", linearity.unwrap_or(0.0)),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curve_ends_at_the_largest_load_with_the_measured_work() {
        for (extension, linearity) in [(0.03, 0.65), (0.2, 0.7), (0.1, 0.9)] {
            let curve = TensionCurve {
                extension,
                linearity,
            };
            let c = curve.cubic();
            // Nominal tension by the stretch: T = (1 + e) S(E).
            let tension = |e: f64| {
                let green = e + 0.5 * e * e;
                (1.0 + e) * (c.stiffness * green + c.cubic * green.powi(3))
            };
            assert!((tension(extension) / LARGEST_LOAD - 1.0).abs() < 1e-12);
            const STEPS: usize = 2000;
            let h = extension / STEPS as f64;
            let work: f64 = (0..STEPS).map(|k| tension((k as f64 + 0.5) * h) * h).sum();
            let straight = 0.5 * LARGEST_LOAD * extension;
            assert!((work / straight - linearity).abs() < 1e-4, "{work}");
        }
    }
}
