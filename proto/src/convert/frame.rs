//! Exposures on the bus.

use super::{WireError, codec, geometry, required};
use crate::v1;
use bytes::Bytes;
use std::sync::Arc;
use std::time::Instant;
use tryon_geometry::camera::{Calibration, RgbdFrame};

/// One exposure with its calibration and stage times.
#[derive(Clone, Debug)]
pub struct Exposure {
    /// Epoch, sequence, times of capture and reception.
    pub id: v1::FrameId,
    /// Calibration of its camera.
    pub calibration: Arc<Calibration>,
    /// Images; sequence and time are those of `id`.
    pub rgbd: RgbdFrame,
    /// Times of the stages so far.
    pub stages: Vec<v1::StageTime>,
}

/// Milliseconds since `start`, as a stage time.
pub fn stage(name: &str, start: Instant) -> v1::StageTime {
    v1::StageTime {
        stage: name.into(),
        ms: start.elapsed().as_secs_f32() * 1e3,
    }
}

/// Compresses an exposure for the bus (about 5 ms at 640×480: call it on the compute pool).
///
/// # Errors
/// Images too large for their formats.
pub fn exposure_to_wire(e: &Exposure) -> Result<v1::RgbdFrame, WireError> {
    let start = Instant::now();
    let depth = codec::depth_to_wire(&e.rgbd.depth);
    let color_jpeg = e
        .rgbd
        .color
        .as_ref()
        .map_or_else(|| Ok(Bytes::new()), codec::color_to_wire)?;
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

/// Most stages of a message; a chain has about twenty.
const MAX_STAGES: usize = 64;

/// Stage times, finite and at most 64.
///
/// # Errors
/// Names the list.
pub fn stages_from_wire(
    stages: &[v1::StageTime],
    field: &str,
) -> Result<Vec<v1::StageTime>, WireError> {
    if stages.len() > MAX_STAGES {
        return Err(WireError::new(
            field,
            format!("{} stages, at most {MAX_STAGES}", stages.len()),
        ));
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
    let color = if m.color_jpeg.is_empty() {
        None
    } else {
        Some(codec::color(&m.color_jpeg, of_color)?)
    };
    let mut stages = stages_from_wire(&m.stages, "rgbd_frame.stages")?;
    stages.push(stage("bus.decode", start));
    Ok(Exposure {
        id,
        calibration: Arc::new(calibration),
        rgbd: RgbdFrame {
            sequence: id.sequence,
            time_ns: id.capture_time_ns,
            depth,
            color,
        },
        stages,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use prost::Message;
    use tryon_geometry::camera::{ColorImage, DepthImage, Intrinsics};

    fn exposure() -> Exposure {
        let k = Intrinsics::KINECT_V1.resized(64, 48);
        let depth = DepthImage::new(
            64,
            48,
            (0..64 * 48).map(|i| 1000 + (i % 37) as u16).collect(),
        )
        .expect("fits");
        let id = v1::FrameId {
            epoch: 7,
            sequence: 3,
            capture_time_ns: 5,
            received_unix_ns: 9,
            trace: 11,
        };
        let color = Some(ColorImage::filled(64, 48, [10, 200, 90]));
        Exposure {
            id,
            calibration: Arc::new(Calibration::registered(k)),
            rgbd: RgbdFrame {
                sequence: 3,
                time_ns: 5,
                depth,
                color,
            },
            stages: vec![],
        }
    }

    #[test]
    fn exposures_round_trip_and_depth_is_lossless() {
        let e = exposure();
        let back = exposure_from_wire(&exposure_to_wire(&e).expect("packs")).expect("unpacks");
        assert_eq!((back.id, &back.calibration), (e.id, &e.calibration));
        assert_eq!(back.rgbd.depth, e.rgbd.depth);
        let (a, b) = (
            back.rgbd.color.expect("colour"),
            e.rgbd.color.expect("colour"),
        );
        assert!(
            a.data()
                .iter()
                .zip(b.data())
                .all(|(a, b)| a.abs_diff(*b) < 8)
        );
        assert!(back.stages.iter().any(|s| s.stage == "capture.encode"));
    }

    #[test]
    fn faults_name_their_field() {
        let fault = |change: &dyn Fn(&mut v1::RgbdFrame)| {
            let mut w = exposure_to_wire(&exposure()).expect("packs");
            change(&mut w);
            exposure_from_wire(&w).expect_err("must be refused").field
        };
        assert_eq!(fault(&|w| w.id = None), "rgbd_frame.id");
        assert_eq!(fault(&|w| w.calibration = None), "rgbd_frame.calibration");
        assert_eq!(
            fault(&|w| w.depth = w.depth.slice(..w.depth.len() / 2)),
            "rgbd_frame.depth"
        );
        assert_eq!(
            fault(&|w| w.color_jpeg = w.color_jpeg.slice(..20)),
            "rgbd_frame.color_jpeg"
        );
        let k = |w: &mut v1::RgbdFrame, f: &dyn Fn(&mut v1::Intrinsics)| {
            f(w.calibration
                .as_mut()
                .and_then(|c| c.depth.as_mut())
                .expect("there"));
        };
        assert_eq!(
            fault(&|w| k(w, &|k| k.fx = f64::NAN)),
            "rgbd_frame.calibration.depth.fx"
        );
        assert_eq!(
            fault(&|w| k(w, &|k| k.width = u32::MAX)),
            "rgbd_frame.calibration.depth.width"
        );
        // A valid size of a camera that is not the size of the images.
        assert_eq!(fault(&|w| k(w, &|k| k.width = 65)), "rgbd_frame.depth");
        assert_eq!(
            fault(&|w| w.stages = vec![v1::StageTime::default(); 100]),
            "rgbd_frame.stages"
        );
    }

    #[test]
    fn broken_messages_are_errors_never_panics() {
        let good = exposure_to_wire(&exposure())
            .expect("packs")
            .encode_to_vec();
        let read = |b: &[u8]| {
            let m = v1::RgbdFrame::decode(b)
                .map_err(|e| WireError::new("rgbd_frame", e.to_string()))?;
            exposure_from_wire(&m)
        };
        read(&good).expect("untouched, it is fine");
        // Cut between two of the last fields, a message is valid with fewer fields; cut elsewhere it is broken.
        let whole = (0..good.len())
            .filter(|n| read(&good[..*n]).is_ok())
            .count();
        assert!(whole <= 2, "{whole} cuts went unnoticed");
        // A depth field that announces 4 GiB.
        assert!(read(&[0x1a, 0xff, 0xff, 0xff, 0xff, 0x0f, 1, 2, 3]).is_err());
        // Every byte flipped in a fixed sequence: refused or read, never a panic.
        let mut x = 0x9e37_79b9_u32;
        for i in 0..good.len() {
            let mut bad = good.clone();
            x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            bad[i] ^= (x >> 24) as u8 | 1;
            let _ = read(&bad);
        }
    }
}
