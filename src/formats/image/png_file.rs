//! PNG: 16-bit grey for depth, 8-bit for colour.

use super::limits::check_size;
use crate::FormatError;
use png::{
    BitDepth, ColorType, Compression, Decoder, DecodingError, Encoder, Limits, Reader,
    Transformations,
};
use std::io::Cursor;
use std::path::Path;
use tryon_geometry::camera::{ColorImage, DepthImage};

/// Memory of the decoder besides the image, bytes: chunks such as colour profiles, and a few rows.
const DECODER_BYTES: usize = 16 << 20;

/// Largest expansion of deflate (RFC 1951: 258 bytes from two bits); a header that promises more is refused.
const DEFLATE_LIMIT: u64 = 1032;

fn fault(origin: &Path, e: &DecodingError) -> FormatError {
    match e {
        DecodingError::IoError(_) => FormatError::field(origin, "png", "the file is cut short"),
        other => FormatError::field(origin, "png", other.to_string()),
    }
}

/// Reads the header and checks the sizes; allocates nothing of the image.
fn open<'a>(
    bytes: &'a [u8],
    origin: &Path,
    t: Transformations,
) -> Result<Reader<Cursor<&'a [u8]>>, FormatError> {
    let mut decoder = Decoder::new_with_limits(
        Cursor::new(bytes),
        Limits {
            bytes: DECODER_BYTES,
        },
    );
    decoder.set_transformations(t);
    decoder.set_ignore_text_chunk(true);
    let info = decoder.read_header_info().map_err(|e| fault(origin, &e))?;
    let (width, height) = (info.width, info.height);
    // First, since the product of larger sides overflows.
    check_size(origin, width, height)?;
    let raw = info.raw_bytes() as u64;
    if raw > DEFLATE_LIMIT * bytes.len() as u64 {
        let why = format!(
            "{width}×{height} pixels cannot come from {} bytes; the file is cut short",
            bytes.len()
        );
        return Err(FormatError::field(origin, "png", why));
    }
    decoder.read_info().map_err(|e| fault(origin, &e))
}

fn pixels(reader: &mut Reader<Cursor<&[u8]>>, origin: &Path) -> Result<Vec<u8>, FormatError> {
    let too_large = || FormatError::field(origin, "png", "the image does not fit memory");
    let mut data = vec![0; reader.output_buffer_size().ok_or_else(too_large)?];
    let out = reader
        .next_frame(&mut data)
        .map_err(|e| fault(origin, &e))?;
    data.truncate(out.buffer_size());
    Ok(data)
}

/// Decodes 16-bit grey PNG bytes to depth in the file's own unit; `origin` is named in errors.
///
/// # Errors
/// Not a PNG, cut short, not 16-bit grey, or of an unusable size.
pub fn decode_png_depth(bytes: &[u8], origin: &Path) -> Result<DepthImage, FormatError> {
    let mut reader = open(bytes, origin, Transformations::IDENTITY)?;
    let (color, bits) = reader.output_color_type();
    if (color, bits) != (ColorType::Grayscale, BitDepth::Sixteen) {
        let why = format!("{color:?} with {} bits, expected 16-bit grey", bits as u8);
        return Err(FormatError::field(origin, "depth format", why));
    }
    let data = pixels(&mut reader, origin)?;
    let values = data
        .chunks_exact(2)
        .map(|b| u16::from_be_bytes([b[0], b[1]]))
        .collect();
    let (width, height) = (reader.info().width, reader.info().height);
    DepthImage::new(width, height, values)
        .map_err(|e| FormatError::field(origin, "png", e.to_string()))
}

/// Decodes PNG bytes to RGB; `origin` is named in errors.
///
/// # Errors
/// Not a PNG, cut short, or of an unusable size.
pub fn decode_png_color(bytes: &[u8], origin: &Path) -> Result<ColorImage, FormatError> {
    let mut reader = open(bytes, origin, Transformations::normalize_to_color8())?;
    let (color, _) = reader.output_color_type();
    let data = pixels(&mut reader, origin)?;
    let rgb = match color {
        ColorType::Rgb => data,
        ColorType::Rgba => data
            .chunks_exact(4)
            .flat_map(|p| [p[0], p[1], p[2]])
            .collect(),
        ColorType::Grayscale => data.iter().flat_map(|&g| [g; 3]).collect(),
        ColorType::GrayscaleAlpha => data.chunks_exact(2).flat_map(|p| [p[0]; 3]).collect(),
        ColorType::Indexed => {
            return Err(FormatError::field(origin, "png", "its palette is missing"));
        }
    };
    let (width, height) = (reader.info().width, reader.info().height);
    ColorImage::new(width, height, rgb)
        .map_err(|e| FormatError::field(origin, "png", e.to_string()))
}

