//! Compressed images: JPEG and PNG of `compressed_image_transport` and Foxglove, `compressed_depth_image_transport`.

use super::fault::MessageFault;
use super::image_layout::{PixelContent, millimetres};
use crate::image::{decode_color, decode_png_depth};
use crate::rgbd_folder::depth_to_mm;
use std::path::Path;
use tryon_geometry::camera::{ColorImage, DepthImage};

/// Origin in errors of the decoders.
const ORIGIN: &str = "image";
/// Header of `compressedDepth`: format (u32) and two quantisation parameters (f32), little-endian.
const DEPTH_HEADER: usize = 12;

/// Parts of a format string: `ENCODING; CODEC details`, or the codec alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct FormatParts<'a> {
    /// Pixel format before compression; empty if not stated.
    encoding: &'a str,
    /// `jpeg`, `png` or another.
    codec: &'a str,
    is_compressed_depth: bool,
}

impl<'a> FormatParts<'a> {
    fn of(format: &'a str) -> Self {
        let (encoding, rest) = format.split_once(';').unwrap_or(("", format));
        let mut words = rest.split_whitespace();
        let first = words.next().unwrap_or("");
        let is_compressed_depth = first == "compressedDepth";
        let codec = match is_compressed_depth {
            true => words.next().unwrap_or("png"),
            false => first,
        };
        Self {
            encoding: encoding.trim(),
            codec,
            is_compressed_depth,
        }
    }
    fn is_color_codec(self) -> bool {
        matches!(self.codec, "jpeg" | "jpg" | "png")
    }
}

/// True for PNG with 16-bit grey, by its header (IHDR is the first chunk: bit depth at byte 24, colour type at 25).
fn is_png_of_16_bits(data: &[u8]) -> bool {
    data.starts_with(b"\x89PNG") && data.get(24..26) == Some(&[16, 0])
}

/// Kind of the pixels, by format and header.
pub(super) fn content(format: &str, data: &[u8]) -> PixelContent {
    let parts = FormatParts::of(format);
    let is_depth = matches!(parts.encoding, "16UC1" | "32FC1");
    match parts {
        p if p.is_compressed_depth && p.codec == "png" => PixelContent::Depth,
        p if p.is_compressed_depth || !p.is_color_codec() => PixelContent::Unread,
        p if p.codec == "png" && is_png_of_16_bits(data) && is_depth => PixelContent::Depth,
        p if p.codec == "png" && is_png_of_16_bits(data) => PixelContent::Grey16,
        p if is_depth || p.encoding.starts_with("bayer") => PixelContent::Unread,
        p if matches!(p.encoding, "mono8" | "8UC1") => PixelContent::Grey,
        _ => PixelContent::Color,
    }
}

/// Colour of a compressed image.
pub(super) fn color(format: &str, data: &[u8]) -> Result<ColorImage, MessageFault> {
    match content(format, data) {
        PixelContent::Color | PixelContent::Grey => Ok(decode_color(data, Path::new(ORIGIN))?),
        _ => Err(unread(format)),
    }
}

/// Depth of a compressed image, millimetres. `unit` \[m\] scales 16-bit values.
pub(super) fn depth(format: &str, data: &[u8], unit: f64) -> Result<DepthImage, MessageFault> {
    let parts = FormatParts::of(format);
    if !matches!(
        content(format, data),
        PixelContent::Depth | PixelContent::Grey16
    ) {
        return Err(unread(format));
    }
    if !parts.is_compressed_depth {
        let mut image = decode_png_depth(data, Path::new(ORIGIN))?;
        depth_to_mm(&mut image, unit.recip());
        return Ok(image);
    }
    let Some((header, png)) = data.split_first_chunk::<DEPTH_HEADER>() else {
        let why = format!("{} bytes, expected a header of {DEPTH_HEADER}", data.len());
        return Err(MessageFault::new("data", why));
    };
    let mut image = decode_png_depth(png, Path::new(ORIGIN))?;
    if parts.encoding == "32FC1" {
        InverseDepth::of(header)?.decode(&mut image);
    } else {
        depth_to_mm(&mut image, unit.recip());
    }
    Ok(image)
}

