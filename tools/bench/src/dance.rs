//! Outfit on a dancing body without a known template: time, stretch and penetration over the whole dance.

use super::dance_bodies::{DanceBodies, fault};
use super::inside::Solid;
use super::{EvaluateError, OutfitSpec, Row};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use tryon_body::{BodyShape, Pose, RestBody, Template, measure};
use tryon_cloth::{Input, Workspace, step};
use tryon_dressing::{Dressed, rig_standing, suggest};
use tryon_geometry::math::order_statistics::{median, percentile};
use tryon_geometry::math::{Body, Rigid, World};

/// Steps a second.
const RATE: u32 = 60;
/// Steps between two measurements of penetration.
const PENETRATION_INTERVAL: usize = 4;

/// Moving body with a fitted skeleton.
pub struct Dance {
    /// The standing body, rigged.
    pub template: Arc<Template>,
    /// Its rest shape.
    pub rest: RestBody,
    bodies: DanceBodies,
    /// Mean distance between the fitted template and the body's vertices (m).
    pub fit: f64,
}

/// Cost and quality of one dance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DanceReport {
    /// Vertices of all garments.
    pub vertices: usize,
    /// Time of dressing (ms).
    pub dressing_ms: f64,
    /// Run time of each step of 1/60 s (ms).
    pub ms: Vec<f64>,
    /// 99th percentile of the edges' stretch over the whole dance.
    pub p99_strain: f64,
    /// Depths of vertices inside the body over the whole dance, metres: 99th percentile, largest.
    pub penetration: [f64; 2],
    /// Largest number of body vertices inside another limb.
    pub buried: usize,
    /// Smallest share of its stiffness that a garment kept.
    pub softened: f64,
    /// Steps that kept the last good state.
    pub faults: usize,
}

impl DanceReport {
    /// Row of a benchmark; its time is the median.
    pub fn row(&self, method: &str) -> Row {
        let p90 = percentile(&mut self.ms.clone(), 90).unwrap_or(0.0);
        let ms = median(&mut self.ms.clone()).unwrap_or(0.0);
        Row::new("dance", method, ms)
            .with("vertices", self.vertices)
            .with("dressing_ms", format!("{:.0}", self.dressing_ms))
            .with("p90_ms", format!("{p90:.1}"))
            .with("stiffness_kept", format!("{:.2}", self.softened))
            .with("faults", self.faults)
            .error("p99_strain_percent", self.p99_strain * 100.0)
            .error("p99_penetration_mm", self.penetration[0] * 1e3)
            .error("max_penetration_mm", self.penetration[1] * 1e3)
    }
}

/// Reads the dance and fits a skeleton to its body: the embedded template is tracked onto a rendering of it.
///
/// # Errors
/// A file that is missing or does not fit the others.
pub fn load(folder: &Path) -> Result<Dance, EvaluateError> {
    let bodies = DanceBodies::read(folder)?;
    let (template, fit) = rig_standing(bodies.mesh.clone()).map_err(fault)?;
    let rest = template.personalise(&BodyShape::default());
    Ok(Dance {
        template: Arc::new(template),
        rest,
        bodies,
        fit,
    })
}

impl Dance {
    /// Dresses the standing body in the suggested sizes.
    fn dress(&self, outfit: &OutfitSpec) -> Result<Dressed, EvaluateError> {
        let measures = measure::measure(&self.template, &self.rest).map_err(fault)?;
        let size = |garment: &str| {
            let suggested = suggest(garment, &measures).map_err(|e| e.to_string())?;
            Ok(suggested.size)
        };
        let standing = Pose::rest(self.template.skeleton(), Rigid::<World, Body>::identity());
        let dressed = outfit.dress(&self.template, &self.rest, &standing, size);
        dressed.map_err(fault)
    }

    /// Simulates an outfit over the first `seconds` of the dance.
    ///
    /// # Errors
    /// A garment that is not known, or cannot be put on or simulated.
    pub fn run(&self, outfit: &OutfitSpec, seconds: f64) -> Result<DanceReport, EvaluateError> {
        let Dressed {
            model,
            mut state,
            report: dressing,
            ..
        } = self.dress(outfit)?;
        let mut report = DanceReport {
            vertices: state.garments.iter().map(|g| g.positions.len()).sum(),
            dressing_ms: dressing.ms,
            softened: 1.0,
            ..DanceReport::default()
        };
        let (mut work, mut depths, mut strain) = (Workspace::default(), Vec::new(), Vec::new());
        let dt = 1.0 / f64::from(RATE);
        let steps = (seconds.min(self.bodies.seconds()) / dt) as usize;
        for index in 1..=steps {
            let body = &self.bodies.at(index as f64 * dt);
            let started = Instant::now();
            let r = step(&model, &mut state, &Input { body, dt }, &mut work).map_err(fault)?;
            report.ms.push(started.elapsed().as_secs_f64() * 1e3);
            strain.push(r.p99_strain);
            report.buried = report.buried.max(r.buried);
            report.softened = report.softened.min(r.softened);
            report.faults += usize::from(r.kept_last_good.is_some());
            if index % PENETRATION_INTERVAL == 0 {
                let solid = Solid::new(body, self.template.mesh().faces());
                let vertices = state.garments.iter().flat_map(|g| &g.positions);
                depths.extend(vertices.map(|p| f64::from(solid.depth(p))));
            }
        }
        report.p99_strain = percentile(&mut strain, 99).unwrap_or(0.0);
        report.penetration = [99, 100].map(|p| percentile(&mut depths, p).unwrap_or(0.0));
        Ok(report)
    }
}
