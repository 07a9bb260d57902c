//! Pixel formats of raw images, by the names of `sensor_msgs/image_encodings`.

use super::fault::MessageFault;
use super::image_layout::{ImageLayout, PixelContent, millimetres};
use crate::image::{check_size, yuv_to_rgb};
use crate::rgbd_folder::depth_to_mm;
use std::path::Path;
use tryon_geometry::camera::{ColorImage, DepthImage, ImageError};

/// Layout of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PixelFormat {
    /// 16-bit units of depth.
    Unsigned16,
    /// Metres in 32-bit floats.
    Float32,
    /// Bytes of a pixel, and those of red, green and blue among them.
    Interleaved { bytes: usize, rgb: [usize; 3] },
    /// Two pixels in four bytes: those of the two luminances, of U and of V.
    Yuv422 { y: [usize; 2], u: usize, v: usize },
}

impl PixelFormat {
    /// Format by its name; `None` for those that are not read.
    fn of(encoding: &str) -> Option<Self> {
        let interleaved = |bytes, rgb| Self::Interleaved { bytes, rgb };
        Some(match encoding {
            "16UC1" | "mono16" => Self::Unsigned16,
            "32FC1" => Self::Float32,
            "rgb8" => interleaved(3, [0, 1, 2]),
            "bgr8" => interleaved(3, [2, 1, 0]),
            "rgba8" => interleaved(4, [0, 1, 2]),
            "bgra8" => interleaved(4, [2, 1, 0]),
            "mono8" | "8UC1" => interleaved(1, [0, 0, 0]),
            "yuv422" | "uyvy" | "UYVY" => Self::Yuv422 {
                y: [1, 3],
                u: 0,
                v: 2,
            },
            "yuv422_yuy2" | "yuyv" | "YUYV" | "yuyv422" => Self::Yuv422 {
                y: [0, 2],
                u: 1,
                v: 3,
            },
            _ => return None,
        })
    }

    /// Bytes of a row of `width` pixels.
    fn row_bytes(self, width: u32) -> usize {
        let width = width as usize;
        match self {
            Self::Unsigned16 => 2 * width,
            Self::Float32 => 4 * width,
            Self::Interleaved { bytes, .. } => bytes * width,
            Self::Yuv422 { .. } => 4 * width.div_ceil(2),
        }
    }
}

/// Kind of the pixels of an encoding.
pub(super) fn content(encoding: &str) -> PixelContent {
    match (encoding, PixelFormat::of(encoding)) {
        ("mono16", _) => PixelContent::Grey16,
        (_, None) => PixelContent::Unread,
        (_, Some(PixelFormat::Unsigned16 | PixelFormat::Float32)) => PixelContent::Depth,
        (_, Some(PixelFormat::Interleaved { bytes: 1, .. })) => PixelContent::Grey,
        (_, Some(_)) => PixelContent::Color,
    }
}

/// Checked rows of a raw image.
struct PixelRows<'a> {
    size: (u32, u32),
    format: PixelFormat,
    encoding: &'a str,
    is_big_endian: bool,
    rows: Vec<&'a [u8]>,
}

/// Checks size, step and the number of bytes.
fn rows<'a>(layout: &'a ImageLayout, data: &'a [u8]) -> Result<PixelRows<'a>, MessageFault> {
    let ImageLayout::Raw {
        width,
        height,
        encoding,
        is_big_endian,
        step,
    } = layout
    else {
        return Err(MessageFault::new("encoding", "not a raw image"));
    };
    let format = PixelFormat::of(encoding).ok_or_else(|| unread(encoding))?;
    check_size(Path::new("image"), *width, *height).map_err(|e| match e {
        crate::FormatError::Field { field, why, .. } => MessageFault::new(field, why),
        other => other.into(),
    })?;
    let (row, step) = (format.row_bytes(*width), *step as usize);
    if step < row {
        let why = format!("{step}, a row of {width} pixels {encoding} has {row} bytes");
        return Err(MessageFault::new("step", why));
    }
    let need = step * (*height as usize - 1) + row;
    if data.len() < need {
        let why = format!("{} bytes, expected {need}", data.len());
        return Err(MessageFault::new("data", why));
    }
    let lines = data.chunks(step).take(*height as usize);
    Ok(PixelRows {
        size: (*width, *height),
        format,
        encoding,
        is_big_endian: *is_big_endian,
        rows: lines.map(|r| &r[..row]).collect(),
    })
}

