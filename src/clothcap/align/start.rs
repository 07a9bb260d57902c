//! Start of an alignment: the tracker's poses in virtual depth images around the scan, without an A-pose.

use super::model_fit::{AlignedBody, FitStage, ModelFit};
use crate::CaptureError;
use crate::scan::{BodyScan, ScanFrame};
use crate::virtual_camera::{bounds, scan_frame};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;
use tryon_body::Template;
use tryon_formats::scan::ScanMesh;
use tryon_tracking::TrackerConfig;
use tryon_tracking::still::{StillSteps, VirtualCamera, find_still_person};

/// Virtual cameras around the scan. With four, one sees the person within 45° of the front.
const VIEWS: usize = 4;
/// Steps of the tracker on one view.
const STEPS: StillSteps = StillSteps {
    count: 3,
    interval_ns: 33_000_000,
};
/// Scan points in the comparison of starts.
const SAMPLES: usize = 1500;
/// Mean robust distance above which a start explains no person, metres. Right starts had 16 to 27 mm.
const WORST: f64 = 0.05;

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

/// Mean robust distance below which a unit and up axis is taken without trying others, metres.
const CERTAIN: f64 = 0.035;

/// Finds unit, up axis and person of a scan file: of all frames in which it is as large as a person, the one that a body
/// explains best.
///
/// # Errors
/// [`CaptureError::NoPersonSize`], [`CaptureError::TooFewPoints`], [`CaptureError::NoPerson`].
pub fn find_frame(
    template: &Arc<Template>,
    file: &ScanMesh,
) -> Result<(ScanFrame, Start), CaptureError> {
    let mut best: Option<(ScanFrame, Start)> = None;
    let mut fault = None;
    for frame in ScanFrame::candidates(&file.points)? {
        let scan = BodyScan::new(file, &frame)?;
        match find_person(template, &scan) {
            Ok(start) if best.as_ref().is_none_or(|b| start.error < b.1.error) => {
                let is_certain = start.error < CERTAIN;
                best = Some((frame, start));
                if is_certain {
                    break;
                }
            }
            Ok(_) => {}
            Err(e) => fault = fault.or(Some(e)),
        }
    }
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
    let ends = bounds(&scan.points);
    let mut fit = ModelFit::new(template, scan, SAMPLES);
    let mut best: Option<Start> = None;
    let mut compared = 0;
    for view in 0..VIEWS {
        let camera = VirtualCamera::around(ends, view as f64 * FRAC_PI_2);
        let Some(start) = tracked(template, scan, &camera) else {
            continue;
        };
        compared += 1;
        let mut body = start;
        for stage in FitStage::START {
            fit.run(&mut body, &stage)?;
        }
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
    if !(best.error < WORST) {
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
) -> Option<AlignedBody> {
    let config = TrackerConfig {
        skip_unchanged: false,
        displacements: false,
        ..TrackerConfig::default()
    };
    let frame = scan_frame(camera, scan);
    let found = find_still_person(template, camera, &frame, config, STEPS).ok()??;
    Some(AlignedBody {
        pose: found.pose,
        shape: found.shape,
    })
}
