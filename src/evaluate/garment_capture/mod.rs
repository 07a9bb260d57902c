//! Garment capture against truth: labels, boundaries, surfaces, the body below, other bodies; run time against error.

mod made_scenes;
mod scenes;
mod score;
mod turn;

pub use made_scenes::{MadeScenes, made_scenes};
pub use scenes::{CaptureScene, capture_scenes};
pub use turn::{TurnFilm, TurnScene, measure_turn, measure_turn_scene, turn_scenes};

use super::scans::TrueScan;
use super::{EvaluateError, Row};
use crate::body::{Template, embedded};
use crate::clothcap::align::find_frame;
use crate::clothcap::archive::FrameDisplacements;
use crate::clothcap::scan::BodyScan;
use crate::clothcap::segment::LabelConfig;
use crate::clothcap::{
    BodyDresser, CaptureConfig, CaptureError, FrameCapture, OutfitCapture, population,
};
use crate::formats::scan::ScanMesh;
use crate::math::P3;
use score::{LabelScore, largest_distance, mean_distance, score_labels};
use std::sync::Arc;
use std::time::Instant;

/// Seed of the bodies that garments are retargeted to.
const BODIES_SEED: u64 = 11;

/// Variant of the method, for ablation.
#[derive(Clone, Debug, PartialEq)]
pub struct CaptureVariant {
    /// Name in the table.
    pub name: &'static str,
    /// Settings.
    pub config: CaptureConfig,
}

impl CaptureVariant {
    /// The method as it ships, and without each of its parts.
    pub fn all() -> Vec<Self> {
        let with = |name, labels| Self {
            name,
            config: CaptureConfig {
                labels,
                ..CaptureConfig::default()
            },
        };
        let whole = LabelConfig::default;
        vec![
            with("whole", whole()),
            with(
                "without prior",
                LabelConfig {
                    without_prior: true,
                    ..whole()
                },
            ),
            with(
                "without smoothness",
                LabelConfig {
                    without_smoothness: true,
                    ..whole()
                },
            ),
        ]
    }
}

/// Captures the scans of a scene and compares with their truth: one row.
///
/// # Errors
/// Scenes that cannot be made. A capture that fails is a row without errors and with its reason as parameter.
pub fn measure(
    scene: &CaptureScene,
    variant: &CaptureVariant,
    bodies: usize,
) -> Result<Row, EvaluateError> {
    let scans = scene.scene.scans()?;
    let template = embedded::template();
    let row = |ms| Row::new(&scene.name, variant.name, ms).with("scans", scans.len());
    match run(&template, &scans, variant, bodies) {
        Ok(run) => Ok(run.row(row(run.first_ms))),
        Err(e) => Ok(row(0.0).with("fault", e)),
    }
}

/// Means over the scans of a scene.
#[derive(Debug, Default)]
struct SceneRun {
    labels: LabelScore,
    surface: f64,
    garment: f64,
    body: f64,
    own: f64,
    inside: usize,
    dressed_ms: f64,
    first_ms: f64,
    later_ms: f64,
}

impl SceneRun {
    fn row(&self, row: Row) -> Row {
        row.error("F1", self.labels.f1)
            .error("boundary_mm", 1e3 * self.labels.boundary)
            .error("surface_mm", 1e3 * self.surface)
            .error("garment_mm", 1e3 * self.garment)
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
    variant: &CaptureVariant,
    bodies: usize,
) -> Result<SceneRun, CaptureError> {
    let mut capture = OutfitCapture::new(template.clone(), variant.config.clone())?;
    let mut out = SceneRun::default();
    let share = 1.0 / scans.len().max(1) as f64;
    let mut first = None;
    for (k, truth) in scans.iter().enumerate() {
        let started = Instant::now();
        let file = ScanMesh {
            points: truth.points.clone(),
            faces: truth.faces.clone(),
            normals: truth.normals.clone(),
            colors: truth.colors.clone(),
        };
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
        let captured = capture.frame(&scan)?;
        let ms = started.elapsed().as_secs_f64() * 1e3;
        if k == 0 {
            out.first_ms = ms;
        } else {
            out.later_ms += ms / (scans.len() - 1) as f64;
        }
        out.add((&scan, &captured), truth, share);
        first.get_or_insert((frame, captured));
    }
    if let (Some((_, captured)), Some(outfit)) = (&first, capture.outfit()) {
        let mut dresser = BodyDresser::new(template.clone(), &outfit.cloth)?;
        out.retarget(&mut dresser, (template, captured), bodies)?;
    }
    Ok(out)
}

impl SceneRun {
    fn add(&mut self, (scan, captured): (&BodyScan, &FrameCapture), truth: &TrueScan, share: f64) {
        let rows = scan.rows(&captured.labels, 0);
        let labels = score_labels(&truth.points, &truth.labels, &rows);
        self.labels.f1 += share * labels.f1;
        self.labels.boundary += share * labels.boundary;
        self.surface += share * captured.report.alignment.surface_error;
        let (body, faces) = (&truth.body, &truth.body_faces);
        self.body += share * mean_distance(&captured.undressed.vertices, body, faces);
        let mut garment = (0.0, 0.0);
        for (k, vertices) in captured.garments.iter().enumerate() {
            let Some(label) = labels.true_label(k as u8 + 1) else {
                continue;
            };
            let real = &truth.garments[usize::from(label) - 1];
            garment.0 +=
                mean_distance(vertices, &real.vertices, &real.faces) * vertices.len() as f64;
            garment.1 += vertices.len() as f64;
        }
        self.garment += share * garment.0 / garment.1.max(1.0);
    }

    /// Onto its own body and onto others.
    fn retarget(
        &mut self,
        dresser: &mut BodyDresser<'_>,
        (template, captured): (&Arc<Template>, &FrameCapture),
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
