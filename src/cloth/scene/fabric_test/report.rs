//! Readings of a textile test.

use crate::live::BendingResolution;
use serde::Serialize;
use std::fmt;

/// Reading of a textile test beside the published value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FabricReading {
    /// Quantity and direction.
    pub quantity: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Reading of the simulated specimen.
    pub measured: f64,
    /// Published value; `None` where there is none.
    pub published: Option<f64>,
    /// Origin of the published value.
    pub origin: &'static str,
}

impl FabricReading {
    /// Relative error.
    pub fn error(&self) -> Option<f64> {
        self.published.map(|p| self.measured / p - 1.0)
    }
}

/// Result of a textile test.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FabricTestReport {
    /// Test.
    pub test: &'static str,
    /// Fabric.
    pub fabric: String,
    /// Solver.
    pub solver: &'static str,
    /// Wanted edge length (m).
    pub edge: f64,
    /// Readings.
    pub readings: Vec<FabricReading>,
    /// Bending that the real-time mesh carries.
    pub resolution: Option<BendingResolution>,
    /// True if every specimen came to rest.
    pub settled: bool,
    /// Vertex that moves most, and its speed, of the last specimen that did not come to rest.
    pub moving: Option<String>,
}

impl FabricTestReport {
    /// Records whether a specimen came to rest.
    pub(super) fn note_rest(&mut self, moving: Option<String>) {
        self.settled &= moving.is_none();
        self.moving = moving.or(self.moving.take());
    }
}

impl fmt::Display for FabricTestReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (test, fabric, solver) = (self.test, &self.fabric, self.solver);
        let edge = self.edge * 1e3;
        writeln!(f, "{test} of {fabric}, {solver}, edges of {edge:.1} mm")?;
        for r in &self.readings {
            write!(f, "  {}: {:.2} {}", r.quantity, r.measured, r.unit)?;
            match (r.published, r.error()) {
                (Some(p), Some(e)) => {
                    writeln!(f, ", published {p:.2} ({:+.1} %), {}", e * 100.0, r.origin)?
                }
                _ => writeln!(f, ", nothing published")?,
            }
        }
        if let Some(limit) = &self.resolution {
            writeln!(
                f,
                "  least bending of these edges: {:.1e} N·m, {:.1} times the fabric's at most",
                limit.least,
                limit.stiffening()
            )?;
        }
        match &self.moving {
            None => write!(f, "  settled"),
            Some(why) => write!(f, "  {why}"),
        }
    }
}