fn unread(encoding: &str) -> MessageFault {
    MessageFault::new("encoding", format!("`{encoding}` is not read"))
}

fn size_fault(error: ImageError) -> MessageFault {
    MessageFault::new("data", error.to_string())
}

/// Depth of a raw image, millimetres. `unit` \[m\] scales 16-bit values.
pub(super) fn depth(
    layout: &ImageLayout,
    data: &[u8],
    unit: f64,
) -> Result<DepthImage, MessageFault> {
    let image = rows(layout, data)?;
    let (width, height) = image.size;
    match image.format {
        PixelFormat::Unsigned16 => {
            let read = match image.is_big_endian {
                true => u16::from_be_bytes,
                false => u16::from_le_bytes,
            };
            let pixels = image.rows.iter().flat_map(|r| r.as_chunks::<2>().0);
            let values = pixels.map(|b| read(*b)).collect();
            let mut depth = DepthImage::new(width, height, values).map_err(size_fault)?;
            depth_to_mm(&mut depth, unit.recip());
            Ok(depth)
        }
        PixelFormat::Float32 => {
            let read = match image.is_big_endian {
                true => f32::from_be_bytes,
                false => f32::from_le_bytes,
            };
            let pixels = image.rows.iter().flat_map(|r| r.as_chunks::<4>().0);
            let values = pixels.map(|b| millimetres(f64::from(read(*b)))).collect();
            DepthImage::new(width, height, values).map_err(size_fault)
        }
        _ => {
            let why = format!("`{}` is no depth", image.encoding);
            Err(MessageFault::new("encoding", why))
        }
    }
}

