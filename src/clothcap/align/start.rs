//! Start of an alignment: the tracker's poses in virtual depth images around the scan, without an A-pose.

use super::model_fit::{AlignedBody, ModelFit};
use crate::CaptureError;
use crate::cloud::mean_spacing;
use crate::scan::{BodyScan, ScanFrame, bounds};
use crate::settings::{AlignmentSettings, PersonSearchSettings};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;
use tryon_body::Template;
use tryon_formats::scan::ScanMesh;
use tryon_geometry::camera::{Intrinsics, RgbdFrame};
use tryon_geometry::math::P3;
use tryon_tracking::TrackerConfig;
use tryon_tracking::still::{StillSteps, VirtualCamera, find_still_person};

/// A start and its quality.
#[derive(Clone, Debug)]
pub struct Start {
    /// Pose and shape.
    pub body: AlignedBody,
    /// Mean robust distance of scan points from the body, metres.
    pub error: f64,
    /// Starts that were compared.
    pub compared: usize,
}

/// Finds unit, up axis and person of a scan file: of all frames in which it is as large as a person, the one that a body
/// explains best.
///
/// # Errors
/// [`CaptureError::NoPersonSize`], [`CaptureError::TooFewPoints`], [`CaptureError::NoPerson`].
pub fn find_frame(
    template: &Arc<Template>,
    file: &ScanMesh,
) -> Result<(ScanFrame, Start), CaptureError> {
    let settings = AlignmentSettings::default();
    let mut best: Option<(f64, ScanFrame, Start)> = None;
    let mut fault = None;
    for frame in ScanFrame::candidates(&file.points)? {
        let scan = BodyScan::new(file, &frame)?;
        match search_person(template, &scan, &settings) {
            Ok(start) => {
                let is_downward = frame.up.iter().any(|c| *c < -settings.search.upright);
                let price = match is_downward {
                    true => start.error * settings.search.downward,
                    false => start.error,
                };
                if best.as_ref().is_none_or(|b| price < b.0) {
                    best = Some((price, frame, start));
                }
                if price < settings.search.certain {
                    break;
                }
            }
            Err(e) => fault = fault.or(Some(e)),
        }
    }
    let best = best.map(|(_, frame, start)| (frame, start));
    let nobody = || CaptureError::NoPerson {
        why: "it has no upright frame".into(),
    };
    best.ok_or_else(|| fault.unwrap_or_else(nobody))
}

/// Finds the person in a scan from nothing: any upright pose, any direction.
///
/// # Errors
/// [`CaptureError::NoPerson`].
pub fn find_person(template: &Arc<Template>, scan: &BodyScan) -> Result<Start, CaptureError> {
    search_person(template, scan, &AlignmentSettings::default())
}

/// [`find_person`] with given settings.
pub(super) fn search_person(
    template: &Arc<Template>,
    scan: &BodyScan,
    all: &AlignmentSettings,
) -> Result<Start, CaptureError> {
    let settings = &all.search;
    let ends = bounds(&scan.points, settings.strays);
    let mut fit = ModelFit::new(template, scan, settings.samples, &all.model);
    let mut best: Option<Start> = None;
    let mut compared = 0;
    // One of four views sees the person within 45° of the front.
    for quarters in 0..4 {
        let camera = VirtualCamera::around(ends, f64::from(quarters) * FRAC_PI_2);
        let Some(mut body) = tracked(template, scan, &camera, settings) else {
            continue;
        };
        compared += 1;
        fit.run_all(&mut body, &settings.stages)?;
        let error = fit.error(&body);
        if best.as_ref().is_none_or(|b| error < b.error) {
            best = Some(Start {
                body,
                error,
                compared,
            });
        }
    }
    let why = |why: String| CaptureError::NoPerson { why };
    let mut best = best.ok_or_else(|| why("no view of it shows one to the tracker".into()))?;
    if !(best.error < settings.worst) {
        let mm = best.error * 1e3;
        return Err(why(format!("the best body lies {mm:.0} mm off it")));
    }
    best.compared = compared;
    Ok(best)
}

/// Pose and shape of the person in one view; `None` if nobody is seen there.
fn tracked(
    template: &Arc<Template>,
    scan: &BodyScan,
    camera: &VirtualCamera,
    settings: &PersonSearchSettings,
) -> Option<AlignedBody> {
    let config = TrackerConfig {
        skip_unchanged: false,
        displacements: false,
        ..TrackerConfig::default()
    };
    let steps = StillSteps {
        count: settings.steps,
        interval_ns: settings.interval_ns,
    };
    let frame = scan_frame(camera, scan, settings);
    let found = find_still_person(template, camera, &frame, config, steps).ok()??;
    Some(AlignedBody {
        pose: found.pose,
        shape: found.shape,
    })
}

pub(crate) fn scan_frame(
    camera: &VirtualCamera,
    scan: &BodyScan,
    settings: &PersonSearchSettings,
) -> RgbdFrame {
    let points = camera.view(&scan.points);
    // A cloud, or a mesh whose faces leave much of the surface between its points open.
    let is_torn = (scan.faces.len() as f64) < settings.torn * scan.points.len() as f64;
    camera.frame(&if is_torn {
        splat(&camera.calibration.depth, &points, settings)
    } else {
        camera.depth(&points, &scan.faces)
    })
}

/// Depth of each pixel of a cloud, metres, infinite beside it: each point is drawn as a square that faces the camera.
fn splat(camera: &Intrinsics, points: &[P3], settings: &PersonSearchSettings) -> Vec<f32> {
    let mut depth = vec![f32::INFINITY; (camera.width * camera.height) as usize];
    let side = settings.splat * mean_spacing(points);
    for p in points.iter().filter(|p| p.z > settings.nearest) {
        let q = camera.project(p);
        let half = (0.5 * side * camera.fx as f32 / p.z).max(0.5);
        let range = |middle: f32, size: u32| {
            let low = (middle - half).ceil().clamp(0.0, size as f32) as u32;
            let high = (middle + half).floor().clamp(-1.0, size as f32 - 1.0);
            low..(high + 1.0) as u32
        };
        for row in range(q.y, camera.height) {
            for column in range(q.x, camera.width) {
                let slot = &mut depth[(row * camera.width + column) as usize];
                *slot = slot.min(p.z);
            }
        }
    }
    depth
}
