//! Fabrics by name.

use super::{GarmentError, IsotropicSolid, Material};

/// Source of the presets.
const CIPC: &str = "Codim-IPC fabric table (ipc-sim/Codim-IPC, FEMDiscreteShellBase.py, Apache-2.0), plane-stress membrane \
                    E·h and E·h³/12; friction and damping are estimates";

/// Row of that table: Young's modulus (Pa), Poisson ratio, density (kg/m³).
const fn solid(young: f64, poisson: f64, density: f64) -> IsotropicSolid {
    IsotropicSolid {
        young,
        poisson,
        density,
    }
}

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

    /// A preset by name, see [`Self::PRESETS`].
    ///
    /// # Errors
    /// Lists the known names.
    pub fn preset(name: &str) -> Result<Self, GarmentError> {
        let preset = Self::knit(name).or_else(|| Self::heavy_woven(name));
        preset
            .or_else(|| Self::light_woven(name))
            .ok_or_else(|| GarmentError::Field {
                field: "material".into(),
                why: format!(
                    "`{name}` is not known; presets are {}",
                    Self::PRESETS.join(", ")
                ),
            })
    }
    fn knit(name: &str) -> Option<Self> {
        Some(match name {
            // "95% wool 5% lycra" of the table, its knit with elastane.
            "jersey" => Self {
                // KES-F (Kawabata 1980), single jersey: 5e-6 to 2e-5 N·m, far above the sheet formula, since loops
                // lock when compressed.
                bending: 8e-6,
                friction: 0.4,
                damping: 1.0,
                ..Self::isotropic("jersey", solid(1.2e6, 0.071, 543.292_683), 0.000_328, CIPC)
            },
            // Sweatshirt fleece, 300 g/m². KES-F, double knits: 5e-5 to 2e-4 N·m.
            "fleece" => Self {
                area_density: 0.30,
                bending: 8e-5,
                friction: 0.45,
                damping: 1.5,
                ..Self::isotropic("fleece", solid(1.2e6, 0.071, 543.292_683), 0.000_6, CIPC)
            },
            _ => return None,
        })
    }
    fn heavy_woven(name: &str) -> Option<Self> {
        Some(match name {
            // Stored base modulus 2.448 MPa with weft and warp at 4.793 and 9.029 MPa.
            "denim" => Self {
                stretch_warp: 9_029_000.0 * 0.000_66,
                stretch_weft: 4_793_000.0 * 0.000_66,
                area_density: 0.40, // 11.8 oz/yd², a jeans weight
                bending: 4e-5,      // KES-F, denim: 2e-5 to 1e-4 N·m
                friction: 0.45,
                damping: 1.5,
                ..Self::isotropic("denim", solid(2_448_000.0, 0.2, 400.0), 0.000_66, CIPC)
            },
            // Bending is twice that of a light denim: edges of 21 mm do not resolve finer folds, and a softer sheet
            // crumples at every edge (seen, not measured).
            "twill" => Self {
                area_density: 0.28,
                bending: 1e-4,
                friction: 0.25,
                damping: 2.0,
                ..Self::isotropic("twill", solid(2_448_000.0, 0.2, 400.0), 0.000_66, CIPC)
            },
            // Weft, warp and base modulus of the table.
            "canvas" => Self {
                stretch_warp: 19_804_000.0 * 0.000_53,
                stretch_weft: 5_366_000.0 * 0.000_53,
                area_density: 0.294, // stored as 294: grams
                bending: 2e-4,
                friction: 0.5,
                ..Self::isotropic("canvas", solid(2_009_000.0, 0.2, 294.0), 0.000_53, CIPC)
            },
            _ => return None,
        })
    }
    fn light_woven(name: &str) -> Option<Self> {
        Some(match name {
            "cotton" => Self {
                bending: 1e-5, // KES-F, shirting: 4e-6 to 1.5e-5 N·m
                ..Self::isotropic(
                    "cotton",
                    solid(821_000.0 * 4.0, 0.243, 472.641_509),
                    0.000_318,
                    CIPC,
                )
            },
            "wool" => Self {
                bending: 2e-5, // KES-F, suiting: 5e-6 to 3e-5 N·m
                ..Self::isotropic(
                    "wool",
                    solid(170_000.0, 0.277, 413.380_282),
                    0.000_568,
                    CIPC,
                )
            },
            "polyester" => Self {
                bending: 5e-6, // KES-F, linings: 1e-6 to 8e-6 N·m
                friction: 0.2,
                ..Self::isotropic(
                    "polyester",
                    solid(478_000.0, 0.381, 653.174_603),
                    0.000_252,
                    CIPC,
                )
            },
            "silk" => Self {
                stretch_warp: 4_971_000.0 * 0.000_18,
                stretch_weft: 4_300_000.0 * 0.000_18,
                area_density: 0.083, // 19 momme
                bending: 2e-6,       // KES-F, silk habutai: 1e-6 to 4e-6 N·m
                friction: 0.2,
                damping: 0.5,
                ..Self::isotropic("silk", solid(570_000.0, 0.3, 461.0), 0.000_18, CIPC)
            },
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_usable_and_faults_are_named() {
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
