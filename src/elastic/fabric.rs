//! Fabric of an elastic sheet.

use super::{BendLaw, ElasticError, StretchLaw};

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
        let StretchLaw::Linear(s) = &self.stretch;
        s.check()?;
        self.bend.check()
    }
}
