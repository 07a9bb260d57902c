//! Fields of requests: names, ids, sizes, garment choices.

use super::WireError;
use super::garment::MAX_GARMENTS;
use crate::keys::{CameraKey, is_name, is_session_id};
use crate::v1;
use std::time::Duration;

/// Session id.
///
/// # Errors
/// An id that is empty, too long or has other characters than `[A-Za-z0-9_-]`.
pub fn session_id(field: &str, id: &str) -> Result<String, WireError> {
    if is_session_id(id) {
        return Ok(id.into());
    }
    Err(WireError::new(
        field,
        "1 to 64 characters of [A-Za-z0-9_-] are needed",
    ))
}

/// Bus keys of a camera.
///
/// # Errors
/// Names the part at fault, `<message>.store` or `<message>.camera`.
pub fn camera_key(message: &str, store: &str, camera: &str) -> Result<CameraKey, WireError> {
    let why = "1 to 64 characters of [a-z0-9_-] are needed";
    CameraKey::new(store, camera).ok_or_else(|| {
        let field = if is_name(store) { "camera" } else { "store" };
        WireError::new(format!("{message}.{field}"), why)
    })
}

/// Garment choices: their number, names and colours. The cloth service checks them against its library.
///
/// # Errors
/// Names the choice at fault.
pub fn choices(
    message: &str,
    garments: &[v1::GarmentChoice],
) -> Result<Vec<v1::GarmentChoice>, WireError> {
    if garments.len() > MAX_GARMENTS {
        let why = format!("{} garments, at most {MAX_GARMENTS}", garments.len());
        return Err(WireError::new(format!("{message}.garments"), why));
    }
    for (i, g) in garments.iter().enumerate() {
        let fault =
            |f: &str, why: &str| Err(WireError::new(format!("{message}.garments[{i}].{f}"), why));
        if !is_name(&g.garment) {
            return fault("garment", "1 to 64 characters of [a-z0-9_-] are needed");
        }
        if g.size.len() > 16 || !g.size.bytes().all(|b| b.is_ascii_alphanumeric()) {
            return fault("size", "at most 16 letters and digits");
        }
        if g.color_rgb.is_some_and(|c| c > 0xff_ff_ff) {
            return fault("color_rgb", "0xRRGGBB, so at most 16777215");
        }
        let print = format!("{message}.garments[{i}].print");
        super::print::check(&print, g.print.as_ref())?;
    }
    Ok(garments.to_vec())
}

/// Picture format of a viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureFormat {
    /// Pixels; `None` means the camera's size.
    pub size: Option<(u32, u32)>,
    /// Fills `size`, cropped around the person; otherwise everything is shown, black beside it.
    pub is_cropped: bool,
    /// JPEG quality, 1 to 100.
    pub quality: u8,
    /// Time between two pictures; zero means no limit.
    pub interval: Duration,
    /// Most messages on the way to a reader that acknowledges them.
    pub window: Option<u32>,
}

/// Largest [`PictureFormat::window`]: half a second at 30 Hz.
const MAX_WINDOW: u32 = 16;

/// Lowest and highest rate of a viewer (Hz). Lower is a snapshot now and then, higher is more than any camera gives.
const RATES: std::ops::RangeInclusive<f32> = 0.01..=1000.0;

/// Size, codec, quality, rate and window of a picture stream.
///
/// # Errors
/// Names the field out of range.
pub fn picture_format(r: &v1::StreamFramesRequest) -> Result<PictureFormat, WireError> {
    let fault = |f: &str, why: &str| Err(WireError::new(format!("stream_frames_request.{f}"), why));
    let side = 16..=4096;
    let size = match (r.width, r.height) {
        (0, 0) => None,
        (w, _) if !side.contains(&w) => return fault("width", "16 to 4096 pixels, or both 0"),
        (_, h) if !side.contains(&h) => return fault("height", "16 to 4096 pixels, or both 0"),
        s => Some(s),
    };
    match v1::PictureCodec::try_from(r.codec) {
        Ok(v1::PictureCodec::Unspecified | v1::PictureCodec::Jpeg) => {}
        _ => return fault("codec", "streams are JPEG"),
    }
    if r.quality > 100 {
        return fault("quality", "1 to 100, or 0 for the default");
    }
    let is_cropped = match v1::PictureFraming::try_from(r.framing) {
        Ok(v1::PictureFraming::Unspecified | v1::PictureFraming::Contain) => false,
        Ok(v1::PictureFraming::Cover) => true,
        Err(_) => return fault("framing", "CONTAIN or COVER"),
    };
    let interval = match r.max_rate {
        0.0 => Duration::ZERO,
        rate if RATES.contains(&rate) => Duration::from_secs_f32(1.0 / rate),
        _ => {
            return fault(
                "max_rate",
                "0.01 to 1000 pictures a second, or 0 for no limit",
            );
        }
    };
    let window = match r.max_unacknowledged {
        0 => None,
        n if n <= MAX_WINDOW => Some(n),
        _ => return fault("max_unacknowledged", "1 to 16 messages, or 0 for none"),
    };
    Ok(PictureFormat {
        window,
        size,
        is_cropped,
        quality: if r.quality == 0 { 80 } else { r.quality as u8 },
        interval,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_named() {
        assert_eq!(
            camera_key("m", "s", "*").expect_err("wild").field,
            "m.camera"
        );
        assert_eq!(
            camera_key("m", "", "c").expect_err("empty").field,
            "m.store"
        );
        assert_eq!(session_id("m.id", "a/b").expect_err("slash").field, "m.id");
        let shirt = v1::GarmentChoice {
            garment: "tshirt".into(),
            size: "M".into(),
            color_rgb: None,
            print: None,
        };
        let bad = v1::GarmentChoice {
            color_rgb: Some(0x1_00_00_00),
            ..shirt.clone()
        };
        assert_eq!(
            choices("m", &[shirt.clone(), bad])
                .expect_err("colour")
                .field,
            "m.garments[1].color_rgb"
        );
        assert_eq!(
            choices("m", &vec![shirt; 9]).expect_err("nine").field,
            "m.garments"
        );
        let r = v1::StreamFramesRequest {
            width: 640,
            ..Default::default()
        };
        assert_eq!(
            picture_format(&r).expect_err("0").field,
            "stream_frames_request.height"
        );
        let r = v1::StreamFramesRequest {
            width: 4_000_000_000,
            height: 480,
            ..Default::default()
        };
        assert_eq!(
            picture_format(&r).expect_err("4 G").field,
            "stream_frames_request.width"
        );
    }

    #[test]
    fn odd_rates_are_refused_and_intervals_are_finite() {
        let format = |max_rate| {
            picture_format(&v1::StreamFramesRequest {
                max_rate,
                ..Default::default()
            })
        };
        let odd = [1e-30, f32::MIN_POSITIVE, 1e-45, 0.009, 1001.0, f32::MAX];
        let none = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0];
        for rate in odd.into_iter().chain(none) {
            let fault = format(rate).expect_err("odd");
            assert_eq!(fault.field, "stream_frames_request.max_rate", "{rate}");
        }
        for (rate, ms) in [
            (0.0, 0),
            (-0.0, 0),
            (0.01, 100_000),
            (10.0, 100),
            (1000.0, 1),
        ] {
            let interval = format(rate).expect("fine").interval;
            assert_eq!(interval.as_millis(), ms, "{rate}");
        }
    }
}
