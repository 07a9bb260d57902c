//! Fabric in SI units.

use super::{Bending, GarmentError, Tensile};
use serde::{Deserialize, Serialize};
use tryon_formats::fabric_json::MeasuredFabric;

/// A thin sheet. Stretch and shear are forces per metre of width (membrane stiffness: Young's modulus × thickness).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Name.
    pub name: String,
    /// Mass of a square metre, kg/m².
    pub area_density: f64,
    /// Membrane stiffness along the panel's y (warp, the grain), N/m.
    pub stretch_warp: f64,
    /// Membrane stiffness along the panel's x (weft), N/m.
    pub stretch_weft: f64,
    /// Membrane shear modulus (2D Lamé μ), N/m.
    pub shear: f64,
    /// Coupling of the two directions (2D Lamé λ), N/m.
    pub coupling: f64,
    /// Bending rigidity by direction, N·m.
    pub bending: Bending,
    /// Tension curves, for the offline solver; the stiffness above is theirs at rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tensile: Option<Tensile>,
    /// Measured law, for the offline solver, instead of all moduli above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<Box<MeasuredFabric>>,
    /// Coulomb coefficient against skin.
    pub friction: f64,
    /// Damping rate by air and internal losses, 1/s.
    pub damping: f64,
    /// Thickness of the sheet, metres.
    pub thickness: f64,
    /// Source of the numbers.
    pub source: String,
}

/// Linear elastic solid, the same in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IsotropicSolid {
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson ratio.
    pub poisson: f64,
    /// Mass of a cubic metre, kg/m³.
    pub density: f64,
}

impl Material {
    /// Sheet of an isotropic solid with this thickness, metres.
    pub fn isotropic(name: &str, solid: IsotropicSolid, thickness: f64, source: &str) -> Self {
        let IsotropicSolid {
            young,
            poisson,
            density,
        } = solid;
        let membrane = young * thickness;
        Self {
            name: name.to_owned(),
            area_density: density * thickness,
            stretch_warp: membrane,
            stretch_weft: membrane,
            shear: membrane / (2.0 * (1.0 + poisson)),
            coupling: membrane * poisson / (1.0 - poisson * poisson),
            bending: Bending::uniform(
                membrane * thickness * thickness / (12.0 * (1.0 - poisson * poisson)),
            ),
            tensile: None,
            measured: None,
            friction: 0.3,
            damping: 0.5,
            thickness,
            source: source.to_owned(),
        }
    }
    /// Fabric measured as by Wang et al. 2011, whose stiffness depends on direction and strain, with a linear sheet for
    /// the real-time solver. Each modulus is the mean of its values at rest and at the largest strain along its direction
    /// (weft, warp, bias). Bending is that of the smallest curvature. Friction, damping and thickness are estimates.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub fn from_measured(name: &str, m: &MeasuredFabric) -> Result<Self, GarmentError> {
        /// Least stiffness of a woven or knitted sheet, N/m: fits of weak fabrics are negative at rest.
        const LEAST: f64 = 5.0;
        /// Largest coupling over the geometric mean of the stiffnesses; from 1 on the sheet is unstable.
        const COUPLING: f64 = 0.9;
        let at = |row: usize, column: usize| {
            m.stretching
                .get(row)
                .and_then(|r| r.get(column))
                .copied()
                .unwrap_or(0.0)
        };
        let mean = |row: usize, column: usize| (0.5 * (at(0, column) + at(row, column))).max(LEAST);
        let (weft, warp, shear) = (mean(1, 0), mean(5, 2), mean(3, 3));
        let coupling = (0.5 * (at(0, 1) + at(3, 1))).clamp(0.0, COUPLING * (weft * warp).sqrt());
        // Rows are bent about the weft, the bias and the warp, and curve across these.
        let bend = |row: usize| {
            let first = m.bending.get(row).and_then(|r| r.first());
            first.map_or(0.0, |b| b.max(0.0))
        };
        let material = Self {
            name: name.to_owned(),
            area_density: m.density,
            stretch_warp: warp,
            stretch_weft: weft,
            shear,
            coupling,
            bending: Bending {
                warp: bend(0),
                weft: bend(2),
                bias: Some(bend(1)),
                friction: 0.0,
            },
            tensile: None,
            measured: Some(Box::new(m.clone())),
            friction: 0.3,
            damping: 1.0,
            thickness: 5e-4,
            source: "measured as in Wang, O'Brien & Ramamoorthi 2011; friction, damping and thickness are ours".into(),
        };
        material.check()?;
        Ok(material)
    }
    /// Strain of the fabric around the body above which it feels too tight. At that strain its tension, in the softer
    /// direction, presses a trunk of 15 cm radius with 0.7 kPa (Laplace, p = T/r), half the pressure of a tolerated
    /// waistband; it is at most the comfortable strain of skin.
    pub fn comfortable_strain(&self) -> f64 {
        /// Tension at 0.7 kPa on a radius of 15 cm, N/m.
        const TENSION: f64 = 105.0;
        /// Comfortable strain of skin (Kirk & Ibrahim 1966).
        const MOST: f64 = 0.12;
        (TENSION / self.stretch_warp.min(self.stretch_weft)).min(MOST)
    }
    /// Length of wrinkles in the sheet, metres: 2 √π (B/T)^¼ √L (Cerda & Mahadevan 2003) of a strip as long as a fold between
    /// two places that hold it, under the tension of a worn garment.
    pub fn wrinkle_length(&self) -> f64 {
        /// Tension T, N/m, and length L, metres.
        const TENSION: f64 = 10.0;
        const LENGTH: f64 = 0.06;
        let stiffness = (self.bending.warp * self.bending.weft).max(0.0).sqrt();
        2.0 * (std::f64::consts::PI * LENGTH).sqrt() * (stiffness / TENSION).powf(0.25)
    }
    /// Geometric mean of both Poisson ratios ν, of ν/(1 − ν²) = λ/√(E₁ E₂).
    pub fn poisson(&self) -> f64 {
        let ratio = self.coupling / (self.stretch_warp * self.stretch_weft).sqrt();
        2.0 * ratio / (1.0 + (1.0 + 4.0 * ratio * ratio).sqrt())
    }
    /// Checks that all numbers are possible for a sheet.
    ///
    /// # Errors
    /// Names the field.
    pub fn check(&self) -> Result<(), GarmentError> {
        let positive = [
            ("area_density", self.area_density),
            ("stretch_warp", self.stretch_warp),
            ("stretch_weft", self.stretch_weft),
            ("shear", self.shear),
        ];
        let not_negative = [
            ("coupling", self.coupling),
            ("friction", self.friction),
            ("damping", self.damping),
            ("thickness", self.thickness),
        ];
        let bending = self.bending.fields();
        let curves = self.tensile.iter().flat_map(|t| [t.warp, t.weft]);
        let curves: Vec<_> = curves.flat_map(|c| c.fields()).collect();
        for (field, v, ok) in positive
            .iter()
            .chain(&curves)
            .map(|(f, v)| (f, v, *v > 0.0))
            .chain({
                let rest = not_negative.iter().chain(&bending);
                rest.map(|(f, v)| (f, v, *v >= 0.0))
            })
        {
            if !ok || !v.is_finite() {
                return Err(GarmentError::Field {
                    field: format!("material.{field}"),
                    why: format!("{v} is not a usable value"),
                });
            }
        }
        Ok(())
    }
}
