//! Sizes XS to XXL and their bodies.

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

/// Body of one size, and the lengths that grow with it. Metres.
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

/// Rows of unisex sizes. Chest and waist are the mean of the middles of the women's and men's letter intervals of
/// EN 13402-3:2004 (women's bust XS–XXL 82, 86 … cm with the tabulated waists; men's chest and waist), hips the mean of
/// the women's hips there and of the seat that Aldrich (*Metric Pattern Cutting for Menswear*) gives for those chests.
/// Lengths follow ANSUR II (Gordon et al. 2014, NATICK/TR-15/007): crotch height 0.48 and acromion-to-wrist 0.34 of
/// stature; the grade between sizes is 1 to 1.5 cm. Rounded to half centimetres; entered without the standard at
/// hand, so compare before quoting.
pub fn size_table() -> [SizeRow; 6] {
    // chest, waist, hip, stature, shoulders, neck, arm, upper arm, trunk, rise, inseam
    const CM: [[f64; 11]; 6] = [
        [
            80.0, 66.0, 87.0, 162.0, 37.0, 35.0, 55.5, 25.5, 58.5, 26.0, 72.0,
        ],
        [
            88.0, 74.0, 94.0, 165.0, 39.0, 36.5, 56.5, 27.5, 60.5, 27.0, 73.0,
        ],
        [
            96.0, 82.0, 101.0, 168.0, 41.0, 38.0, 57.5, 29.5, 62.5, 28.0, 74.0,
        ],
        [
            104.5, 90.5, 108.5, 171.0, 43.0, 39.5, 58.5, 32.0, 64.5, 29.0, 75.0,
        ],
        [
            114.0, 100.0, 117.0, 174.0, 45.0, 41.5, 59.5, 35.0, 66.5, 30.2, 76.0,
        ],
        [
            125.0, 111.0, 126.5, 177.0, 47.0, 43.5, 60.5, 38.5, 68.5, 31.5, 77.0,
        ],
    ];
    std::array::from_fn(|i| {
        let v = CM[i].map(|c| c / 100.0);
        SizeRow {
            size: Size::ALL[i],
            body: BodyMeasures {
                chest: v[0],
                waist: v[1],
                hip: v[2],
                stature: v[3],
            },
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

impl Size {
    /// Row of the size table.
    pub fn row(self) -> SizeRow {
        size_table()[self as usize]
    }

    /// Size whose body is nearest: girths of chest, waist and hip, metres; `None` where a girth does not count.
    pub fn nearest(girths: [Option<f64>; 3]) -> Self {
        let off = |s: &Self| -> f64 {
            let of_size = s.row().body.girths();
            let both = girths.iter().zip(of_size);
            both.filter_map(|(g, of)| Some((g.as_ref()? - of).powi(2)))
                .sum()
        };
        let nearest = |a: &Self, b: &Self| off(a).total_cmp(&off(b));
        Self::ALL.into_iter().min_by(nearest).unwrap_or_default()
    }
}

impl BodyMeasures {
    /// Girths of chest, waist and hip, metres.
    pub fn girths(&self) -> [f64; 3] {
        [self.chest, self.waist, self.hip]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_of_the_table_have_their_own_size_by_any_of_their_girths() {
        for row in size_table() {
            let [chest, waist, hip] = row.body.girths().map(Some);
            assert_eq!(Size::nearest([chest, waist, hip]), row.size);
            assert_eq!(Size::nearest([chest, None, None]), row.size);
            assert_eq!(Size::nearest([None, waist, hip]), row.size);
        }
        assert_eq!(Size::nearest([Some(3.0), None, None]), Size::Xxl);
    }

    #[test]
    fn sizes_grow_and_parse() {
        let t = size_table();
        assert!(
            t.windows(2)
                .all(|w| w[0].body.chest < w[1].body.chest && w[0].inseam < w[1].inseam)
        );
        assert_eq!("xl".parse::<Size>(), Ok(Size::Xl));
        assert!("huge".parse::<Size>().is_err());
    }
}
