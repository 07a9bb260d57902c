//! Fit maps, by region.

use crate::v1::{FitClass, GarmentFit, RegionFit};
use tryon::dressing::{Fit, FitMap};

/// The byte of cloth as tight as the map tells.
const TIGHTEST: f32 = 127.0;

/// Tightness of a vertex, −1 (loose) to 1 (tight), from its byte.
pub fn tightness(byte: u8) -> f32 {
    f32::from(byte as i8) / TIGHTEST
}

/// A fit map: its regions, and a byte for each vertex.
pub fn fit_to_wire(garment: &str, size: &str, map: &FitMap) -> GarmentFit {
    let regions = map.regions.iter().map(|r| RegionFit {
        region: r.name.clone(),
        fit: match r.fit {
            Fit::Tight => FitClass::Tight,
            Fit::Fitted => FitClass::Fitted,
            Fit::Loose => FitClass::Loose,
        }
        .into(),
        stretch: r.stretch[1] as f32,
        pressure: r.pressure[0] as f32,
        touching: r.touching as f32,
        gap: r.gap as f32,
    });
    let tightness = map.vertices.iter().map(|v| (v.tightness() * TIGHTEST).round() as i8 as u8).collect();
    GarmentFit { garment: garment.to_owned(), size: size.to_owned(), regions: regions.collect(), tightness }
}
