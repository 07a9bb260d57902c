//! Sizes XS to XXL and the bodies they are made for.

use super::GarmentError;
use serde::{Deserialize, Serialize};

/// Letter size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum Size {
    /// Extra small.
    Xs,
    /// Small.
    S,
    /// Medium.
    #[default]
    M,
    /// Large.
    L,
    /// Extra large.
    Xl,
    /// Extra extra large.
    Xxl,
}

impl Size {
    /// All sizes, smallest first.
    pub const ALL: [Self; 6] = [Self::Xs, Self::S, Self::M, Self::L, Self::Xl, Self::Xxl];
}

impl std::fmt::Display for Size {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(["XS", "S", "M", "L", "XL", "XXL"][*self as usize])
    }
}

impl std::str::FromStr for Size {
    type Err = GarmentError;
    fn from_str(s: &str) -> Result<Self, GarmentError> {
        Self::ALL
            .into_iter()
            .find(|z| z.to_string().eq_ignore_ascii_case(s.trim()))
            .ok_or_else(|| GarmentError::UnknownSize(s.to_owned()))
    }
}

/// Girths and lengths of a body, metres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BodyMeasures {
    /// Fullest girth of the chest.
    pub chest: f64,
    /// Narrowest girth of the trunk.
    pub waist: f64,
    /// Fullest girth of the seat.
    pub hip: f64,
    /// Floor to crown.
    pub stature: f64,
}

/// The body one size is made for, and the lengths that grow with it. Metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeRow {
    /// Letter size.
    pub size: Size,
    /// Girths of the body.
    pub body: BodyMeasures,
    /// Shoulder tip to shoulder tip.
    pub shoulders: f64,
    /// Girth of the neck base.
    pub neck: f64,
    /// Shoulder tip to wrist.
    pub arm: f64,
    /// Upper arm girth.
    pub upper_arm: f64,
    /// High point of the shoulder down the back to the hip line.
    pub trunk: f64,
    /// Waist to crotch (body rise).
    pub rise: f64,
    /// Crotch to ankle.
    pub inseam: f64,
}

/// Girths are the middle of the letter-size intervals of EN 13402-3 (chest/bust, waist, hip: bust intervals
/// 74–82, 82–90, 90–98, 98–107, 107–119, 119–131 cm for XS … XXL with the waist and hip girths tabulated for those
/// busts). Lengths follow its stature column and the usual 1 to 1.5 cm grade a size (Aldrich, *Metric Pattern
/// Cutting*, standard body measurements).
pub fn size_table() -> [SizeRow; 6] {
    // chest, waist, hip, stature, shoulders, neck, arm, upper arm, trunk, rise, inseam
    const CM: [[f64; 11]; 6] = [
        [78.0, 62.0, 86.0, 162.0, 36.5, 34.5, 56.5, 25.0, 58.0, 26.0, 74.0],
        [86.0, 70.0, 94.0, 165.0, 38.5, 36.0, 57.5, 27.0, 60.0, 27.0, 75.0],
        [94.0, 78.0, 102.0, 168.0, 40.5, 37.5, 58.5, 29.0, 62.0, 28.0, 76.0],
        [102.5, 86.5, 110.0, 171.0, 42.5, 39.0, 59.5, 31.5, 64.0, 29.0, 77.0],
        [113.0, 97.0, 119.5, 174.0, 44.5, 41.0, 60.5, 34.5, 66.0, 30.2, 78.0],
        [125.0, 109.0, 129.5, 177.0, 46.5, 43.0, 61.5, 38.0, 68.0, 31.5, 79.0],
    ];
    std::array::from_fn(|i| {
        let v = CM[i].map(|c| c / 100.0);
        SizeRow {
            size: Size::ALL[i],
            body: BodyMeasures { chest: v[0], waist: v[1], hip: v[2], stature: v[3] },
            shoulders: v[4],
            neck: v[5],
            arm: v[6],
            upper_arm: v[7],
            trunk: v[8],
            rise: v[9],
            inseam: v[10],
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_grow_and_parse() {
        let t = size_table();
        assert!(t.windows(2).all(|w| w[0].body.chest < w[1].body.chest && w[0].inseam < w[1].inseam));
        assert_eq!("xl".parse::<Size>(), Ok(Size::Xl));
        assert!("huge".parse::<Size>().is_err());
    }
}
