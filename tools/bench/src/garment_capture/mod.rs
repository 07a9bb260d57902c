//! Garment capture against truth: labels, boundaries, surfaces, the body below, other bodies; run time against error.

mod hems;
mod made_scenes;
mod scenes;
pub(crate) mod score;
mod settings;
mod turn;

pub use made_scenes::{MadeScenes, made_scenes};
pub use scenes::{CaptureScene, capture_scenes};
pub use settings::CaptureBenchSettings;
pub use turn::{TurnScene, measure_turn_scene, turn_scenes};

use super::scans::TrueScan;
use super::{EvaluateError, Row};
use hems::{distance_from_rings, seen_hems};
use score::{LabelScore, largest_distance, mean_distance, score_labels};
use std::sync::Arc;
use std::time::Instant;
use tryon_body::{Template, embedded};
use tryon_clothcap::align::find_frame;
use tryon_clothcap::archive::FrameDisplacements;
use tryon_clothcap::scan::BodyScan;
use tryon_clothcap::{
    BodyDresser, CaptureError, CapturedOutfit, FrameCapture, OutfitCapture, OutfitCaptureConfig,
    population,
};
use tryon_formats::scan::ScanMesh;
use tryon_geometry::math::P3;

/// Seed of the bodies that garments are retargeted to.
const BODIES_SEED: u64 = 11;

/// Captures the scans of a scene and compares with their truth: one row. A capture that fails is a row without errors and
/// with its reason as parameter.
///
/// # Errors
/// Scenes that cannot be made.
pub fn measure(scene: &CaptureScene, bodies: usize) -> Result<Row, EvaluateError> {
    Ok(measure_scans(&scene.name, &scene.scene.scans()?, bodies))
}

fn measure_scans(name: &str, scans: &[TrueScan], bodies: usize) -> Row {
    let row = |ms| Row::new(name, "whole", ms).with("scans", scans.len());
    match run(&embedded::template(), scans, bodies) {
        Ok(run) => run.row(row(run.first_ms)),
        Err(e) => row(0.0).with("fault", e),
    }
}

/// Means over the scans of a scene.
#[derive(Debug, Default)]
struct SceneRun {
    settings: CaptureBenchSettings,
    labels: LabelScore,
    surface: f64,
    /// Seen vertices.
    garment: Mean,
    /// Vertices below another garment, completed from the body.
    hidden: Mean,
    hem: Mean,
    body: f64,
    own: f64,
    inside: usize,
    dressed_ms: f64,
    first_ms: f64,
    later_ms: f64,
}

/// Mean with weights.
#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    sum: f64,
    weight: f64,
}

impl Mean {
    fn add(&mut self, value: f64, weight: usize) {
        self.sum += value * weight as f64;
        self.weight += weight as f64;
    }
    /// 0 of nothing.
    fn value(self) -> f64 {
        self.sum / self.weight.max(1.0)
    }
}

impl SceneRun {
    fn row(&self, row: Row) -> Row {
        row.error("F1", self.labels.f1)
            .error("boundary_mm", 1e3 * self.labels.boundary)
            .error("surface_mm", 1e3 * self.surface)
            .error("garment_mm", 1e3 * self.garment.value())
            .error("hidden_mm", 1e3 * self.hidden.value())
            .error("hem_mm", 1e3 * self.hem.value())
            .error("body_mm", 1e3 * self.body)
            .error("own_body_max_mm", 1e3 * self.own)
            .error("inside", self.inside as f64)
            .error("retarget_ms", self.dressed_ms)
            .error("later_ms", self.later_ms)
    }
}

