//! Exposures.

use super::{WireError, codec, geometry, required};
use crate::v1;
use bytes::Bytes;
use std::sync::Arc;
use std::time::Instant;
use tryon::camera::{Calibration, RgbdFrame};

/// One exposure with everything that travels beside it.
#[derive(Clone, Debug)]
pub struct Exposure {
    /// Epoch, sequence, capture time and when it was received.
    pub id: v1::FrameId,
    /// The camera it came from.
    pub calibration: Arc<Calibration>,
    /// The images; its sequence and time are those of `id`.
    pub rgbd: RgbdFrame,
    /// What was spent on it so far.
    pub stages: Vec<v1::StageTime>,
}

/// Milliseconds since `start`, as a stage time.
pub fn stage(name: &str, start: Instant) -> v1::StageTime {
    v1::StageTime { stage: name.into(), ms: start.elapsed().as_secs_f32() * 1e3 }
}

/// Compresses an exposure for the bus (about 5 ms at 640×480: call it on the compute pool).
///
/// # Errors
/// Images too large for their formats.
pub fn exposure_to_wire(e: &Exposure) -> Result<v1::RgbdFrame, WireError> {
    let start = Instant::now();
    let depth = codec::depth_to_wire(&e.rgbd.depth);
    let color_jpeg = e.rgbd.color.as_ref().map_or_else(|| Ok(Bytes::new()), codec::color_to_wire)?;
    let mut stages = e.stages.clone();
    stages.push(stage("capture.encode", start));
    Ok(v1::RgbdFrame {
        id: Some(e.id),
        calibration: Some(geometry::calibration_to_wire(&e.calibration)),
        depth,
        color_jpeg,
        stages,
    })
}

/// Most stages a message may carry: a chain has about twenty.
const MAX_STAGES: usize = 64;

/// Stage times that are finite and few.
///
/// # Errors
/// Names the list.
pub fn stages_from_wire(stages: &[v1::StageTime], field: &str) -> Result<Vec<v1::StageTime>, WireError> {
    if stages.len() > MAX_STAGES {
        return Err(WireError::new(field, format!("{} stages, at most {MAX_STAGES}", stages.len())));
    }
    if stages.iter().any(|s| !s.ms.is_finite()) {
        return Err(WireError::new(field, "a time is not finite"));
    }
    Ok(stages.to_vec())
}

/// Unpacks and checks an exposure (about 3 ms at 640×480: call it on the compute pool).
///
/// # Errors
/// Names the field that is absent, broken or of another size than the calibration says.
pub fn exposure_from_wire(m: &v1::RgbdFrame) -> Result<Exposure, WireError> {
    let start = Instant::now();
    let id = required(m.id, "rgbd_frame.id")?;
    let wire = required(m.calibration.as_ref(), "rgbd_frame.calibration")?;
    let calibration = geometry::calibration_from_wire(wire).map_err(|e| e.within("rgbd_frame"))?;
    let depth = codec::depth(&m.depth, &calibration.depth)?;
    let of_color = calibration.color.as_ref().unwrap_or(&calibration.depth);
    let color = if m.color_jpeg.is_empty() { None } else { Some(codec::color(&m.color_jpeg, of_color)?) };
    let mut stages = stages_from_wire(&m.stages, "rgbd_frame.stages")?;
    stages.push(stage("bus.decode", start));
    Ok(Exposure {
        id,
        calibration: Arc::new(calibration),
        rgbd: RgbdFrame { sequence: id.sequence, time_ns: id.capture_time_ns, depth, color },
        stages,
    })
}
