//! Pixels of an Azure Kinect's frames: 16-bit depth, and colour as MJPG, NV12, YUY2 or BGRA.

use crate::image::{decode_jpeg, yuv_to_rgb, yuyv_to_rgb};
use tryon_geometry::camera::{ColorImage, DepthImage};

/// Layout of a depth frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DepthCodec {
    /// `b16g`: big-endian millimetres.
    BigEndian,
    /// `YUY2` of early recorders: little-endian millimetres.
    LittleEndian,
}

impl DepthCodec {
    /// Codec of a four-character code.
    pub(super) fn of(code: &str) -> Option<Self> {
        match code {
            "b16g" => Some(Self::BigEndian),
            "YUY2" => Some(Self::LittleEndian),
            _ => None,
        }
    }

    /// Depth in millimetres.
    pub(super) fn decode(self, bytes: &[u8], (w, h): (u32, u32)) -> Result<DepthImage, String> {
        expect_bytes(bytes, 2 * u64::from(w) * u64::from(h))?;
        let pixel = match self {
            Self::BigEndian => u16::from_be_bytes,
            Self::LittleEndian => u16::from_le_bytes,
        };
        let data = bytes.as_chunks::<2>().0.iter().map(|b| pixel(*b)).collect();
        DepthImage::new(w, h, data).map_err(|e| e.to_string())
    }
}

/// Layout of a colour frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ColorCodec {
    /// A JPEG each.
    Mjpg,
    /// A plane of luma, then one of chroma pairs at half resolution both ways.
    Nv12,
    /// Luma, u, luma, v of two pixels in a row.
    Yuy2,
    /// Blue, green, red, alpha.
    Bgra,
}

impl ColorCodec {
    /// Codec of a four-character code.
    pub(super) fn of(code: &str) -> Option<Self> {
        match code {
            "MJPG" => Some(Self::Mjpg),
            "NV12" => Some(Self::Nv12),
            "YUY2" => Some(Self::Yuy2),
            "BGRA" => Some(Self::Bgra),
            _ => None,
        }
    }

    /// RGB image of this size.
    pub(super) fn decode(self, bytes: &[u8], (w, h): (u32, u32)) -> Result<ColorImage, String> {
        let pixels = u64::from(w) * u64::from(h);
        let chroma = 2 * u64::from(w.div_ceil(2)) * u64::from(h.div_ceil(2));
        let data = match self {
            Self::Mjpg => return jpeg(bytes, (w, h)),
            Self::Nv12 => {
                expect_bytes(bytes, pixels + chroma)?;
                nv12(bytes, w as usize, h as usize)
            }
            Self::Yuy2 => {
                expect_bytes(bytes, 2 * pixels)?;
                yuyv_to_rgb(bytes)
            }
            Self::Bgra => {
                expect_bytes(bytes, 4 * pixels)?;
                bytes
                    .as_chunks::<4>()
                    .0
                    .iter()
                    .map(|[b, g, r, _]| [*r, *g, *b])
                    .collect()
            }
        };
        ColorImage::new(w, h, data.into_flattened()).map_err(|e| e.to_string())
    }
}

fn expect_bytes(bytes: &[u8], expected: u64) -> Result<(), String> {
    if bytes.len() as u64 == expected {
        return Ok(());
    }
    Err(format!("{} bytes, expected {expected}", bytes.len()))
}

fn jpeg(bytes: &[u8], size: (u32, u32)) -> Result<ColorImage, String> {
    let image = decode_jpeg(bytes).map_err(|e| e.to_string())?;
    if (image.width(), image.height()) == size {
        return Ok(image);
    }
    let (w, h) = (image.width(), image.height());
    Err(format!("{w}×{h}, but the track says {}×{}", size.0, size.1))
}

/// Pixels of a luma plane and a plane of chroma pairs, each pair for 2 × 2 pixels.
fn nv12(bytes: &[u8], width: usize, height: usize) -> Vec<[u8; 3]> {
    let (luma, chroma) = bytes.split_at(width * height);
    let row = 2 * width.div_ceil(2);
    let mut out = Vec::with_capacity(width * height);
    for v in 0..height {
        let chroma = &chroma[v / 2 * row..][..row];
        for u in 0..width {
            let pair = u / 2 * 2;
            out.push(yuv_to_rgb(
                luma[v * width + u],
                chroma[pair],
                chroma[pair + 1],
            ));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_is_millimetres_in_either_order() {
        let big = DepthCodec::of("b16g").expect("known");
        let image = big.decode(&[0x04, 0xd2, 0, 0], (2, 1)).expect("decodes");
        assert_eq!(image.data(), [1234, 0]);
        let little = DepthCodec::of("YUY2").expect("known");
        let image = little.decode(&[0xd2, 0x04, 1, 0], (2, 1)).expect("decodes");
        assert_eq!(image.data(), [1234, 1]);
        assert!(
            big.decode(&[0; 3], (2, 1))
                .is_err_and(|e| e.contains("expected 4"))
        );
    }

    /// The colour bars of BT.601 in video range: white, black, red, green, blue.
    #[test]
    fn bars_have_their_colours() {
        for (yuv, expected) in [
            ([235, 128, 128], [255, 255, 255]),
            ([16, 128, 128], [0, 0, 0]),
            ([81, 90, 240], [255, 0, 0]),
            ([145, 54, 34], [0, 255, 0]),
            ([41, 240, 110], [0, 0, 255]),
        ] {
            let [y, u, v] = yuv;
            let near = |image: &ColorImage| {
                let gaps = image.data().iter().zip(expected.iter().cycle());
                gaps.map(|(a, b): (&u8, &u8)| a.abs_diff(*b)).max() <= Some(2)
            };
            let packed = ColorCodec::Yuy2
                .decode(&[y, u, y, v], (2, 1))
                .expect("decodes");
            let planes = ColorCodec::Nv12
                .decode(&[y, y, y, y, u, v], (2, 2))
                .expect("decodes");
            assert!(near(&packed) && near(&planes), "{yuv:?}: {packed:?}");
        }
        // An odd width has a pair of its own for its last column.
        let odd = [16, 16, 235, 128, 128, 128, 128];
        let image = ColorCodec::Nv12.decode(&odd, (3, 1)).expect("decodes");
        assert_eq!(image.at(2, 0), [255; 3]);
        let blue = ColorCodec::Bgra
            .decode(&[200, 100, 50, 255], (1, 1))
            .expect("decodes");
        assert_eq!(blue.data(), [50, 100, 200]);
        assert!(ColorCodec::Nv12.decode(&[0; 5], (2, 2)).is_err());
    }
}
