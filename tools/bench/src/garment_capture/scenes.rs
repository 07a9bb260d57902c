//! Scenes of the capture bench: bodies, outfits, motions and colours.

use crate::EvaluateError;
use crate::scans::{
    CameraRig, ScanDefects, ScanGarment, ScanMotion, ScanPalette, ScanScene, ScannerSetting,
};
use tryon::mirror::Choice;
use tryon_body::BodyShape;
use tryon_synth::{Actor, Routine};

/// Named scene.
#[derive(Clone, Debug)]
pub struct CaptureScene {
    /// Name in the table.
    pub name: String,
    /// Its scans.
    pub scene: ScanScene,
    /// Kept apart from development.
    pub is_unseen: bool,
}

/// Points of a scan.
const POINTS: usize = 60_000;
/// Scans of a scene and their rate, Hz.
const SCANS: usize = 3;
/// See [`SCANS`].
const RATE: f64 = 5.0;

/// One scene: name, garments with their layers, shape coefficients, colours.
type SceneSpec = (
    &'static str,
    &'static [(&'static str, u8)],
    &'static [f64],
    ScanPalette,
);

/// Outfits on bodies of several shapes; every third is unseen.
const SCENES: [SceneSpec; 12] = [
    (
        "tshirt and trousers",
        &[("trousers", 0), ("tshirt", 1)],
        &[0.0],
        ScanPalette::Distinct,
    ),
    (
        "long sleeves tucked",
        &[("longsleeve", 0), ("trousers", 1)],
        &[1.0, -0.5, 1.0],
        ScanPalette::Distinct,
    ),
    (
        "T-shirt and skirt",
        &[("tshirt", 0), ("skirt", 1)],
        &[-0.5, 0.0, -1.0],
        ScanPalette::Distinct,
    ),
    (
        "low contrast",
        &[("trousers", 0), ("tshirt", 1)],
        &[0.5, 1.0, 0.5],
        ScanPalette::LowContrast,
    ),
    (
        "one colour",
        &[("trousers", 0), ("longsleeve", 1)],
        &[0.0, 0.5, 1.0],
        ScanPalette::Uniform,
    ),
    (
        "dress",
        &[("dress", 0)],
        &[-0.3, 0.3, -1.0],
        ScanPalette::Distinct,
    ),
    (
        "heavy",
        &[("trousers", 0), ("tshirt", 1)],
        &[0.0, 2.0, 0.5],
        ScanPalette::Distinct,
    ),
    (
        "vest over sleeves",
        &[("longsleeve", 0), ("trousers", 1), ("tank", 2)],
        &[0.5, 0.0, 1.0],
        ScanPalette::Distinct,
    ),
    (
        "hooded top and shorts",
        &[("shorts", 0), ("hoodie", 1)],
        &[1.2, -1.0, 0.0],
        ScanPalette::Distinct,
    ),
    (
        "long sleeves and skirt",
        &[("longsleeve", 0), ("skirt", 1)],
        &[0.3, 0.5, -1.0],
        ScanPalette::Distinct,
    ),
    (
        "dress on a tall woman",
        &[("dress", 0)],
        &[1.0, -0.5, -1.0],
        ScanPalette::Distinct,
    ),
    (
        "top and skirt of one colour",
        &[("skirt", 0), ("tshirt", 1)],
        &[-0.5, 1.0, -0.8],
        ScanPalette::Uniform,
    ),
];

/// Scene whose scans are clouds of several depth cameras, fused; the other scenes keep their seeds.
const FUSED: SceneSpec = (
    "noisy fused cloud",
    &[("trousers", 0), ("tshirt", 1)],
    &[0.4, 0.3, 0.2],
    ScanPalette::Distinct,
);

/// Garments of the library with their layers.
///
/// # Errors
/// A garment that the library lacks.
pub(super) fn library_outfit(outfit: &[(&str, u8)]) -> Result<Vec<ScanGarment>, EvaluateError> {
    let garment = |(name, layer): &(&str, u8)| {
        let choice = Choice::library(name, None).map_err(|e| EvaluateError::Scene {
            scene: (*name).into(),
            why: e.to_string(),
        })?;
        Ok(ScanGarment {
            choice,
            layer: Some(*layer),
        })
    };
    outfit.iter().map(garment).collect()
}

/// Actor of scene `k` with these shape coefficients.
pub(super) fn shaped_actor(coefficients: &[f64], k: usize) -> Actor {
    Actor {
        shape: BodyShape {
            coefficients: coefficients.to_vec(),
            ..BodyShape::default()
        },
        appearance: k as u64,
        ..Actor::default()
    }
}

/// Scenes of the bench.
///
/// # Errors
/// A garment that the library lacks.
pub fn capture_scenes() -> Result<Vec<CaptureScene>, EvaluateError> {
    let scene = |(k, spec): (usize, &SceneSpec)| -> Result<CaptureScene, EvaluateError> {
        let (name, outfit, shape, palette) = spec;
        Ok(CaptureScene {
            name: (*name).into(),
            scene: ScanScene {
                actor: shaped_actor(shape, k),
                garments: library_outfit(outfit)?,
                skinned: Vec::new(),
                motion: ScanMotion::Play {
                    routine: Routine::TryOn,
                    start: 0.4,
                },
                palette: *palette,
                scanner: ScannerSetting {
                    points: POINTS,
                    noise: 1e-3,
                    ..ScannerSetting::default()
                },
                defects: ScanDefects::default(),
                scans: SCANS,
                rate: RATE,
                edge: 0.021,
                seed: 100 + k as u64,
            },
            is_unseen: k % 3 == 2,
        })
    };
    let all = SCENES.iter().chain([&FUSED]).enumerate();
    let mut all: Vec<CaptureScene> = all.map(scene).collect::<Result<_, _>>()?;
    if let Some(fused) = all.last_mut() {
        fused.scene.scanner.rig = Some(CameraRig::default());
    }
    Ok(all)
}
