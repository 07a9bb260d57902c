//! Outfit on a dancing body without a known template: time, stretch and penetration over the whole dance.

use super::dance_bodies::{DanceBodies, fault};
use super::inside::Solid;
use super::{EvaluateError, OutfitSpec, Row};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use tryon_body::{BodyShape, Pose, RestBody, Template, measure};
use tryon_cloth::{Input, State, Workspace, step};
use tryon_dressing::{Dressed, rig_standing, suggest};
use tryon_geometry::math::order_statistics::{median, percentile};
use tryon_geometry::math::{Body, P3, Rigid, World};
use tryon_geometry::mesh::Face;

/// Time of a step (s).
const DT: f64 = 1.0 / 60.0;
/// Steps between two measurements of penetration.
const PENETRATION_INTERVAL: usize = 4;

/// Moving body with a fitted skeleton.
pub struct Dance {
    /// The standing body, rigged.
    pub template: Arc<Template>,
    /// Its rest shape.
    pub rest: RestBody,
    /// The moving body.
    pub bodies: DanceBodies,
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
    /// Mean share of depth maps, contact and solver in it (ms).
    pub stages_ms: [f64; 3],
    /// 99th percentile of the edges' stretch over the whole dance.
    pub p99_strain: f64,
    /// Depths of vertices inside the body over the whole dance, metres: 99th percentile, largest.
    pub penetration: [f64; 2],
    /// Depths over vertices inside one limb only; two limbs that overlap have no outside between them.
    pub penetration_single: [f64; 2],
    /// Largest number of body vertices inside another limb.
    pub buried: usize,
    /// Smallest share of its stiffness that a garment kept.
    pub softened: f64,
    /// Steps that kept the last good state.
    pub faults: usize,
}

impl DanceReport {
    /// Median run time of a step (ms).
    pub fn median_ms(&self) -> f64 {
        median(&mut self.ms.clone()).unwrap_or(0.0)
    }
    /// Row of a benchmark.
    pub fn row(&self, method: &str) -> Row {
        let mm = |m: f64| m * 1e3;
        Row::new("dance", method, self.median_ms())
            .with("vertices", self.vertices)
            .error("p99_strain_percent", self.p99_strain * 100.0)
            .error("p99_penetration_mm", mm(self.penetration[0]))
            .error("max_penetration_mm", mm(self.penetration[1]))
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
    ///
    /// # Errors
    /// A garment that is not known or cannot be put on.
    pub fn dress(&self, outfit: &OutfitSpec) -> Result<Dressed, EvaluateError> {
        let measures = measure::measure(&self.template, &self.rest).map_err(fault)?;
        let size = |garment: &str| {
            let suggested = suggest(garment, &measures).map_err(|e| e.to_string())?;
            Ok(suggested.size)
        };
        let standing = Pose::rest(self.template.skeleton(), Rigid::<World, Body>::identity());
        outfit
            .dress(&self.template, &self.rest, &standing, size)
            .map_err(fault)
    }
    /// Simulates an outfit over the first `seconds` of the dance; `frame` receives time, body and garments after each
    /// step.
    ///
    /// # Errors
    /// A garment that cannot be put on or simulated.
    pub fn run(
        &self,
        outfit: &OutfitSpec,
        seconds: f64,
        mut frame: impl FnMut(f64, &[P3], &Dressed),
    ) -> Result<DanceReport, EvaluateError> {
        let mut dressed = self.dress(outfit)?;
        let mut report = DanceReport {
            vertices: dressed
                .state
                .garments
                .iter()
                .map(|g| g.positions.len())
                .sum(),
            dressing_ms: dressed.report.ms,
            softened: 1.0,
            ..DanceReport::default()
        };
        let (mut work, mut depths, mut single, mut strain) =
            (Workspace::default(), Vec::new(), Vec::new(), Vec::new());
        let steps = (seconds.min(self.bodies.seconds()) / DT) as usize;
        for index in 1..=steps {
            let time = index as f64 * DT;
            let body = self.bodies.at(time);
            let started = Instant::now();
            let r = step(
                &dressed.model,
                &mut dressed.state,
                &Input {
                    body: &body,
                    dt: DT,
                },
                &mut work,
            )
            .map_err(fault)?;
            report.ms.push(started.elapsed().as_secs_f64() * 1e3);
            for (sum, part) in report.stages_ms.iter_mut().zip([
                r.stages_ms.maps,
                r.stages_ms.contact,
                r.stages_ms.solve,
            ]) {
                *sum += part / steps as f64;
            }
            strain.push(r.p99_strain);
            report.buried = report.buried.max(r.buried);
            report.softened = report.softened.min(r.softened);
            report.faults += usize::from(r.kept_last_good.is_some());
            if index % PENETRATION_INTERVAL == 0 {
                measure_depths(
                    &dressed.state,
                    &body,
                    self.template.mesh().faces(),
                    &mut depths,
                    &mut single,
                );
            }
            frame(time, &body, &dressed);
        }
        report.p99_strain = percentile(&mut strain, 99).unwrap_or(0.0);
        let ends = |all: &mut [f64]| [99, 100].map(|p| percentile(all, p).unwrap_or(0.0));
        report.penetration = ends(&mut depths);
        report.penetration_single = ends(&mut single);
        Ok(report)
    }
}

/// Appends the depth of each garment vertex in the body.
fn measure_depths(
    state: &State,
    body: &[P3],
    faces: &[Face],
    depths: &mut Vec<f64>,
    single: &mut Vec<f64>,
) {
    let solid = Solid::new(body, faces);
    for p in state.garments.iter().flat_map(|g| &g.positions) {
        let depth = f64::from(solid.depth(p));
        depths.push(depth);
        if solid.winding(p) < 2 {
            single.push(depth);
        }
    }
}
