//! Cusick's drape test by the disc of `DrapeDisc`.

use super::rest::Specimen;
use super::{FabricReading, FabricTestReport, FabricTrial};
use crate::scene::SceneError;
use crate::settings::FabricTestSettings;
use crate::specimens::drape_disc::{DrapeDisc, SPECIMEN, SUPPORT};
use tryon_geometry::math::V3d;

/// Runs the test.
pub(super) fn run(
    trial: &FabricTrial,
    settings: &FabricTestSettings,
) -> Result<FabricTestReport, SceneError> {
    let free = ((SPECIMEN - SUPPORT) / trial.edge - 0.5).round().max(1.0);
    let disc = DrapeDisc::new(free as usize);
    let place = |(i, p): (usize, &nalgebra::Vector2<f64>)| {
        // Golden ratio sequence: bumps without a period, none between the plates.
        let bump = (i as f64 * 0.618_033_988_75).fract() - 0.5;
        let height = if i < disc.held {
            0.0
        } else {
            settings.bump * bump
        };
        V3d::new(p.x, height, -p.y)
    };
    let specimen = Specimen {
        at: disc.at.clone(),
        faces: disc.faces.clone(),
        start: disc.at.iter().enumerate().map(place).collect(),
        held: disc.held,
    };
    let mut report = trial.report();
    let x = specimen.rest(trial, settings, &mut report)?;
    report.readings.push(FabricReading {
        quantity: "drape coefficient",
        unit: "%",
        measured: 100.0 * disc.drape_coefficient(&x),
        published: trial.fabric.drape_coefficient.map(|d| 100.0 * d),
        origin: "of the same fabric",
    });
    Ok(report)
}
