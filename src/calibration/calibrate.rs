//! Extrinsics of a recording: the empty scene, then the person before it, then the estimate.

use super::deviation::Deviations;
use super::error::ExtrinsicsError;
use super::evidence::WalkEvidence;
use super::settings::ExtrinsicsSettings;
use super::solve::{Solution, solve};
use super::survey::{CameraPair, EmptyScene, SceneSurvey};
use tryon_formats::RgbdSource;
use tryon_geometry::camera::{Calibration, ColorImage, RgbdFrame};
use tryon_geometry::math::{Camera, ColorCamera, Rigid};

/// Estimated extrinsics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extrinsics {
    /// From the depth camera to the colour camera.
    pub color_from_depth: Rigid<ColorCamera, Camera>,
    /// Time to add to colour's stamps for the clock of depth (s).
    pub color_time_offset_s: f64,
    /// Standard deviations.
    pub deviations: Deviations,
    /// Standard deviation of a residual (pixels of colour at full size).
    pub residual: f64,
    /// Share of the outline that was met in colour.
    pub met: f64,
    /// Frames compared.
    pub frames: usize,
    /// Frames that could not be read, or have not the sizes of their cameras.
    pub unreadable: usize,
}

/// Estimates the extrinsics of a recording of somebody who walks, from those that it states. Reads the recording twice;
/// memory holds the frames of the empty scene and a byte for each colour pixel compared (about 200 MB).
///
/// # Errors
/// A recording that does not determine them, in words: see [`ExtrinsicsError`].
pub fn calibrate(
    source: &mut dyn RgbdSource,
    settings: &ExtrinsicsSettings,
) -> Result<Extrinsics, ExtrinsicsError> {
    let cameras = CameraPair::new(source.calibration(), settings)?;

    let mut survey = SceneSurvey::new(&cameras, settings);
    let unreadable = for_each_frame(source, |frame, _| survey.add(frame))?;
    let total = survey.frames();
    let scene = survey.finish()?;

    let evidence = gather(source, &cameras, &scene, total, settings)?;
    let (with_person, least) = (evidence.outlines.len(), settings.least_frames);
    if with_person < least {
        return Err(ExtrinsicsError::Nobody {
            with_person,
            frames: evidence.frames,
            least,
        });
    }

    let solution = solve(&evidence, &cameras.start, settings);
    let deviations = Deviations::new(&solution, &evidence, settings);
    judge(&solution, &deviations, settings)?;
    Ok(Extrinsics {
        color_from_depth: Rigid::new(solution.unknowns.color_from_depth),
        color_time_offset_s: solution.unknowns.time_offset,
        deviations,
        residual: solution.scale * f64::from(cameras.factor),
        met: solution.met,
        frames: evidence.frames,
        unreadable,
    })
}

/// Calls `take` with every readable frame of the cameras' sizes and the time of its colour (ns); counts the others.
fn for_each_frame(
    source: &mut dyn RgbdSource,
    mut take: impl FnMut(RgbdFrame, u64),
) -> Result<usize, ExtrinsicsError> {
    let calibration = source.calibration().clone();
    let mut unreadable = 0;
    source.rewind()?;
    loop {
        match source.next_frame() {
            Ok(None) => return Ok(unreadable),
            Ok(Some(frame)) if has_sizes(&frame, &calibration) => {
                let color_time = source.color_time_ns().unwrap_or(frame.time_ns);
                take(frame, color_time);
            }
            Ok(Some(_)) | Err(_) => unreadable += 1,
        }
    }
}

/// True if the images have the sizes of their cameras.
fn has_sizes(frame: &RgbdFrame, calibration: &Calibration) -> bool {
    let k = &calibration.depth;
    let color = calibration.color.as_ref().unwrap_or(k);
    let depth = &frame.depth;
    let is_color = |c: &ColorImage| (c.width(), c.height()) == (color.width, color.height);
    (depth.width(), depth.height()) == (k.width, k.height)
        && frame.color.as_ref().is_none_or(is_color)
}

/// Compared frames: all, or bursts spread over the recording.
fn gather(
    source: &mut dyn RgbdSource,
    cameras: &CameraPair,
    scene: &EmptyScene,
    total: usize,
    settings: &ExtrinsicsSettings,
) -> Result<WalkEvidence, ExtrinsicsError> {
    let bursts = (settings.frames / settings.burst.max(1)).max(1);
    let period = total.div_ceil(bursts).max(settings.burst);
    let is_all = total <= settings.frames;
    let mut evidence = WalkEvidence::new(cameras);
    let mut number = 0;
    for_each_frame(source, |frame, color_time| {
        if is_all || number % period < settings.burst {
            evidence.add(&frame, color_time, cameras, scene, settings);
        }
        number += usize::from(frame.color.is_some());
    })?;
    evidence.finish();
    Ok(evidence)
}

/// Refuses an estimate that the recording does not support.
fn judge(
    solution: &Solution,
    deviations: &Deviations,
    settings: &ExtrinsicsSettings,
) -> Result<(), ExtrinsicsError> {
    if !(solution.met >= settings.least_met) {
        return Err(ExtrinsicsError::NotMet {
            share: 100.0 * solution.met,
            least: 100.0 * settings.least_met,
        });
    }
    if !(solution.scale <= settings.most_residual) {
        return Err(ExtrinsicsError::Unlike {
            residual: solution.scale,
            most: settings.most_residual,
        });
    }
    match deviations.unobservable(settings.most_deviation) {
        Some((axis, deviation, most)) => Err(ExtrinsicsError::Unobservable {
            axis,
            deviation,
            most,
        }),
        None => Ok(()),
    }
}
