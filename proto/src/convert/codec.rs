//! Compression of the images of a frame.

use super::WireError;
use bytes::Bytes;
use tryon_formats::image;
use tryon_geometry::camera::{ColorImage, DepthImage, Intrinsics};

/// JPEG quality of frames on the bus: 35 kB at 640×480 without visible blocks; 60 kB at 90.
const BUS_JPEG_QUALITY: u8 = 80;

pub(super) fn depth(b: &Bytes, k: &Intrinsics) -> Result<DepthImage, WireError> {
    let img =
        image::decode_depth(b).map_err(|e| WireError::new("rgbd_frame.depth", e.to_string()))?;
    same_size("rgbd_frame.depth", img.width(), img.height(), k)?;
    Ok(img)
}

pub(super) fn color(b: &Bytes, k: &Intrinsics) -> Result<ColorImage, WireError> {
    let img = image::decode_jpeg(b)
        .map_err(|e| WireError::new("rgbd_frame.color_jpeg", e.to_string()))?;
    same_size("rgbd_frame.color_jpeg", img.width(), img.height(), k)?;
    Ok(img)
}

fn same_size(field: &str, w: u32, h: u32, k: &Intrinsics) -> Result<(), WireError> {
    if (w, h) == (k.width, k.height) {
        return Ok(());
    }
    Err(WireError::new(
        field,
        format!("{w}×{h}, but the calibration says {}×{}", k.width, k.height),
    ))
}

pub(super) fn depth_to_wire(d: &DepthImage) -> Bytes {
    image::encode_depth(d).into()
}

pub(super) fn color_to_wire(c: &ColorImage) -> Result<Bytes, WireError> {
    let jpeg = image::encode_jpeg(c, BUS_JPEG_QUALITY);
    Ok(jpeg
        .map_err(|e| WireError::new("rgbd_frame.color_jpeg", e.to_string()))?
        .into())
}
