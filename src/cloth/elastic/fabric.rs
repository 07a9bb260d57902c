//! Fabric of an elastic sheet.

use super::measured_bend::MeasuredBend;
use super::measured_stretch::MeasuredStretch;
use super::{BendLaw, ElasticError, StretchLaw, Stretching, TensionLaw};
use crate::settings::ElasticSettings;
use tryon_formats::fabric_json::MeasuredFabric;
use tryon_garment::Material;

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
    /// Laws of a material: measured ones where it has them, else linear ones of its moduli.
    ///
    /// Tension curves come with bending by direction and without its Poisson effect: KES-FB2 bends strips 20 times as wide
    /// as long to cylinders, and yarns slide rather than contract.
    pub fn of_material(material: &Material) -> Self {
        if let Some(measured) = &material.measured {
            return Self::measured(measured);
        }
        let poisson = material.poisson();
        let strips = [material.stretch_weft, material.stretch_warp];
        let at_rest = Stretching::orthotropic(strips, poisson, material.shear);
        let (stretch, bent) = match &material.tensile {
            Some(t) => {
                let curves = [t.weft, t.warp].map(|c| c.cubic());
                let law = Box::new(TensionLaw::new(at_rest, curves));
                (StretchLaw::Tension(law), 0.0)
            }
            None => (StretchLaw::Linear(at_rest), poisson),
        };
        Self {
            area_density: material.area_density,
            stretch,
            bend: BendLaw::orthotropic(&material.bending, bent),
        }
    }
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
