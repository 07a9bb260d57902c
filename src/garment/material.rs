//! Fabric in SI units.

use super::GarmentError;
use crate::formats::fabric_json::MeasuredFabric;
use serde::{Deserialize, Serialize};

/// A thin sheet. Stretch and shear are forces per metre of width (membrane stiffness: Young's modulus × thickness).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// What it is called.
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
    /// Bending rigidity, N·m.
    pub bending: f64,
    /// Coulomb coefficient against skin.
    pub friction: f64,
    /// Rate at which air and the fabric's own losses take speed away, 1/s.
    pub damping: f64,
    /// Thickness of the sheet, metres.
    pub thickness: f64,
    /// Where the numbers come from.
    pub source: String,
}

const CIPC: &str = "Codim-IPC fabric table (ipc-sim/Codim-IPC, FEMDiscreteShellBase.py, Apache-2.0), plane-stress membrane \
                    E·h and E·h³/12; friction and damping are ours";

impl Material {
    /// Names of the presets.
    pub const PRESETS: [&'static str; 9] = [
        "jersey",
        "cotton",
        "denim",
        "twill",
        "fleece",
        "wool",
        "polyester",
        "canvas",
        "silk",
    ];

    /// An isotropic sheet of Young's modulus `young` (Pa), Poisson ratio, volume density (kg/m³) and thickness (m).
    pub fn isotropic(
        name: &str,
        young: f64,
        poisson: f64,
        density: f64,
        thickness: f64,
        source: &str,
    ) -> Self {
        let membrane = young * thickness;
        Self {
            name: name.to_owned(),
            area_density: density * thickness,
            stretch_warp: membrane,
            stretch_weft: membrane,
            shear: membrane / (2.0 * (1.0 + poisson)),
            coupling: membrane * poisson / (1.0 - poisson * poisson),
            bending: membrane * thickness * thickness / (12.0 * (1.0 - poisson * poisson)),
            friction: 0.3,
            damping: 0.5,
            thickness,
            source: source.to_owned(),
        }
    }
    /// A preset by name: `jersey`, `cotton`, `denim`, `twill`, `fleece`, `wool`,
    /// `polyester`, `canvas`, `silk`.
    ///
    /// # Errors
    /// Lists the known names.
    pub fn preset(name: &str) -> Result<Self, GarmentError> {
        Ok(match name {
            // "95% wool 5% lycra" of the table is its knit with elastane, the nearest to a T-shirt's jersey.
            "jersey" => Self {
                // A knit's bending is far above the sheet formula's at this modulus: single jersey measures 5e-6 to
                // 2e-5 N·m on the KES-F bending tester (Kawabata 1980), and a loop structure locks when compressed.
                bending: 8e-6,
                friction: 0.4,
                damping: 1.0,
                ..Self::isotropic("jersey", 1.2e6, 0.071, 543.292_683, 0.000_328, CIPC)
            },
            "cotton" => Self {
                bending: 1e-5, // KES-F, shirting: 4e-6 to 1.5e-5 N·m
                ..Self::isotropic(
                    "cotton",
                    821_000.0 * 4.0,
                    0.243,
                    472.641_509,
                    0.000_318,
                    CIPC,
                )
            },
            // Stored base modulus 2.448 MPa with weft and warp at 4.793 and 9.029 MPa.
            "denim" => Self {
                stretch_warp: 9_029_000.0 * 0.000_66,
                stretch_weft: 4_793_000.0 * 0.000_66,
                area_density: 0.40, // 11.8 oz/yd², a jeans weight
                bending: 4e-5,      // KES-F, denim: 2e-5 to 1e-4 N·m
                friction: 0.45,
                damping: 1.5,
                ..Self::isotropic("denim", 2_448_000.0, 0.2, 400.0, 0.000_66, CIPC)
            },
            // A skirt's twill. Bending is twice a light denim's: edges of 21 mm cannot show finer folds, and a sheet that
            // may buckle at every edge crumples instead (seen, not measured).
            "twill" => Self {
                area_density: 0.28,
                bending: 1e-4,
                friction: 0.25,
                damping: 2.0,
                ..Self::isotropic("twill", 2_448_000.0, 0.2, 400.0, 0.000_66, CIPC)
            },
            // Sweatshirt fleece: a knit brushed inside. 300 g/m² is a usual weight; bending ten times single jersey's
            // (KES-F, double knits 5e-5 to 2e-4 N·m).
            "fleece" => Self {
                area_density: 0.30,
                bending: 8e-5,
                friction: 0.45,
                damping: 1.5,
                ..Self::isotropic("fleece", 1.2e6, 0.071, 543.292_683, 0.000_6, CIPC)
            },
            "wool" => Self {
                bending: 2e-5, // KES-F, suiting: 5e-6 to 3e-5 N·m
                ..Self::isotropic("wool", 170_000.0, 0.277, 413.380_282, 0.000_568, CIPC)
            },
            "polyester" => Self {
                bending: 5e-6, // KES-F, linings: 1e-6 to 8e-6 N·m
                friction: 0.2,
                ..Self::isotropic("polyester", 478_000.0, 0.381, 653.174_603, 0.000_252, CIPC)
            },
            // Weft, warp and base modulus of the table.
            "canvas" => Self {
                stretch_warp: 19_804_000.0 * 0.000_53,
                stretch_weft: 5_366_000.0 * 0.000_53,
                area_density: 0.294, // stored as 294: grams
                bending: 2e-4,
                friction: 0.5,
                ..Self::isotropic("canvas", 2_009_000.0, 0.2, 294.0, 0.000_53, CIPC)
            },
            "silk" => Self {
                stretch_warp: 4_971_000.0 * 0.000_18,
                stretch_weft: 4_300_000.0 * 0.000_18,
                area_density: 0.083, // 19 momme
                bending: 2e-6,       // KES-F, silk habutai: 1e-6 to 4e-6 N·m
                friction: 0.2,
                damping: 0.5,
                ..Self::isotropic("silk", 570_000.0, 0.3, 461.0, 0.000_18, CIPC)
            },
            other => {
                return Err(GarmentError::Field {
                    field: "material".into(),
                    why: format!(
                        "`{other}` is not known; presets are {}",
                        Self::PRESETS.join(", ")
                    ),
                });
            }
        })
    }
    /// A fabric measured as by Wang et al. 2011. Their stiffness depends on direction and strain; this sheet is linear:
    /// each modulus is the mean of the one at rest and the one at the largest strain along its own direction (weft, warp,
    /// bias), and bending is that of the smallest curvature, averaged over directions. Friction, damping and thickness
    /// were not measured; they are ours.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub fn from_measured(name: &str, m: &MeasuredFabric) -> Result<Self, GarmentError> {
        /// Least stiffness of a woven or knitted sheet, N/m: fits of weak fabrics go negative at rest.
        const LEAST: f64 = 5.0;
        let at = |row: usize, column: usize| {
            m.stretching
                .get(row)
                .and_then(|r| r.get(column))
                .copied()
                .unwrap_or(0.0)
        };
        let mean = |row: usize, column: usize| (0.5 * (at(0, column) + at(row, column))).max(LEAST);
        let (weft, warp, shear) = (mean(1, 0), mean(5, 2), mean(3, 3));
        // A coupling beyond the geometric mean would make the sheet unstable.
        let coupling = (0.5 * (at(0, 1) + at(3, 1))).clamp(0.0, 0.9 * (weft * warp).sqrt());
        let first: Vec<f64> = m
            .bending
            .iter()
            .filter_map(|r| r.first())
            .map(|b| b.max(0.0))
            .collect();
        let material = Self {
            name: name.to_owned(),
            area_density: m.density,
            stretch_warp: warp,
            stretch_weft: weft,
            shear,
            coupling,
            bending: first.iter().sum::<f64>() / first.len().max(1) as f64,
            friction: 0.3,
            damping: 1.0,
            thickness: 5e-4,
            source: "measured as in Wang, O'Brien & Ramamoorthi 2011; friction, damping and thickness are ours".into(),
        };
        material.check()?;
        Ok(material)
    }
    /// How far the fabric gives around the body before it is felt as too tight, as a share of its length: until its
    /// tension, in the direction that gives more, presses a trunk of 15 cm radius with 0.7 kPa (Laplace's p = T/r), half
    /// of what a tolerated waistband does; and at most as far as skin itself stretches comfortably.
    pub fn give(&self) -> f64 {
        /// N/m.
        const TENSION: f64 = 105.0;
        /// Kirk & Ibrahim 1966: skin strains from 12 % on; a garment cannot ask for more than a knit of low power has.
        const MOST: f64 = 0.12;
        (TENSION / self.stretch_warp.min(self.stretch_weft)).min(MOST)
    }
    /// Refuses numbers no sheet can have.
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
            ("bending", self.bending),
            ("friction", self.friction),
            ("damping", self.damping),
            ("thickness", self.thickness),
        ];
        for (field, v, ok) in positive
            .iter()
            .map(|(f, v)| (f, v, *v > 0.0))
            .chain(not_negative.iter().map(|(f, v)| (f, v, *v >= 0.0)))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_sheets_and_faults_are_named() {
        for n in Material::PRESETS {
            Material::preset(n)
                .expect("preset")
                .check()
                .expect("usable");
        }
        assert!(Material::preset("chainmail").is_err());
        let mut m = Material::preset("silk").expect("preset");
        m.shear = f64::NAN;
        assert!(
            m.check()
                .expect_err("NaN")
                .to_string()
                .contains("material.shear")
        );
    }
}
