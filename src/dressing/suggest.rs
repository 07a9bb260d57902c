//! Which size fits, and why.

use crate::garment::{BodyMeasures, GarmentError, GarmentKind, Size, library};

/// A size and its reason.
#[derive(Clone, Debug, PartialEq)]
pub struct Suggestion {
    /// The size.
    pub size: Size,
    /// Room at chest, waist and hip (finished girth minus body girth), metres; NaN where the garment has no girth.
    pub ease: [f64; 3],
    /// One sentence for the shopper.
    pub reason: String,
}

/// Least room a garment must leave at chest, waist and hip, metres: a T-shirt 4 cm at the chest, a waistband none (it
/// sits lower on a fuller body) and 2 cm at the hip.
const LEAST: [f64; 3] = [0.04, -0.01, 0.02];

/// The smallest size with enough room everywhere; the largest when none has.
///
/// # Errors
/// Unknown garment.
pub fn suggest(garment: &str, body: &BodyMeasures) -> Result<Suggestion, GarmentError> {
    let girths = [body.chest, body.waist, body.hip];
    let names = ["chest", "waist", "hip"];
    let mut last = None;
    for size in Size::ALL {
        let p = library::pattern(garment, size)?;
        let ease: [f64; 3] =
            std::array::from_fn(|k| if p.finished[k] > 0.0 { p.finished[k] - girths[k] } else { f64::NAN });
        // A skirt or trousers may sit on the hip: there the waist must only pass over it.
        let fits = (0..3).all(|k| ease[k].is_nan() || ease[k] >= LEAST[k]);
        let tightest = (0..3)
            .filter(|k| !ease[*k].is_nan())
            .min_by(|a, b| (ease[*a] - LEAST[*a]).total_cmp(&(ease[*b] - LEAST[*b])))
            .unwrap_or(0);
        let what = match p.kind {
            GarmentKind::Top => "top",
            GarmentKind::Skirt => "skirt",
            GarmentKind::Trousers => "trousers",
        };
        let reason = format!(
            "{size}: the {what} leaves {:+.0} cm at the {} of {:.0} cm",
            ease[tightest] * 100.0,
            names[tightest],
            girths[tightest] * 100.0
        );
        let s = Suggestion { size, ease, reason };
        if fits {
            return Ok(s);
        }
        last = Some(s);
    }
    let mut s = last.ok_or_else(|| GarmentError::UnknownSize(garment.to_owned()))?;
    s.reason.push_str(" (our largest; it will be tight)");
    Ok(s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fuller_body_gets_a_larger_size_with_the_reason_named() {
        let body = |g: f64| BodyMeasures { chest: 0.88 * g, waist: 0.72 * g, hip: 0.96 * g, stature: 1.7 };
        for garment in library::names() {
            let sizes: Vec<Size> =
                [0.85, 1.0, 1.2, 2.0].iter().map(|g| suggest(garment, &body(*g)).expect("size").size).collect();
            assert!(sizes.windows(2).all(|w| w[0] <= w[1]), "{garment} {sizes:?}");
            assert_eq!(sizes[3], Size::Xxl);
        }
        assert!(suggest("tshirt", &body(1.0)).expect("size").reason.contains("chest"));
    }
}
