//! Video modes of OpenNI's sensors.

use super::ffi::{OniDevice, VideoMode};
use super::sensor;
use crate::driver::Encoding;
use crate::{Mode, Stream};

/// Images a second that are preferred.
const RATE: i32 = 30;

/// Meaning of a pixel format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Known {
    /// Smaller ones are preferred.
    rank: u8,
    pub(super) encoding: Encoding,
    /// Units of depth in a metre.
    pub(super) depth_scale: f64,
}

/// Meaning of `OniPixelFormat` in a stream; `None` for those that are not read (disparity, 16-bit grey).
pub(super) fn understood(stream: Stream, pixel_format: i32) -> Option<Known> {
    let known = |rank, encoding, depth_scale| Known {
        rank,
        encoding,
        depth_scale,
    };
    Some(match (stream, pixel_format) {
        (Stream::Depth, 100) => known(0, Encoding::Depth16, 1000.0),
        (Stream::Depth, 101) => known(1, Encoding::Depth16, 10_000.0),
        (Stream::Color, 200) => known(0, Encoding::Rgb8, 0.0),
        (Stream::Color, 201) => known(1, Encoding::Uyvy, 0.0),
        (Stream::Color, 205) => known(2, Encoding::Yuyv, 0.0),
        (Stream::Color, 204) => known(3, Encoding::Jpeg, 0.0),
        (Stream::Color, 202) => known(4, Encoding::Grey8, 0.0),
        _ => return None,
    })
}

/// The mode nearest to a size, then to 30 Hz, then by format.
pub(super) fn best_mode(
    stream: Stream,
    [width, height]: [u32; 2],
    modes: &[VideoMode],
) -> Option<VideoMode> {
    let key = |m: &VideoMode| {
        let rank = understood(stream, m.pixel_format)?.rank;
        let [x, y] = [m.width, m.height].map(i32::unsigned_abs);
        let size = x.abs_diff(width) + y.abs_diff(height);
        Some((size, m.fps.abs_diff(RATE), rank))
    };
    let readable = modes.iter().filter_map(|m| Some((key(m)?, *m)));
    readable.min_by_key(|(key, _)| *key).map(|(_, mode)| mode)
}

/// Sizes and rates of all formats that are read, each once.
pub(super) fn all_modes(device: &OniDevice) -> Vec<Mode> {
    let mut out: Vec<Mode> = Vec::new();
    for stream in [Stream::Depth, Stream::Color] {
        let modes = device.modes(sensor(stream)).into_iter();
        for m in modes.filter(|m| understood(stream, m.pixel_format).is_some()) {
            let mode = Mode {
                stream,
                width: m.width.unsigned_abs(),
                height: m.height.unsigned_abs(),
                rate: f64::from(m.fps),
            };
            if !out.contains(&mode) {
                out.push(mode);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mode_of_the_wanted_size_wins_then_30_hz_then_the_format() {
        let mode = |pixel_format, width, height, fps| VideoMode {
            pixel_format,
            width,
            height,
            fps,
        };
        let depth = [
            mode(102, 640, 480, 30),
            mode(101, 640, 480, 30),
            mode(100, 640, 480, 60),
            mode(100, 640, 480, 30),
            mode(100, 320, 240, 30),
        ];
        let best = |size, modes: &[VideoMode]| best_mode(Stream::Depth, size, modes);
        assert_eq!(best([640, 480], &depth), Some(depth[3]));
        assert_eq!(best([320, 240], &depth), Some(depth[4]));
        assert_eq!(best([640, 480], &depth[..3]), Some(depth[1]));
        assert_eq!(best([640, 480], &depth[..1]), None);
    }
}
