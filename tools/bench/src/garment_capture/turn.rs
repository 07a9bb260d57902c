//! Garments from one depth camera before which a dressed subject turns around, against truth.

use super::scenes::{library_outfit, shaped_actor};
use super::score::{mean_distance, score_labels};
use super::settings::CaptureBenchSettings;
use crate::scans::{DepthCamera, FilmedFrame, ScanMotion, ScanScene, ScannerSetting, TrueScan};
use crate::{EvaluateError, Row};
use std::f64::consts::TAU;
use std::time::Instant;
use tryon_body::embedded;
use tryon_clothcap::turn::{FusedTurn, KeyFrames, TurnConfig, TurnError, TurnTracker, fuse};
use tryon_clothcap::{FrameCapture, OutfitCapture, OutfitCaptureConfig};
use tryon_geometry::math::{P3, Rigid, World};
use tryon_geometry::mesh::Face;
use tryon_geometry::spatial::PointTree;
use tryon_synth::Routine;

/// Named turn.
#[derive(Clone, Debug)]
pub struct TurnScene {
    /// Name in the table.
    pub name: String,
    /// Subject, outfit and motion.
    pub scene: ScanScene,
    /// Camera.
    pub camera: DepthCamera,
    /// Kept apart from development.
    pub is_unseen: bool,
}

/// One scene: name, garments with their layers, shape coefficients, routine with its start.
type TurnSpec = (
    &'static str,
    &'static [(&'static str, u8)],
    &'static [f64],
    (Routine, f64),
);

/// Arms half raised in the calibration pose, or hanging.
const RAISED: (Routine, f64) = (Routine::Still, 0.0);
/// See [`RAISED`]. The routine's own yaw to both sides is added to the turn.
const HANGING: (Routine, f64) = (Routine::Turn, 1.8);

/// Outfits on bodies of several shapes; every third is unseen.
#[rustfmt::skip]
const SCENES: [TurnSpec; 6] = [
    ("turn: tshirt and trousers", &[("trousers", 0), ("tshirt", 1)], &[0.0], RAISED),
    ("turn: long sleeves tucked", &[("longsleeve", 0), ("trousers", 1)], &[1.0, -0.5, 1.0], HANGING),
    ("turn: hooded top and shorts", &[("shorts", 0), ("hoodie", 1)], &[1.2, -1.0, 0.0], RAISED),
    ("turn: heavy", &[("trousers", 0), ("tshirt", 1)], &[0.0, 2.0, 0.5], HANGING),
    ("turn: sleeves over trousers", &[("trousers", 0), ("longsleeve", 1)], &[0.0, 0.5, 1.0], RAISED),
    ("turn: vest over sleeves", &[("longsleeve", 0), ("trousers", 1), ("tank", 2)], &[0.5, 0.0, 1.0], HANGING),
];

/// Scenes of the bench.
///
/// # Errors
/// A garment that the library lacks.
pub fn turn_scenes() -> Result<Vec<TurnScene>, EvaluateError> {
    let settings = CaptureBenchSettings::default();
    let scene = |(k, spec): (usize, &TurnSpec)| -> Result<TurnScene, EvaluateError> {
        let (name, outfit, shape, (routine, start)) = spec;
        Ok(TurnScene {
            name: (*name).into(),
            scene: ScanScene {
                actor: shaped_actor(shape, k),
                garments: library_outfit(outfit)?,
                motion: ScanMotion::Turn {
                    routine: *routine,
                    start: *start,
                    delay: settings.standing as f64 / settings.film_rate,
                    speed: settings.turns * TAU * settings.film_rate
                        / (settings.frames - settings.standing) as f64,
                },
                scanner: ScannerSetting {
                    points: settings.film_points,
                    ..ScannerSetting::default()
                },
                scans: settings.frames,
                rate: settings.film_rate,
                edge: settings.edge,
                seed: 200 + k as u64,
                ..ScanScene::default()
            },
            camera: DepthCamera::default(),
            is_unseen: k % 3 == 2,
        })
    };
    SCENES.iter().enumerate().map(scene).collect()
}

/// Frames of a scene.
struct TurnFilm {
    name: String,
    camera: DepthCamera,
    frames: Vec<FilmedFrame>,
}

impl TurnFilm {
    /// Films a scene.
    fn shoot(scene: &TurnScene) -> Result<Self, EvaluateError> {
        let mut frames = Vec::new();
        let settings = CaptureBenchSettings::default();
        let step = settings.step();
        let is_frontal = |k: usize| {
            let yaw = (k.saturating_sub(settings.standing) as f64 * step).rem_euclid(TAU);
            yaw.min(TAU - yaw) < settings.frontal
        };
        scene.scene.film(&scene.camera, is_frontal, |frame| {
            frames.push(frame);
            Ok(())
        })?;
        Ok(Self {
            name: scene.name.clone(),
            camera: scene.camera.clone(),
            frames,
        })
    }

