//! Variants of the method that the bench compares: without each of its parts, and over its settings.

use crate::scans::{ScanScene, TrueGarment};
use tryon_clothcap::CaptureConfig;
use tryon_clothcap::multi::PartFitConfig;
use tryon_clothcap::segment::{LabelConfig, Slot};
use tryon_garment::GarmentKind;

/// Points of a scan that a sweep compares.
const POINTS: [usize; 3] = [15_000, 60_000, 150_000];
/// Coupling lengths of the part fit, metres.
const COUPLINGS: [f64; 4] = [0.003, 0.006, 0.012, 0.024];
/// Lengths of its Laplacian, metres.
const LAPLACIANS: [f64; 3] = [0.003, 0.006, 0.012];
/// Its iterations.
const ITERATIONS: [usize; 5] = [1, 2, 4, 8, 16];

/// Variant of the method, for ablation and sweeps.
#[derive(Clone, Debug, PartialEq)]
pub struct CaptureVariant {
    /// Name in the table.
    pub name: &'static str,
    /// Settings.
    pub config: CaptureConfig,
    /// Number and places of the garments are those of the scene; otherwise they are found.
    pub knows_outfit: bool,
    /// Points of a scan in place of the scene's.
    pub points: Option<usize>,
    /// Value of the setting that `name` speaks of, in a sweep.
    pub value: Option<f64>,
}

impl CaptureVariant {
    fn new(name: &'static str, config: CaptureConfig) -> Self {
        Self {
            name,
            config,
            knows_outfit: false,
            points: None,
            value: None,
        }
    }

    /// The method as it ships.
    pub fn whole() -> Self {
        Self::new("whole", CaptureConfig::default())
    }

    /// [`CaptureVariant::whole`], without each of its parts, and with the true number of garments.
    pub fn all() -> Vec<Self> {
        let labelled = |name, labels| {
            let config = CaptureConfig {
                labels,
                ..CaptureConfig::default()
            };
            Self::new(name, config)
        };
        let without_prior = LabelConfig {
            without_prior: true,
            ..LabelConfig::default()
        };
        let without_smoothness = LabelConfig {
            without_smoothness: true,
            ..LabelConfig::default()
        };
        vec![
            Self::whole(),
            labelled("without prior", without_prior),
            labelled("without smoothness", without_smoothness),
            Self {
                knows_outfit: true,
                ..labelled("garments given", LabelConfig::default())
            },
        ]
    }

    /// Run time against error: points of the scans, then lengths and iterations of the part fit, each around its default.
    pub fn sweep() -> Vec<Self> {
        let default = PartFitConfig::default();
        let fitted = |name, value, parts| {
            let config = CaptureConfig {
                parts,
                ..CaptureConfig::default()
            };
            Self {
                value: Some(value),
                ..Self::new(name, config)
            }
        };
        let scanned = POINTS.map(|n| Self {
            points: Some(n),
            ..fitted("scan points", n as f64, default)
        });
        let coupled = COUPLINGS.map(|coupling| {
            let parts = PartFitConfig {
                coupling,
                ..default
            };
            fitted("coupling, mm", 1e3 * coupling, parts)
        });
        let smoothed = LAPLACIANS.map(|laplacian| {
            let parts = PartFitConfig {
                laplacian,
                ..default
            };
            fitted("Laplacian, mm", 1e3 * laplacian, parts)
        });
        let iterated = ITERATIONS.map(|iterations| {
            let parts = PartFitConfig {
                iterations,
                ..default
            };
            fitted("iterations", iterations as f64, parts)
        });
        let fits = coupled.into_iter().chain(smoothed).chain(iterated);
        scanned.into_iter().chain(fits).collect()
    }

    /// The same run, whatever its name.
    pub(super) fn is_same_run(&self, other: &Self) -> bool {
        self.config == other.config
            && (self.knows_outfit, self.points) == (other.knows_outfit, other.points)
    }

    /// Scans of a scene as this variant sees them.
    pub(super) fn scanned(&self, scene: &ScanScene) -> ScanScene {
        let mut out = scene.clone();
        out.scanner.points = self.points.unwrap_or(out.scanner.points);
        out
    }

    /// Settings for an outfit.
    pub(super) fn config(&self, garments: &[TrueGarment]) -> CaptureConfig {
        let mut out = self.config.clone();
        if self.knows_outfit {
            out.labels.slots = Some(slots(garments));
        }
        out
    }
}

/// Places of true garments, innermost first: of two on the torso the outer one is the top.
fn slots(garments: &[TrueGarment]) -> Vec<Slot> {
    let mut out = Vec::new();
    for garment in garments.iter().rev().filter(|g| !g.is_rigid) {
        let slot = match garment.kind {
            GarmentKind::Top if out.contains(&Slot::Top) => Slot::Under,
            GarmentKind::Top => Slot::Top,
            GarmentKind::Skirt | GarmentKind::Trousers => Slot::Bottom,
            GarmentKind::Dress => Slot::OnePiece,
        };
        if !out.contains(&slot) {
            out.push(slot);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_tops_the_outer_one_is_the_top() {
        let garment = |kind, is_rigid| TrueGarment {
            name: String::new(),
            kind,
            is_rigid,
            vertices: Vec::new(),
            faces: Vec::new(),
        };
        use GarmentKind::{Dress, Top, Trousers};
        let layered = [
            garment(Top, false),
            garment(Trousers, false),
            garment(Top, false),
            garment(Dress, true),
        ];
        assert_eq!(slots(&layered), [Slot::Top, Slot::Bottom, Slot::Under]);
        assert_eq!(slots(&[garment(Dress, false)]), [Slot::OnePiece]);
    }

    #[test]
    fn a_sweep_holds_the_default_once_per_setting() {
        let whole = CaptureVariant::whole();
        let sweep = CaptureVariant::sweep();
        let same = sweep.iter().filter(|v| v.is_same_run(&whole)).count();
        assert_eq!(same, 3, "points are given, the others are not");
        assert!(sweep.iter().all(|v| v.value.is_some()));
    }
}
