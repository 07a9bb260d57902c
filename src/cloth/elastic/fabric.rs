//! Fabric of an elastic sheet.

use super::measured_bend::MeasuredBend;
use super::measured_stretch::MeasuredStretch;
use super::{BendLaw, ElasticError, StretchLaw};
use crate::settings::ElasticSettings;
use tryon_formats::fabric_json::MeasuredFabric;

/// Constitutive laws and mass of a sheet, u along the weft and v along the warp.
#[derive(Clone, Debug, PartialEq)]
pub struct ElasticFabric {
    /// Mass of a square metre (kg/m²).
    pub area_density: f64,
    /// Membrane.
    pub stretch: StretchLaw,
    /// Bending.
    pub bend: BendLaw,
}

impl ElasticFabric {
    /// Fabric measured as by Wang, O'Brien & Ramamoorthi 2011.
    pub fn measured(fabric: &MeasuredFabric) -> Self {
        let settings = ElasticSettings::default();
        Self {
            area_density: fabric.density,
            stretch: StretchLaw::Measured(Box::new(MeasuredStretch::new(fabric, &settings))),
            bend: BendLaw::Measured(Box::new(MeasuredBend::new(fabric, &settings))),
        }
    }
    /// Checks that all numbers are possible for a sheet.
    ///
    /// # Errors
    /// [`ElasticError::Fabric`] names the quantity.
    pub fn check(&self) -> Result<(), ElasticError> {
        if !(self.area_density > 0.0 && self.area_density.is_finite()) {
            return Err(ElasticError::Fabric {
                field: "area density",
                value: self.area_density,
            });
        }
        self.stretch.check()?;
        self.bend.check()
    }
}
