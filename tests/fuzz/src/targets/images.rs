//! Images: the depth and position codecs of the wire, PNG, JPEG.

use super::{Target, text};
use crate::bundle::Bundle;
use std::path::Path;
use tryon::formats::PositionCoder;
use tryon::formats::image::{
    decode_color, decode_depth, decode_jpeg, decode_png_color, decode_png_depth, encode_depth,
    encode_jpeg, encode_png_depth, encode_png_rgb,
};
use tryon::geometry::camera::{ColorImage, DepthImage};
use tryon::geometry::math::P3;

/// Deflate and zstd legitimately expand a byte by thousands; sizes are checked before, and the largest image is bounded.
const PER_PACKED_BYTE: usize = 60_000;
/// A byte of JPEG holds at most 512 pixels, of 3 bytes as colour and of 6 as coefficients of progressive scans, with the
/// decoder's rows beside them.
const PER_JPEG_BYTE: usize = 512 * 20;

/// Depth of the wire.
pub(super) const DEPTH: Target = Target::new(
    "depth-codec",
    "src/formats/image/depth_codec.rs",
    |b, _| {
        decode_depth(b.first())
            .map(|d| d.data().len())
            .map_err(text)
    },
    || {
        let packed = encode_depth(&depth());
        vec![Bundle::of("depth.tdz", packed)]
    },
)
.words("TDZ1")
.allow(1 << 20, PER_PACKED_BYTE);

/// Positions of the wire: messages of one stream.
pub(super) const POSITIONS: Target = Target::new(
    "position-codec",
    "src/formats/position_codec.rs",
    |b, _| {
        let mut coder = PositionCoder::new(9, &FACES);
        let decoded = b.0.iter().map(|m| coder.decode(&m.bytes).map_err(text));
        Ok(decoded.collect::<Result<Vec<_>, _>>()?.len())
    },
    || {
        let mut coder = PositionCoder::new(9, &FACES);
        let mut bundle = Bundle::default();
        for i in 0..4 {
            let at = |k: usize| P3::new(k as f32 * 0.1, (i * k) as f32 * 0.01, -2.0);
            let positions: Vec<P3> = (0..9).map(at).collect();
            let bytes = coder.encode(&positions).unwrap_or_default();
            bundle = bundle.and(&format!("{i}.bin"), bytes);
        }
        vec![bundle]
    },
)
.allow(1 << 20, 200);

const FACES: [[u32; 3]; 3] = [[0, 1, 2], [3, 4, 5], [6, 7, 8]];

/// PNG as depth and as colour.
pub(super) const PNG: Target = Target::new(
    "png",
    "src/formats/image/png_file.rs",
    |b, _| {
        let at = Path::new("input.png");
        let depth = decode_png_depth(b.first(), at).map(|d| d.data().len());
        let color = decode_png_color(b.first(), at).map(|c| c.data().len());
        depth.or(color).map_err(text)
    },
    || {
        let png = encode_png_depth(&depth(), Path::new("depth.png")).unwrap_or_default();
        vec![
            Bundle::of("depth.png", png),
            Bundle::of("color.png", tiny_png()),
        ]
    },
)
.words("IHDR PLTE IDAT tRNS IEND")
.allow(1 << 20, PER_PACKED_BYTE);

/// JPEG, also behind the choice by signature.
pub(super) const JPEG: Target = Target::new(
    "jpeg",
    "src/formats/image/jpeg.rs, files.rs",
    |b, _| {
        let color = decode_color(b.first(), Path::new("input"));
        let _ = decode_jpeg(b.first());
        color.map(|c| c.data().len()).map_err(text)
    },
    || {
        let image = ColorImage::filled(24, 16, [200, 30, 90]);
        vec![Bundle::of(
            "color.jpg",
            encode_jpeg(&image, 80).unwrap_or_default(),
        )]
    },
)
.words("\u{ff}\u{d8} JFIF Exif\0\0")
.allow(1 << 20, PER_JPEG_BYTE);

fn depth() -> DepthImage {
    let data = (0..16 * 12).map(|i| 900 + i % 50).collect();
    DepthImage::new(16, 12, data).unwrap_or(DepthImage::empty(16, 12))
}

/// A PNG of 8 × 8 pixels.
pub(super) fn tiny_png() -> Vec<u8> {
    encode_png_rgb(&ColorImage::filled(8, 8, [1, 2, 3]), Path::new("color.png")).unwrap_or_default()
}