fn encode(
    size: (u32, u32),
    color: ColorType,
    bits: BitDepth,
    data: &[u8],
    at: &Path,
) -> Result<Vec<u8>, FormatError> {
    let mut out = Vec::with_capacity(data.len() / 2);
    let mut encoder = Encoder::new(&mut out, size.0, size.1);
    encoder.set_color(color);
    encoder.set_depth(bits);
    // 2.5 ms a VGA picture; `Balanced` takes 55 ms.
    encoder.set_compression(Compression::Fast);
    let written = encoder.write_header().and_then(|mut w| {
        w.write_image_data(data)?;
        w.finish()
    });
    written.map_err(|e| FormatError::field(at, "png", e.to_string()))?;
    Ok(out)
}

/// Encodes depth as 16-bit grey PNG; `origin` is named in errors.
///
/// # Errors
/// For an image without pixels.
pub fn encode_png_depth(image: &DepthImage, origin: &Path) -> Result<Vec<u8>, FormatError> {
    let data: Vec<u8> = image.data().iter().flat_map(|d| d.to_be_bytes()).collect();
    encode(
        (image.width(), image.height()),
        ColorType::Grayscale,
        BitDepth::Sixteen,
        &data,
        origin,
    )
}

/// Encodes colour as RGB PNG with fast compression; `origin` is named in errors.
///
/// # Errors
/// For an image without pixels.
pub fn encode_png_rgb(image: &ColorImage, origin: &Path) -> Result<Vec<u8>, FormatError> {
    encode(
        (image.width(), image.height()),
        ColorType::Rgb,
        BitDepth::Eight,
        image.data(),
        origin,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const AT: &str = "frame.png";

    fn ramp() -> DepthImage {
        DepthImage::new(40, 30, (0..1200).map(|i| (i * 53 % 5000) as u16).collect()).expect("sizes")
    }

    #[test]
    fn every_truncation_is_an_error() {
        let bytes = encode_png_depth(&ramp(), Path::new(AT)).expect("encodes");
        // The last chunks (checksum and IEND) carry no pixels; the decoder may do without them.
        for cut in 0..bytes.len() - 16 {
            let e = decode_png_depth(&bytes[..cut], Path::new(AT)).expect_err("cut");
            assert!(e.to_string().contains(AT));
        }
    }

    #[test]
    fn a_huge_header_is_refused() {
        let mut bytes = encode_png_depth(&ramp(), Path::new(AT)).expect("encodes");
        bytes[16..20].copy_from_slice(&60_000u32.to_be_bytes());
        bytes[20..24].copy_from_slice(&60_000u32.to_be_bytes());
        fix_ihdr_checksum(&mut bytes);
        let e = decode_png_depth(&bytes, Path::new(AT))
            .expect_err("huge")
            .to_string();
        assert!(e.contains("`width`") && e.contains("60000"), "{e}");
        // Within the limits, but not from so few bytes.
        bytes[16..20].copy_from_slice(&8_000u32.to_be_bytes());
        bytes[20..24].copy_from_slice(&8_000u32.to_be_bytes());
        fix_ihdr_checksum(&mut bytes);
        let e = decode_png_depth(&bytes, Path::new(AT))
            .expect_err("bomb")
            .to_string();
        assert!(e.contains("cannot come from"), "{e}");
    }

    /// The bitwise CRC-32 of the PNG specification, annex D.
    fn fix_ihdr_checksum(bytes: &mut [u8]) {
        let mut crc = u32::MAX;
        for b in &bytes[12..29] {
            crc ^= u32::from(*b);
            for _ in 0..8 {
                crc = if crc & 1 == 1 {
                    0xedb8_8320 ^ (crc >> 1)
                } else {
                    crc >> 1
                };
            }
        }
        bytes[29..33].copy_from_slice(&(!crc).to_be_bytes());
    }

    #[test]
    fn a_colour_picture_is_no_depth() {
        let rgb =
            encode_png_rgb(&ColorImage::filled(4, 4, [1, 2, 3]), Path::new(AT)).expect("encodes");
        let e = decode_png_depth(&rgb, Path::new(AT))
            .expect_err("colour")
            .to_string();
        assert!(e.contains("depth format") && e.contains("16-bit"), "{e}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn random_and_damaged_bytes_never_panic(noise in prop::collection::vec(any::<u8>(), 0..200), at in 0usize..400, x in any::<u8>()) {
            let _ = decode_png_color(&noise, Path::new(AT));
            let mut bytes = encode_png_depth(&ramp(), Path::new(AT)).expect("encodes");
            let n = bytes.len();
            bytes[at % n] ^= x;
            let _ = decode_png_depth(&bytes, Path::new(AT));
        }
    }
}
