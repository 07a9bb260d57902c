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
}

impl From<BendingFile> for Bending {
    fn from(file: BendingFile) -> Self {
        match file {
            BendingFile::Uniform(b) => Self::uniform(b),
            BendingFile::Directional(d) => Self {
                warp: d.warp,
                weft: d.weft,
                bias: d.bias,
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
        }
    }
    /// Length (m) over which a strip of weight `load` (N/m²) bends: Peirce's bending length (B/w)^⅓, warp and weft.
    pub fn lengths(&self, load: f64) -> [f64; 2] {
        [self.warp, self.weft].map(|b| (b / load).cbrt())
    }
    /// Field and value of each direction.
    pub(crate) fn fields(&self) -> [(&'static str, f64); 3] {
        [
            ("bending.warp", self.warp),
            ("bending.weft", self.weft),
            ("bending.bias", self.bias.unwrap_or(0.0)),
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
        let text = serde_json::to_string(&own).expect("text");
        assert_eq!(read(&text).expect("its own text"), own);
        for wrong in [r#""soft""#, r#"{"warp": 1e-5}"#, r#"{"warp": 1, "weft": 1, "x": 1}"#] {
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
        };
        assert!((own.along_bias() - 2.25e-6).abs() < 1e-18);
    }
}