/// Colour of a raw image.
pub(super) fn color(layout: &ImageLayout, data: &[u8]) -> Result<ColorImage, MessageFault> {
    let image = rows(layout, data)?;
    let (width, height) = image.size;
    let mut out = Vec::with_capacity(3 * width as usize * height as usize);
    for row in &image.rows {
        match image.format {
            PixelFormat::Interleaved { bytes, rgb } => {
                let pixels = row.chunks_exact(bytes);
                out.extend(pixels.flat_map(|p| rgb.map(|c| p[c])));
            }
            PixelFormat::Yuv422 { y, u, v } => {
                let pairs = row.as_chunks::<4>().0.iter();
                let pixels = pairs.flat_map(|p| y.map(|y| yuv_to_rgb(p[y], p[u], p[v])));
                out.extend(pixels.take(width as usize).flatten());
            }
            _ => {
                let why = format!("`{}` is no colour", image.encoding);
                return Err(MessageFault::new("encoding", why));
            }
        }
    }
    ColorImage::new(width, height, out).map_err(size_fault)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raw(encoding: &str, width: u32, step: u32) -> ImageLayout {
        ImageLayout::Raw {
            width,
            height: 1,
            encoding: encoding.into(),
            is_big_endian: false,
            step,
        }
    }

    #[test]
    fn every_channel_order_gives_the_same_colour() {
        let bytes: [(&str, &[u8]); 5] = [
            ("rgb8", &[10, 20, 30, 40, 50, 60]),
            ("bgr8", &[30, 20, 10, 60, 50, 40]),
            ("rgba8", &[10, 20, 30, 255, 40, 50, 60, 0]),
            ("bgra8", &[30, 20, 10, 255, 60, 50, 40, 0]),
            ("rgb8", &[10, 20, 30, 40, 50, 60, 99, 99]),
        ];
        for (encoding, data) in bytes {
            let image = color(&raw(encoding, 2, data.len() as u32), data).expect("decodes");
            assert_eq!(image.data(), [10, 20, 30, 40, 50, 60], "{encoding}");
        }
        let grey = color(&raw("mono8", 2, 2), &[7, 8]).expect("decodes");
        assert_eq!(grey.data(), [7, 7, 7, 8, 8, 8]);
    }

    #[test]
    fn packed_yuv_has_both_orders_and_odd_widths() {
        // Red and grey by BT.601.
        let red = [81, 90, 240];
        for (encoding, data) in [
            ("yuv422", [90, 81, 240, 81]),
            ("uyvy", [90, 81, 240, 81]),
            ("yuv422_yuy2", [81, 90, 81, 240]),
            ("yuyv", [81, 90, 81, 240]),
        ] {
            let image = color(&raw(encoding, 1, 4), &data).expect("decodes");
            assert_eq!(image.data(), yuv_to_rgb(red[0], red[1], red[2]));
            assert!(image.data()[0] > 250 && image.data()[1] < 5 && image.data()[2] < 5);
        }
        assert_eq!(yuv_to_rgb(16, 128, 128), [0; 3]);
        assert_eq!(yuv_to_rgb(235, 128, 128), [255; 3]);
    }

    #[test]
    fn float_depth_is_metres_and_what_is_none_is_zero() {
        let metres = [
            1.25,
            0.0,
            -1.0,
            f32::NAN,
            f32::INFINITY,
            65.535,
            65.536,
            0.0004,
        ];
        let expected = [1250, 0, 0, 0, 0, 65_535, 0, 0];
        for is_big_endian in [false, true] {
            let bytes = |v: &f32| match is_big_endian {
                true => v.to_be_bytes(),
                false => v.to_le_bytes(),
            };
            let data: Vec<u8> = metres.iter().flat_map(bytes).collect();
            let layout = ImageLayout::Raw {
                width: 8,
                height: 1,
                encoding: "32FC1".into(),
                is_big_endian,
                step: 32,
            };
            let image = depth(&layout, &data, 0.001).expect("decodes");
            assert_eq!(image.data(), expected);
        }
    }

    #[test]
    fn units_and_byte_order_of_16_bits_hold() {
        let layout = |is_big_endian| ImageLayout::Raw {
            width: 2,
            height: 1,
            encoding: "16UC1".into(),
            is_big_endian,
            step: 4,
        };
        let data = [0x03, 0xe8, 0xff, 0xff];
        let image = depth(&layout(true), &data, 0.001).expect("decodes");
        assert_eq!(image.data(), [1000, 65_535]);
        let image = depth(&layout(false), &data, 0.0001).expect("decodes");
        assert_eq!(image.data(), [5940, 6554]); // 59 395 and 65 535 tenths of a millimetre
        let image = depth(&layout(true), &data, 0.002).expect("decodes");
        assert_eq!(image.data(), [2000, 0]);
    }

    #[test]
    fn faults_name_their_field() {
        let of = |encoding: &str, width, step, data: &[u8]| {
            color(&raw(encoding, width, step), data)
                .expect_err("bad")
                .field
        };
        assert_eq!(of("rgb8", 2, 5, &[0; 6]), "step");
        assert_eq!(of("rgb8", 2, 6, &[0; 5]), "data");
        assert_eq!(of("rgb8", 0, 6, &[0; 5]), "width");
        assert_eq!(of("bayer_rggb8", 2, 2, &[0; 2]), "encoding");
        assert_eq!(of("16UC1", 1, 2, &[0; 2]), "encoding");
        assert!(depth(&raw("rgb8", 1, 3), &[0; 3], 0.001).is_err());
    }
}
