//! Scenes of the capture bench: bodies, outfits, motions and colours.

use super::settings::CaptureBenchSettings;
use crate::EvaluateError;
use crate::scans::ScanPalette::{self, Distinct, LowContrast, Uniform};
use crate::scans::{CameraRig, ScanGarment, ScanMotion, ScanScene, ScannerSetting};
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

/// One scene: name, garments with their layers, shape coefficients, colours.
type SceneSpec = (
    &'static str,
    &'static [(&'static str, u8)],
    &'static [f64],
    ScanPalette,
);

/// Outfits on bodies of several shapes; every third is unseen.
#[rustfmt::skip]
const SCENES: [SceneSpec; 12] = [
    ("tshirt and trousers", &[("trousers", 0), ("tshirt", 1)], &[0.0], Distinct),
    ("long sleeves tucked", &[("longsleeve", 0), ("trousers", 1)], &[1.0, -0.5, 1.0], Distinct),
    ("T-shirt and skirt", &[("tshirt", 0), ("skirt", 1)], &[-0.5, 0.0, -1.0], Distinct),
    ("low contrast", &[("trousers", 0), ("tshirt", 1)], &[0.5, 1.0, 0.5], LowContrast),
    ("one colour", &[("trousers", 0), ("longsleeve", 1)], &[0.0, 0.5, 1.0], Uniform),
    ("dress", &[("dress", 0)], &[-0.3, 0.3, -1.0], Distinct),
    ("heavy", &[("trousers", 0), ("tshirt", 1)], &[0.0, 2.0, 0.5], Distinct),
    ("vest over sleeves", &[("longsleeve", 0), ("trousers", 1), ("tank", 2)], &[0.5, 0.0, 1.0], Distinct),
    ("hooded top and shorts", &[("shorts", 0), ("hoodie", 1)], &[1.2, -1.0, 0.0], Distinct),
    ("long sleeves and skirt", &[("longsleeve", 0), ("skirt", 1)], &[0.3, 0.5, -1.0], Distinct),
    ("dress on a tall woman", &[("dress", 0)], &[1.0, -0.5, -1.0], Distinct),
    ("top and skirt of one colour", &[("skirt", 0), ("tshirt", 1)], &[-0.5, 1.0, -0.8], Uniform),
];

/// Scene whose scans are clouds of several depth cameras, fused; the other scenes keep their seeds.
#[rustfmt::skip]
const FUSED: SceneSpec = ("noisy fused cloud", &[("trousers", 0), ("tshirt", 1)], &[0.4, 0.3, 0.2], Distinct);

/// Garments of the library with their layers.
///
/// # Errors
/// A garment that the library lacks.
pub(super) fn library_outfit(outfit: &[(&str, u8)]) -> Result<Vec<ScanGarment>, EvaluateError> {
    let garment = |(name, layer): &(&str, u8)| {
        let choice = Choice::library(name, None).map_err(|e| EvaluateError::new(name, e))?;
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
        appearance: (k as u64).into(),
        ..Actor::default()
    }
}

/// Scenes of the bench.
///
/// # Errors
/// A garment that the library lacks.
pub fn capture_scenes() -> Result<Vec<CaptureScene>, EvaluateError> {
    let settings = CaptureBenchSettings::default();
    let scene = |(k, spec): (usize, &SceneSpec)| -> Result<CaptureScene, EvaluateError> {
        let (name, outfit, shape, palette) = spec;
        Ok(CaptureScene {
            name: (*name).into(),
            scene: ScanScene {
                actor: shaped_actor(shape, k),
                garments: library_outfit(outfit)?,
                motion: ScanMotion::Play {
                    routine: Routine::TryOn,
                    start: 0.4,
                },
                palette: *palette,
                scanner: ScannerSetting {
                    points: settings.points,
                    noise: settings.noise,
                    ..ScannerSetting::default()
                },
                scans: settings.scans,
                rate: settings.rate,
                edge: settings.edge,
                seed: 100 + k as u64,
                ..ScanScene::default()
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
