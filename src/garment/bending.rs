//! Bending rigidity of a fabric by the direction along which it curves.

use serde::{Deserialize, Serialize};

/// Bending rigidity per width of a strip cut along each direction (N·m), as KES-FB2 and the cantilever measure it.
///
/// A file may hold one number for all directions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "BendingFile")]
pub struct Bending {
    /// Curved along the warp.
    pub warp: f64,
    /// Curved along the weft.
    pub weft: f64,
    /// Curved along 45°; `None` where it is not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bias: Option<f64>,
    /// HB, half the width of the hysteresis loop: moment per width of yarn friction (N).
    #[serde(skip_serializing_if = "is_zero")]
    pub friction: f64,
}

/// Forms of bending in a file.
#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "bending is a number (N·m), or `warp` and `weft` with or without `bias`"
)]
enum BendingFile {
    Uniform(f64),
    Directional(DirectionalFile),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DirectionalFile {
    warp: f64,
    weft: f64,
    bias: Option<f64>,
    #[serde(default)]
    friction: f64,
}

fn is_zero(v: &f64) -> bool {
    *v == 0.0
}

impl From<BendingFile> for Bending {
    fn from(file: BendingFile) -> Self {
        match file {
            BendingFile::Uniform(b) => Self::uniform(b),
            BendingFile::Directional(d) => Self {
                warp: d.warp,
                weft: d.weft,
                bias: d.bias,
                friction: d.friction,
            },
        }
    }
}

impl Bending {
    /// The same in all directions.
    pub const fn uniform(rigidity: f64) -> Self {
        Self {
            warp: rigidity,
            weft: rigidity,
            bias: None,
            friction: 0.0,
        }
    }
    /// Mean of warp and weft.
    pub fn mean(&self) -> f64 {
        0.5 * (self.warp + self.weft)
    }
    /// Rigidity along 45°: as measured, else by Huber's rule for orthotropic plates, ((√B₁ + √B₂)/2)² (Timoshenko &
    /// Woinowsky-Krieger 1959, § 86).
    pub fn along_bias(&self) -> f64 {
        let root = 0.5 * (self.warp.sqrt() + self.weft.sqrt());
        self.bias.unwrap_or(root * root)
    }
    /// No direction below `least`.
    #[must_use]
    pub fn at_least(&self, least: f64) -> Self {
        Self {
            warp: self.warp.max(least),
            weft: self.weft.max(least),
            bias: self.bias.map(|b| b.max(least)),
            friction: self.friction,
        }
    }
    /// Length (m) over which a strip of weight `load` (N/m²) bends, warp and weft: Peirce's bending length c = (B/w)^⅓, with
    /// friction that of the moment at the curvature 1/c, w c³ = B + HB c.
    pub fn lengths(&self, load: f64) -> [f64; 2] {
        [self.warp, self.weft].map(|b| self.length(b, load))
    }
    /// Bending without friction that has the moment of this at the curvature of cloth under `load` (N/m²).
    #[must_use]
    pub fn secant(&self, load: f64) -> Self {
        let along = |b: f64| b + self.friction * self.length(b, load);
        Self {
            warp: along(self.warp),
            weft: along(self.weft),
            bias: self.bias.map(along),
            friction: 0.0,
        }
    }
    /// Newton's method on w c³ − HB c − B, convex where it grows, from above.
    fn length(&self, rigidity: f64, load: f64) -> f64 {
        /// Steps to rounding.
        const STEPS: usize = 40;
        let (b, w, h) = (rigidity, load, self.friction);
        let start = (b / w).cbrt() + (h / w).sqrt();
        (0..STEPS).fold(start, |c, _| {
            c - (w * c.powi(3) - h * c - b) / (3.0 * w * c * c - h).max(f64::MIN_POSITIVE)
        })
    }
    /// Field and value of each direction.
    pub(crate) fn fields(&self) -> [(&'static str, f64); 4] {
        [
            ("bending.warp", self.warp),
            ("bending.weft", self.weft),
            ("bending.bias", self.bias.unwrap_or(0.0)),
            ("bending.friction", self.friction),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_hold_one_number_or_directions_and_faults_are_told() {
        let read = |text: &str| serde_json::from_str::<Bending>(text);
        assert_eq!(read("2e-5").expect("a number"), Bending::uniform(2e-5));
        let own = read(r#"{"warp": 3e-5, "weft": 1e-5}"#).expect("directions");
        assert_eq!((own.warp, own.weft, own.bias), (3e-5, 1e-5, None));
        assert!(own.friction == 0.0);
        let text = serde_json::to_string(&own).expect("text");
        assert_eq!(read(&text).expect("its own text"), own);
        for wrong in [
            r#""soft""#,
            r#"{"warp": 1e-5}"#,
            r#"{"warp": 1, "weft": 1, "x": 1}"#,
        ] {
            let why = read(wrong).expect_err("refused").to_string();
            assert!(why.contains("`warp` and `weft`"), "{why}");
        }
    }

    #[test]
    fn bias_of_equal_directions_is_theirs() {
        assert!((Bending::uniform(4e-6).along_bias() - 4e-6).abs() < 1e-18);
        let own = Bending {
            warp: 4e-6,
            weft: 1e-6,
            bias: None,
            friction: 0.0,
        };
        assert!((own.along_bias() - 2.25e-6).abs() < 1e-18);
    }

    #[test]
    fn friction_lengthens_a_strip_to_the_balance_of_its_moment() {
        let mut own = Bending::uniform(1.157e-5);
        let load = 1.2145;
        assert!((own.lengths(load)[0] - (1.157e-5f64 / load).cbrt()).abs() < 1e-12);
        own.friction = 6.08e-4;
        let c = own.lengths(load)[0];
        assert!((load * c.powi(3) / (1.157e-5 + 6.08e-4 * c) - 1.0).abs() < 1e-12);
        let secant = own.secant(load);
        assert!((secant.lengths(load)[0] / c - 1.0).abs() < 1e-12);
    }
}
