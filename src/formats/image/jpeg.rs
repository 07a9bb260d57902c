//! JPEG for colour on the wire and in recordings.

use super::limits::{MAX_SIDE, check_size};
use crate::FormatError;
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use std::path::Path;
use tryon_geometry::camera::ColorImage;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Origin in errors of bare bytes.
const BYTES: &str = "jpeg bytes";
/// Largest distance of the end marker from the end of the bytes: some writers pad to a sector.
const END_WINDOW: usize = 4096;
/// Most pixels of a byte: Huffman codes take a bit or more for each block of 8×8 (ITU-T T.81, F.1.2), and arithmetic
/// coding is not decoded.
const MAX_PIXELS_PER_BYTE: u64 = 8 * 64;

/// Encodes colour as baseline JPEG with chroma at half resolution, quality 1 (small) to 100 (good).
/// Quality 80 takes about 3 ms and 35 kB for a VGA picture.
///
/// # Errors
/// When a side is zero or above 65,535, which JPEG cannot express.
pub fn encode_jpeg(image: &ColorImage, quality: u8) -> Result<Vec<u8>, FormatError> {
    let at = Path::new(BYTES);
    let side = |field: &str, n: u32| {
        u16::try_from(n)
            .map_err(|_| FormatError::field(at, field, format!("{n}, JPEG holds at most 65535")))
    };
    let (width, height) = (
        side("width", image.width())?,
        side("height", image.height())?,
    );
    let mut out = Vec::with_capacity(image.data().len() / 16);
    let mut encoder = Encoder::new(&mut out, quality.clamp(1, 100));
    encoder.set_sampling_factor(SamplingFactor::F_2_2);
    encoder
        .encode(image.data(), width, height, ColorType::Rgb)
        .map_err(|e| FormatError::field(at, "image", e.to_string()))?;
    Ok(out)
}

/// Decodes JPEG bytes to RGB.
///
/// # Errors
/// Not a JPEG, damaged, or of an unusable size.
pub fn decode_jpeg(bytes: &[u8]) -> Result<ColorImage, FormatError> {
    decode_jpeg_from(bytes, Path::new(BYTES))
}

/// Decodes as [`decode_jpeg`]; `origin` is named in errors.
pub(super) fn decode_jpeg_from(bytes: &[u8], origin: &Path) -> Result<ColorImage, FormatError> {
    let fault = |why: String| FormatError::field(origin, "jpeg", why);
    let options = DecoderOptions::default()
        .set_max_width(MAX_SIDE as usize)
        .set_max_height(MAX_SIDE as usize)
        .set_strict_mode(true)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder
        .decode_headers()
        .map_err(|e| fault(format!("{e:?}")))?;
    let info = decoder
        .info()
        .ok_or_else(|| fault("it has no header".into()))?;
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    check_size(origin, width, height)?;
    let held = bytes.len() as u64 * MAX_PIXELS_PER_BYTE;
    if u64::from(width) * u64::from(height) > held {
        let why = format!("{width}×{height} pixels, {} bytes hold {held}", bytes.len());
        return Err(fault(why));
    }
    // The decoder fills missing data with grey; an image without its end marker is truncated.
    if !bytes
        .windows(2)
        .rev()
        .take(END_WINDOW)
        .any(|w| w == [0xff, 0xd9])
    {
        return Err(fault("the file is cut short".into()));
    }
    let data = decoder.decode().map_err(|e| fault(format!("{e:?}")))?;
    ColorImage::new(width, height, data).map_err(|e| fault(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn picture() -> ColorImage {
        let data = (0..64 * 48)
            .flat_map(|i| [(i % 64 * 4) as u8, (i / 64 * 5) as u8, 90])
            .collect();
        ColorImage::new(64, 48, data).expect("sizes")
    }

    #[test]
    fn smooth_images_survive_the_round_trip() {
        let image = picture();
        let bytes = encode_jpeg(&image, 90).expect("encodes");
        let back = decode_jpeg(&bytes).expect("decodes");
        assert_eq!((back.width(), back.height()), (64, 48));
        let worst = image
            .data()
            .iter()
            .zip(back.data())
            .map(|(a, b)| a.abs_diff(*b))
            .max();
        assert!(worst.is_some_and(|w| w <= 12), "{worst:?}");
        assert!(bytes.len() < image.data().len() / 4);
    }

    #[test]
    fn every_truncation_is_an_error() {
        let bytes = encode_jpeg(&picture(), 80).expect("encodes");
        for cut in 0..bytes.len() - 1 {
            assert!(decode_jpeg(&bytes[..cut]).is_err(), "cut at {cut}");
        }
    }

    #[test]
    fn a_huge_header_is_refused() {
        let mut bytes = encode_jpeg(&picture(), 80).expect("encodes");
        let sof = bytes
            .windows(2)
            .position(|w| w == [0xff, 0xc0])
            .expect("a frame header");
        bytes[sof + 5..sof + 9].copy_from_slice(&[0xea, 0x60, 0xea, 0x60]);
        assert!(decode_jpeg(&bytes).is_err());
        bytes[sof + 5..sof + 9].copy_from_slice(&[0x3f, 0xff, 0x3f, 0xff]);
        assert!(
            decode_jpeg(&bytes)
                .expect_err("too many pixels")
                .to_string()
                .contains("pixels")
        );
    }

    #[test]
    fn a_header_beyond_the_coded_bytes_is_refused() {
        let flat = ColorImage::filled(2048, 2048, [7, 7, 7]);
        let mut bytes = encode_jpeg(&flat, 1).expect("encodes");
        assert!(decode_jpeg(&bytes).is_ok(), "the emptiest picture fits");
        bytes.truncate(8_000);
        bytes.extend([0xff, 0xd9]);
        let why = decode_jpeg(&bytes).expect_err("cut").to_string();
        assert!(why.contains("8002 bytes hold"), "{why}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn damaged_bytes_never_panic(noise in prop::collection::vec(any::<u8>(), 0..200), at in any::<usize>(), x in any::<u8>()) {
            let _ = decode_jpeg(&noise);
            let mut bytes = encode_jpeg(&picture(), 50).expect("encodes");
            let n = bytes.len();
            bytes[at % n] ^= x;
            // A damaged size may be legal and large: only shapes near the original are decoded here.
            let _ = decode_jpeg(&bytes);
        }
    }
}
