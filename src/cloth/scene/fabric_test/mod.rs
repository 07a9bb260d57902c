//! Textile tests of a fabric by either solver: cantilever, Cusick's drape, picture frame, against published values.

mod cantilever;
mod cusick;
mod picture_frame;
mod report;
mod rest;
#[cfg(test)]
mod tests;

pub use report::{FabricReading, FabricTestReport};

use crate::live::{BendingResolution, ClothError};
use crate::scene::SceneError;
use crate::settings::{FabricTestSettings, ResolutionSettings};
use tryon_garment::FabricSample;

/// Textile test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FabricTest {
    /// Strip of 25 mm that overhangs by twice its bending length (ASTM D1388, Peirce 1930).
    Cantilever,
    /// Disc of 30 cm on a support of 18 cm (Cusick 1965, BS 5058).
    Cusick,
    /// Square in a frame of hinged bars (Cao et al. 2008).
    PictureFrame,
}

/// Solver of a textile test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FabricSolver {
    /// Real time, with the bending that its mesh carries.
    Realtime,
    /// Offline, with the measured law.
    Offline,
}

/// Textile test to run.
#[derive(Clone, Debug)]
pub struct FabricTrial {
    /// Test.
    pub test: FabricTest,
    /// Fabric.
    pub fabric: FabricSample,
    /// Solver.
    pub solver: FabricSolver,
    /// Wanted edge length (m).
    pub edge: f64,
}

impl FabricTest {
    /// Test of this name.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "cantilever" => Some(Self::Cantilever),
            "cusick" => Some(Self::Cusick),
            "picture-frame" => Some(Self::PictureFrame),
            _ => None,
        }
    }
    /// Name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cantilever => "cantilever",
            Self::Cusick => "cusick",
            Self::PictureFrame => "picture-frame",
        }
    }
}

impl FabricTrial {
    /// Runs the test.
    ///
    /// # Errors
    /// A fabric or edge length at fault; a step that is not solved.
    pub fn run(&self, settings: &FabricTestSettings) -> Result<FabricTestReport, SceneError> {
        if !(self.edge > settings.shortest_edge && self.edge < settings.longest_edge) {
            let [least, most] = [settings.shortest_edge, settings.longest_edge];
            return Err(SceneError::Field {
                scene: self.test.name().into(),
                field: "edge".into(),
                why: format!("{} m is not in {least} to {most} m", self.edge),
            });
        }
        self.fabric.material.check().map_err(ClothError::from)?;
        match self.test {
            FabricTest::Cantilever => cantilever::run(self, settings),
            FabricTest::Cusick => cusick::run(self, settings),
            FabricTest::PictureFrame => picture_frame::run(self, settings),
        }
    }

    /// Report without readings.
    fn report(&self) -> FabricTestReport {
        FabricTestReport {
            test: self.test.name(),
            fabric: self.fabric.material.name.clone(),
            solver: match self.solver {
                FabricSolver::Realtime => "realtime",
                FabricSolver::Offline => "offline",
            },
            edge: self.edge,
            readings: Vec::new(),
            resolution: None,
            settled: true,
            moving: None,
        }
    }
}

/// Real-time material of a mesh, and its limit.
fn carried(
    trial: &FabricTrial,
    rest: &[[[f64; 2]; 3]],
) -> (BendingResolution, tryon_garment::Material) {
    BendingResolution::of(&trial.fabric.material, rest, &ResolutionSettings::default())
}