fn run(
    template: &Arc<Template>,
    scans: &[TrueScan],
    bodies: usize,
) -> Result<SceneRun, CaptureError> {
    let mut capture = OutfitCapture::new(template.clone(), OutfitCaptureConfig::default())?;
    let mut out = SceneRun::default();
    let share = 1.0 / scans.len().max(1) as f64;
    let mut first = None;
    for (k, truth) in scans.iter().enumerate() {
        let started = Instant::now();
        let file = mesh_of(truth);
        let (frame, start) = match &first {
            None => {
                let (frame, start) = find_frame(template, &file)?;
                (frame, Some(start))
            }
            Some((frame, _)) => (*frame, None),
        };
        if let Some(start) = start {
            capture.start_at(start);
        }
        let scan = BodyScan::new(&file, &frame)?;
        if k == 0 {
            for other in &scans[1..] {
                capture.add_shape_scan(BodyScan::new(&mesh_of(other), &frame)?);
            }
        }
        let captured = capture.frame(&scan)?;
        let ms = started.elapsed().as_secs_f64() * 1e3;
        if k == 0 {
            out.first_ms = ms;
        } else {
            out.later_ms += ms / (scans.len() - 1) as f64;
        }
        let labels = out.add(&scan, &captured, truth, share);
        if let Some(outfit) = capture.outfit() {
            out.add_garments(outfit, &captured, truth, &labels);
        }
        first.get_or_insert((frame, captured));
    }
    if let (Some((_, captured)), Some(outfit)) = (&first, capture.outfit()) {
        let mut dresser = BodyDresser::new(template.clone(), &outfit.cloth)?;
        out.retarget(&mut dresser, template, captured, bodies)?;
    }
    Ok(out)
}

fn mesh_of(scan: &TrueScan) -> ScanMesh {
    ScanMesh {
        points: scan.points.clone(),
        normals: scan.normals.clone(),
        colors: scan.colors.clone(),
        ..ScanMesh::default()
    }
}

impl SceneRun {
    fn add(
        &mut self,
        scan: &BodyScan,
        captured: &FrameCapture,
        truth: &TrueScan,
        share: f64,
    ) -> LabelScore {
        let rows = scan.rows(&captured.labels, 0);
        let labels = score_labels(&self.settings, &truth.points, &truth.labels, &rows);
        self.labels.f1 += share * labels.f1;
        self.labels.boundary += share * labels.boundary;
        self.surface += share * captured.report.alignment.surface_error;
        let (body, faces) = (&truth.body, &truth.body_faces);
        self.body += share * mean_distance(&captured.undressed.vertices, body, faces);
        labels
    }

    /// Garments of one scan beside the true ones.
    fn add_garments(
        &mut self,
        outfit: &CapturedOutfit,
        captured: &FrameCapture,
        truth: &TrueScan,
        labels: &LabelScore,
    ) {
        let numbers = outfit.labelling.parts();
        for (part, vertices) in outfit.cloth.parts.iter().zip(&captured.garments) {
            let Some(label) = labels.true_label(numbers[usize::from(part.label)]) else {
                continue;
            };
            let real = &truth.garments[usize::from(label) - 1];
            let hems = seen_hems(&self.settings, real, &truth.points, &truth.labels, label);
            let hem = distance_from_rings(&hems, &part.rings, vertices);
            let add = |mean: &mut Mean, all: &[P3], hidden: bool| {
                let some = all.iter().zip(&part.hidden);
                let some = some.filter(|(_, h)| **h == hidden).map(|(p, _)| *p);
                let some: Vec<P3> = some.collect();
                if !some.is_empty() {
                    let distance = mean_distance(&some, &real.vertices, &real.faces);
                    mean.add(distance, some.len());
                }
            };
            add(&mut self.garment, vertices, false);
            add(&mut self.hidden, vertices, true);
            self.hem.add(hem, hems.len());
        }
    }

    /// Onto its own body and onto others.
    fn retarget(
        &mut self,
        dresser: &mut BodyDresser<'_>,
        template: &Arc<Template>,
        captured: &FrameCapture,
        bodies: usize,
    ) -> Result<(), CaptureError> {
        let displacements = FrameDisplacements::of(template, captured);
        let body = &captured.undressed.body;
        let own = dresser.dress(
            &template.personalise(&body.shape),
            &displacements,
            &body.pose,
        )?;
        let pairs: Vec<(&Vec<P3>, &Vec<P3>)> =
            own.garments.iter().zip(&captured.garments).collect();
        self.own = pairs
            .iter()
            .map(|(a, b)| largest_distance(a, b))
            .fold(0.0, f64::max);
        let started = Instant::now();
        for shape in population(template, bodies, BODIES_SEED) {
            let other = template.personalise(&shape);
            let dressed = dresser.dress(&other, &displacements, &body.pose)?;
            self.inside += dressed.reports.iter().map(|r| r.inside).sum::<usize>();
        }
        let garments = (bodies * captured.garments.len()).max(1) as f64;
        self.dressed_ms = started.elapsed().as_secs_f64() * 1e3 / garments;
        Ok(())
    }
}