    /// Tracks the subject.
    fn track(&self) -> Result<KeyFrames, TurnError> {
        let mut tracker = TurnTracker::new(embedded::template(), self.camera.calibration());
        for frame in &self.frames {
            tracker.step(&frame.frame)?;
        }
        tracker.finish()
    }
}

/// Films, tracks and captures a scene from the tracked poses and from the registered ones: a row each.
///
/// # Errors
/// Scenes that cannot be made, or in which nobody is tracked.
pub fn measure_turn_scene(scene: &TurnScene) -> Result<Vec<Row>, EvaluateError> {
    let film = TurnFilm::shoot(scene)?;
    let keys = film
        .track()
        .map_err(|e| EvaluateError::new(&scene.name, e))?;
    let whole = TurnConfig::default();
    let tracked = TurnConfig {
        iterations: 0,
        ..whole
    };
    let methods = [("tracked poses", tracked), ("registered", whole)];
    Ok(methods
        .iter()
        .map(|(name, config)| measure_turn(&film, &keys, name, config))
        .collect())
}

/// Captures the garments of a tracked film and compares them with their truth in the reference frame: one row. A capture that fails
/// is a row with its reason as parameter.
fn measure_turn(
    film: &TurnFilm,
    keys: &KeyFrames,
    method: &'static str,
    config: &TurnConfig,
) -> Row {
    let started = Instant::now();
    let result = capture(keys, config);
    let ms = started.elapsed().as_secs_f64() * 1e3;
    let row = Row::new(&film.name, method, ms).with("frames", film.frames.len());
    match result {
        Ok((fused, captured)) => score(film, &fused, &captured, row),
        Err(e) => row.with("fault", e),
    }
}

fn capture(keys: &KeyFrames, config: &TurnConfig) -> Result<(FusedTurn, FrameCapture), TurnError> {
    let template = embedded::template();
    let fused = fuse(&template, keys, config)?;
    let mut capture = OutfitCapture::new(template, OutfitCaptureConfig::default())?;
    capture.start_at(fused.start.clone());
    let captured = capture.frame(&fused.scan)?;
    Ok((fused, captured))
}

fn score(film: &TurnFilm, fused: &FusedTurn, captured: &FrameCapture, row: Row) -> Row {
    let truth = &film.frames[fused.report.reference].truth;
    let to_truth: Rigid<World, World> =
        film.camera.world_from_camera * fused.world_from_camera.inverse();
    let moved = |points: &[P3]| {
        let mut out = Vec::new();
        to_truth.points_f32(points, &mut out);
        out
    };
    let points = moved(&fused.scan.points);
    let settings = CaptureBenchSettings::default();
    let labels = labels_at(truth, &points, &captured.labels, settings.reach);
    let judged = score_labels(&settings, &truth.points, &truth.labels, &labels);
    let (mut sum, mut count) = (0.0, 0.0);
    for (k, vertices) in captured.garments.iter().enumerate() {
        let Some(label) = judged.true_label(k as u8 + 1) else {
            continue;
        };
        let real = &truth.garments[usize::from(label) - 1];
        let n = vertices.len() as f64;
        sum += mean_distance(&moved(vertices), &real.vertices, &real.faces) * n;
        count += n;
    }
    let template = embedded::template();
    let body = moved(&captured.undressed.vertices);
    let body = mean_distance(&body, &truth.body, template.mesh().faces());
    let (surface, faces) = whole_surface(truth, template.mesh().faces());
    row.with("points", points.len())
        .with("used", fused.report.used.len())
        .with("coverage", fused.report.yaw_coverage_degrees.round())
        .error("F1", judged.f1)
        .error("boundary_mm", 1e3 * judged.boundary)
        .error("scan_mm", 1e3 * mean_distance(&points, &surface, &faces))
        .error("garment_mm", 1e3 * sum / f64::max(count, 1.0))
        .error("body_mm", 1e3 * body)
}

/// Found label at each true scan point: that of the nearest fused point, skin without one.
fn labels_at(truth: &TrueScan, points: &[P3], labels: &[u8], reach: f32) -> Vec<u8> {
    let tree = PointTree::new(points);
    let at = |p: &P3| tree.nearest(p, reach).map_or(0, |(i, _)| labels[i]);
    truth.points.iter().map(at).collect()
}

/// Body and garments as one mesh, world, metres.
fn whole_surface(truth: &TrueScan, body: &[Face]) -> (Vec<P3>, Vec<Face>) {
    let (mut vertices, mut faces) = (truth.body.clone(), body.to_vec());
    for garment in &truth.garments {
        let first = vertices.len() as u32;
        vertices.extend_from_slice(&garment.vertices);
        faces.extend(garment.faces.iter().map(|f| f.map(|v| v + first)));
    }
    (vertices, faces)
}
