//! Bytes of a camera's image as depth in millimetres or RGB.

use super::driver::{Encoding, StreamFormat};
use super::freenect::disparity_to_mm;
use std::path::Path;
use tryon_formats::image::{decode_color, yuyv_to_rgb};
use tryon_formats::{FormatError, depth_to_mm};
use tryon_geometry::camera::{ColorImage, DepthImage};

/// Decodes depth of `depth_scale` units in a metre; `camera` is named in errors.
///
/// # Errors
/// Another number of bytes than the format has.
pub(crate) fn decode_depth_image(
    bytes: &[u8],
    format: &StreamFormat,
    depth_scale: f64,
    camera: &Path,
) -> Result<DepthImage, FormatError> {
    let values = bytes.as_chunks::<2>().0.iter();
    let values = values.map(|b| u16::from_le_bytes(*b));
    let is_disparity = format.encoding == Encoding::KinectDisparity;
    let values = if is_disparity {
        values.map(disparity_to_mm).collect()
    } else {
        values.collect()
    };
    let image = DepthImage::new(format.width, format.height, values);
    let mut image = image.map_err(|e| FormatError::field(camera, "depth", e.to_string()))?;
    if !is_disparity {
        depth_to_mm(&mut image, depth_scale);
    }
    Ok(image)
}

/// Decodes colour; `camera` is named in errors.
///
/// # Errors
/// Another number of bytes than the format has, or a damaged JPEG.
pub(crate) fn decode_color_image(
    bytes: &[u8],
    format: &StreamFormat,
    camera: &Path,
) -> Result<ColorImage, FormatError> {
    let fault = |why: String| FormatError::field(camera, "color", why);
    let rgb = match format.encoding {
        Encoding::Rgb8 => bytes.to_vec(),
        Encoding::Yuyv => yuyv_to_rgb(bytes).into_flattened(),
        Encoding::Uyvy => {
            let pairs = bytes.as_chunks::<4>().0.iter();
            let swapped: Vec<u8> = pairs.flat_map(|[u, y, v, z]| [*y, *u, *z, *v]).collect();
            yuyv_to_rgb(&swapped).into_flattened()
        }
        Encoding::Grey8 => bytes.iter().flat_map(|g| [*g; 3]).collect(),
        Encoding::Jpeg => {
            let image = decode_color(bytes, camera)?;
            let (got, want) = (
                (image.width(), image.height()),
                (format.width, format.height),
            );
            if got != want {
                return Err(fault(format!(
                    "{got:?} pixels, but the stream has {want:?}"
                )));
            }
            return Ok(image);
        }
        Encoding::Depth16 | Encoding::KinectDisparity => {
            return Err(fault("the stream is depth".into()));
        }
    };
    let image = ColorImage::new(format.width, format.height, rgb);
    image.map_err(|e| fault(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_formats::image::encode_jpeg;

    const AT: &str = "v4l2:1";

    fn format(encoding: Encoding) -> StreamFormat {
        StreamFormat {
            encoding,
            width: 16,
            height: 8,
            rate: 30.0,
        }
    }

    fn color(bytes: &[u8], encoding: Encoding) -> Result<ColorImage, String> {
        decode_color_image(bytes, &format(encoding), Path::new(AT)).map_err(|e| e.to_string())
    }

    #[test]
    fn depth_is_converted_from_its_unit() {
        let bytes: Vec<u8> = (0..128u16).flat_map(|i| (40 * i).to_le_bytes()).collect();
        let of = |scale| {
            let image =
                decode_depth_image(&bytes, &format(Encoding::Depth16), scale, Path::new(AT));
            image.expect("right size").at(3, 2)
        };
        // Pixel 35: 1400 units of a millimetre, of a tenth of it (OpenNI's 100 µm), and of L515's quarter.
        assert_eq!([of(1000.0), of(10_000.0), of(4000.0)], [1400, 140, 350]);
        let short = decode_depth_image(&bytes[2..], &format(Encoding::Depth16), 1e3, Path::new(AT));
        let fault = short.expect_err("127 pixels").to_string();
        assert!(fault.starts_with("v4l2:1: `depth`"), "{fault}");
    }

    #[test]
    fn each_encoding_of_red_is_red() {
        // ITU-R BT.601: red is Y 81, U 90, V 240.
        let near_red = |image: ColorImage| {
            let [r, g, b] = image.at(7, 3);
            assert!(r > 252 && g < 3 && b < 3, "{r} {g} {b}");
        };
        near_red(color(&[255, 0, 0].repeat(128), Encoding::Rgb8).expect("rgb"));
        near_red(color(&[81, 90, 81, 240].repeat(64), Encoding::Yuyv).expect("yuyv"));
        near_red(color(&[90, 81, 240, 81].repeat(64), Encoding::Uyvy).expect("uyvy"));
        let jpeg = encode_jpeg(&ColorImage::filled(16, 8, [254, 0, 0]), 95).expect("encoded");
        near_red(color(&jpeg, Encoding::Jpeg).expect("jpeg"));
        let grey = color(&[77].repeat(128), Encoding::Grey8).expect("grey");
        assert_eq!(grey.at(1, 1), [77; 3]);
    }

    #[test]
    fn images_of_another_size_name_camera_and_stream() {
        let jpeg = encode_jpeg(&ColorImage::filled(8, 8, [9; 3]), 90).expect("encoded");
        for fault in [
            color(&[0; 100], Encoding::Rgb8),
            color(&[0; 130], Encoding::Yuyv),
            color(&jpeg, Encoding::Jpeg),
            color(&jpeg[..60], Encoding::Jpeg),
        ] {
            let fault = fault.expect_err("another size");
            assert!(fault.starts_with("v4l2:1: `"), "{fault}");
        }
    }
}