fn unread(format: &str) -> MessageFault {
    MessageFault::new("format", format!("`{format}` is not read"))
}

/// Quantisation of inverse depth: depth \[m\] = a / (value − b); 0 is no reading.
struct InverseDepth {
    a: f64,
    b: f64,
}

impl InverseDepth {
    fn of(header: &[u8; DEPTH_HEADER]) -> Result<Self, MessageFault> {
        let [a, b] = [4, 8].map(|at| {
            let bytes = [header[at], header[at + 1], header[at + 2], header[at + 3]];
            f64::from(f32::from_le_bytes(bytes))
        });
        if a.is_finite() && b.is_finite() {
            Ok(Self { a, b })
        } else {
            let why = format!("quantisation parameters {a} and {b}, expected finite ones");
            Err(MessageFault::new("data", why))
        }
    }

    fn decode(&self, image: &mut DepthImage) {
        for value in image.data_mut() {
            *value = match *value {
                0 => 0,
                v => millimetres(self.a / (f64::from(v) - self.b)),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{encode_jpeg, encode_png_depth, encode_png_rgb};

    fn png(values: Vec<u16>) -> Vec<u8> {
        let image = DepthImage::new(values.len() as u32, 1, values).expect("sizes");
        encode_png_depth(&image, Path::new("a")).expect("encodes")
    }

    fn with_header(a: f32, b: f32, png: &[u8]) -> Vec<u8> {
        let mut data = vec![0, 0, 0, 0];
        data.extend(a.to_le_bytes());
        data.extend(b.to_le_bytes());
        data.extend(png);
        data
    }

    #[test]
    fn compressed_depth_is_millimetres_or_inverse_depth() {
        let data = with_header(0.0, 0.0, &png(vec![0, 1000, 4321]));
        for format in ["16UC1; compressedDepth png", "16UC1; compressedDepth"] {
            let image = depth(format, &data, 0.001).expect("decodes");
            assert_eq!(image.data(), [0, 1000, 4321]);
        }
        let quantised = [0, 100, 1090];
        let data = with_header(1000.0, 90.0, &png(quantised.to_vec()));
        let image = depth("32FC1; compressedDepth png", &data, 0.001).expect("decodes");
        assert_eq!(image.data(), [0, 0, 1000]); // 100 m is out of range, 1 m
        for cut in 0..data.len() - 16 {
            let cut = depth("32FC1; compressedDepth png", &data[..cut], 0.001);
            assert_eq!(cut.expect_err("cut").field, "data");
        }
    }

    #[test]
    fn formats_say_what_a_file_holds() {
        let (grey16, rgb) = (png(vec![1, 2]), ColorImage::filled(2, 1, [9, 8, 7]));
        let rgb_png = encode_png_rgb(&rgb, Path::new("a")).expect("encodes");
        let jpeg = encode_jpeg(&rgb, 90).expect("encodes");
        let cases: [(&str, &[u8], PixelContent); 10] = [
            ("jpeg", &jpeg, PixelContent::Color),
            ("png", &rgb_png, PixelContent::Color),
            ("png", &grey16, PixelContent::Grey16),
            ("rgb8; jpeg compressed bgr8", &jpeg, PixelContent::Color),
            ("bgr8; png compressed bgr8", &rgb_png, PixelContent::Color),
            ("mono8; jpeg compressed ", &jpeg, PixelContent::Grey),
            ("16UC1; png compressed ", &grey16, PixelContent::Depth),
            ("16UC1; compressedDepth rvl", &grey16, PixelContent::Unread),
            ("webp", &jpeg, PixelContent::Unread),
            (
                "bayer_rggb8; jpeg compressed bgr8",
                &jpeg,
                PixelContent::Unread,
            ),
        ];
        for (format, data, expected) in cases {
            assert_eq!(content(format, data), expected, "{format}");
        }
        let e = color("webp", &jpeg).expect_err("not read");
        assert!(e.field == "format" && e.why.contains("`webp`"));
        let image = color("bgr8; png compressed bgr8", &rgb_png).expect("decodes");
        assert_eq!(image.data(), rgb.data());
    }
}
