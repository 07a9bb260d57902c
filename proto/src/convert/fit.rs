//! Fit maps on the wire.

use crate::v1::{FitClass, GarmentFit, RegionFit};
use tryon_dressing::{FitMap, FitMapSettings, Suggestion};

/// Byte of a tightness.
const TIGHTEST: f32 = 127.0;

/// Tightness of a vertex, −1 (loose) to 1 (tight), from its byte.
pub fn tightness(byte: u8) -> f32 {
    f32::from(byte as i8) / TIGHTEST
}

/// Wire message of a fit map: its regions and a byte for each vertex. `cut` has the ease in metres; `None` for a garment
/// without a pattern.
pub fn fit_to_wire(
    garment: &str,
    size: &str,
    map: &FitMap,
    cut: Option<&Suggestion>,
) -> GarmentFit {
    let ease = |place: &str| cut.and_then(|c| c.girths.iter().find(|r| r.place == place));
    let regions = map.regions.iter().map(|r| RegionFit {
        region: r.name.clone(),
        fit: match r.fit {
            tryon_dressing::FitClass::Tight => FitClass::Tight,
            tryon_dressing::FitClass::Fitted => FitClass::Fitted,
            tryon_dressing::FitClass::Loose => FitClass::Loose,
        }
        .into(),
        stretch: r.stretch[1] as f32,
        pressure: r.pressure[0] as f32,
        touching: r.touching as f32,
        gap: r.gap as f32,
        ease: ease(&r.name).map(|r| r.ease() as f32),
        ease_needed: ease(&r.name).map(|r| r.least_ease as f32),
    });
    let limits = FitMapSettings::default();
    let tightness = map
        .vertices
        .iter()
        .map(|v| (v.tightness(&limits) * TIGHTEST).round() as i8 as u8)
        .collect();
    GarmentFit {
        provisional: false,
        garment: garment.to_owned(),
        size: size.to_owned(),
        regions: regions.collect(),
        tightness,
        hem_above: cut.map(|c| c.length.0 as f32),
        hem_mark: cut.map_or_else(String::new, |c| c.length.1.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::measure::Measurements;
    use tryon_dressing::{FinishedGarment, RegionFit as Region, assess};
    use tryon_garment::{Size, library};

    #[test]
    fn ease_is_reported_with_its_region() {
        let region = |name: &str| Region {
            name: name.to_owned(),
            area: 0.1,
            stretch: [0.0; 2],
            pressure: [0.0; 2],
            touching: 0.0,
            gap: 0.01,
            fit: tryon_dressing::FitClass::Fitted,
        };
        let map = FitMap {
            vertices: Vec::new(),
            regions: ["chest", "waist", "left thigh"].map(region).to_vec(),
        };
        let pattern = library::pattern("tshirt", Size::S).expect("pattern");
        // A chest 2 cm too large for the shirt.
        let chest = pattern.finished[0] - 0.04 + 0.02;
        let body = Measurements {
            chest,
            natural_waist: 0.7,
            hip: 0.9,
            stature: 1.7,
            inseam: 0.8,
            ..Measurements::default()
        };
        let cut = assess(&FinishedGarment::from(&pattern), &body);
        let wire = fit_to_wire("tshirt", "S", &map, Some(&cut));
        let [chest, waist, thigh] = &wire.regions[..] else {
            panic!("{wire:?}")
        };
        let lacks = chest.ease_needed.expect("needed") - chest.ease.expect("ease");
        assert!((lacks - 0.02).abs() < 1e-6, "{chest:?}");
        assert_eq!(
            (waist.ease, thigh.ease),
            (None, None),
            "a T-shirt has no girth at the waist"
        );
        assert_eq!(wire.hem_mark, "the crotch");
        assert!((f64::from(wire.hem_above.expect("hem")) - (cut.hem - 0.8)).abs() < 1e-6);
        let mesh = fit_to_wire("suit", "", &map, None);
        assert!(
            mesh.hem_above.is_none() && mesh.hem_mark.is_empty() && mesh.regions[0].ease.is_none()
        );
    }
}
