//! Depth and colour of one frame that were not exposed together.

use tryon_proto::v1::CameraFrame;

/// Offsets in time between the depth and the colour of a camera.
#[derive(Debug, Default)]
pub(super) struct ColorOffset {
    last_depth_ns: Option<u64>,
    is_said: bool,
}

impl ColorOffset {
    /// Counts a frame whose colour is off by more than half a frame, and says the first one.
    pub(super) fn note(&mut self, camera: &str, frame: &CameraFrame) {
        let depth_ns = frame.capture_time_ns;
        let last = self.last_depth_ns.replace(depth_ns);
        let Some(offset_ns) = too_far(last, depth_ns, frame.color_time_ns) else {
            return;
        };
        metrics::counter!("tryon_color_offsets", "camera" => camera.to_owned()).increment(1);
        if !std::mem::replace(&mut self.is_said, true) {
            let offset_ms = offset_ns as f64 * 1e-6;
            tracing::warn!(
                camera,
                offset_ms,
                "depth and colour are not exposed together"
            );
        }
    }
}

/// Offset of a colour in time, positive when it is later, where that is more than half the time between two depths.
fn too_far(last_depth_ns: Option<u64>, depth_ns: u64, color_ns: u64) -> Option<i64> {
    let period = depth_ns.checked_sub(last_depth_ns?)?;
    let offset = (color_ns as i64).saturating_sub(depth_ns as i64);
    (color_ns != 0 && offset.unsigned_abs() > period / 2).then_some(offset)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_frame_is_too_far() {
        let (last, depth) = (Some(100_000_000), 133_000_000);
        for color in [0, depth, depth + 16_000_000, depth - 16_000_000] {
            assert_eq!(too_far(last, depth, color), None);
        }
        assert_eq!(too_far(last, depth, depth + 17_000_000), Some(17_000_000));
        assert_eq!(too_far(last, depth, depth - 17_000_000), Some(-17_000_000));
        assert_eq!(too_far(None, depth, 1), None);
        let never = too_far(last, depth, i64::MAX as u64);
        assert_eq!(never, Some(i64::MAX - depth as i64));
    }
}
