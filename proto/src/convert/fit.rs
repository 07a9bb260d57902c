//! Fit maps, by region.

use crate::v1::{FitClass, GarmentFit, RegionFit};
use tryon::dressing::{Fit, FitMap};

/// The regions of a fit map.
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
    GarmentFit { garment: garment.to_owned(), size: size.to_owned(), regions: regions.collect() }
}
