//! Fabrics by name: one file each, with the publication its numbers come from.

use super::{Bending, FabricLook, GarmentError, Material, Tensile};
use serde::Deserialize;

/// Fabric of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct FabricSample {
    /// Sheet.
    pub material: Material,
    /// Drape coefficient of the same fabric by Cusick's test, where its publication has one.
    pub drape_coefficient: Option<f64>,
    /// Fields that are no measurement of this fabric.
    pub estimated: Vec<String>,
    /// Its look.
    pub look: FabricLook,
}

/// Text of a fabric file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FabricFile {
    name: String,
    /// Fibres and weave.
    #[serde(rename = "fabric")]
    _fabric: String,
    area_density: f64,
    thickness: f64,
    /// Tension curves, or the stiffness below.
    tensile: Option<Tensile>,
    /// Stiffness of a strip (N/m) where only that is known.
    stretch: Option<StretchFile>,
    /// Geometric mean of both Poisson ratios.
    poisson: f64,
    shear: f64,
    bending: Bending,
    friction: f64,
    damping: f64,
    drape_coefficient: Option<f64>,
    look: FabricLook,
    estimated: Vec<String>,
    source: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StretchFile {
    warp: f64,
    weft: f64,
}

/// Names and files of the presets.
const FILES: [(&str, &str); 9] = [
    ("jersey", include_str!("fabrics/jersey.json")),
    ("cotton", include_str!("fabrics/cotton.json")),
    ("denim", include_str!("fabrics/denim.json")),
    ("twill", include_str!("fabrics/twill.json")),
    ("fleece", include_str!("fabrics/fleece.json")),
    ("wool", include_str!("fabrics/wool.json")),
    ("polyester", include_str!("fabrics/polyester.json")),
    ("canvas", include_str!("fabrics/canvas.json")),
    ("silk", include_str!("fabrics/silk.json")),
];

impl FabricSample {
    /// Fabric of a material without a file.
    pub fn of_material(material: Material) -> Self {
        Self {
            material,
            drape_coefficient: None,
            estimated: Vec::new(),
            look: FabricLook::default(),
        }
    }
    /// True if a field is no measurement of this fabric.
    pub fn is_estimated(&self, field: &str) -> bool {
        self.estimated.iter().any(|e| e == field || e == "all")
    }
    /// Fabric of a preset, see [`Material::PRESETS`].
    ///
    /// # Errors
    /// Lists the known names.
    pub fn named(name: &str) -> Result<Self, GarmentError> {
        let Some((_, text)) = FILES.iter().find(|(n, _)| *n == name) else {
            return Err(GarmentError::Field {
                field: "material".into(),
                why: format!(
                    "`{name}` is not known; presets are {}",
                    Material::PRESETS.join(", ")
                ),
            });
        };
        let file: FabricFile = serde_json::from_str(text).map_err(|e| GarmentError::Field {
            field: format!("fabrics/{name}.json"),
            why: e.to_string(),
        })?;
        file.fabric()
    }
}

impl Default for FabricLook {
    /// That of jersey.
    fn default() -> Self {
        #[expect(
            clippy::expect_used,
            reason = "the file is part of the build; a test reads it"
        )]
        let jersey = FabricSample::named("jersey").expect("a preset");
        jersey.look
    }
}

impl FabricFile {
    fn fabric(self) -> Result<FabricSample, GarmentError> {
        let [warp, weft] = match (&self.tensile, &self.stretch) {
            (Some(t), None) => [t.warp, t.weft].map(|c| c.cubic().stiffness),
            (None, Some(s)) => [s.warp, s.weft],
            _ => {
                return Err(GarmentError::Field {
                    field: format!("fabrics/{}.json", self.name),
                    why: "one of tensile and stretch is needed".into(),
                });
            }
        };
        let material = Material {
            name: self.name,
            area_density: self.area_density,
            stretch_warp: warp,
            stretch_weft: weft,
            shear: self.shear,
            coupling: (warp * weft).sqrt() * self.poisson / (1.0 - self.poisson * self.poisson),
            bending: self.bending,
            tensile: self.tensile,
            measured: None,
            friction: self.friction,
            damping: self.damping,
            thickness: self.thickness,
            source: self.source,
        };
        material.check()?;
        Ok(FabricSample {
            material,
            drape_coefficient: self.drape_coefficient,
            estimated: self.estimated,
            look: self.look,
        })
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
        Ok(FabricSample::named(name)?.material)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every file is read, bears its name and source, and has a weight and bending length of clothing.
    #[test]
    fn files_are_usable() {
        assert_eq!(FILES.map(|f| f.0), Material::PRESETS);
        for name in Material::PRESETS {
            let fabric = FabricSample::named(name).expect("a file");
            let m = &fabric.material;
            assert!(m.name == name && m.source.len() > 40, "{name}");
            assert!((0.05..0.6).contains(&m.area_density), "{name}");
            for length in m.bending.lengths(9.81 * m.area_density) {
                assert!((0.005..0.06).contains(&length), "{name}: {length} m");
            }
            let cited = fabric.estimated.iter().all(|f| !f.is_empty());
            assert!(cited && (0.0..0.5).contains(&m.poisson()), "{name}");
        }
    }

    #[test]
    fn presets_are_usable_and_faults_are_named() {
        assert!(Material::preset("chainmail").is_err());
        let mut m = Material::preset("silk").expect("preset");
        m.shear = f64::NAN;
        let why = m.check().expect_err("NaN").to_string();
        assert!(why.contains("material.shear"));
        let mut m = Material::preset("silk").expect("preset");
        m.bending.weft = -1.0;
        let why = m.check().expect_err("negative").to_string();
        assert!(why.contains("material.bending.weft"));
    }
}
