//! Colour of cameras as luma and chroma.

/// RGB of a pixel in ITU-R BT.601 with luma from 16 to 235, as cameras send it.
pub fn yuv_to_rgb(y: u8, u: u8, v: u8) -> [u8; 3] {
    let y = 255.0 / 219.0 * (f32::from(y) - 16.0);
    let [u, v] = [u, v].map(|c| 255.0 / 224.0 * (f32::from(c) - 128.0));
    let rgb = [
        y + 1.402 * v,
        y - 0.344_136 * u - 0.714_136 * v,
        y + 1.772 * u,
    ];
    rgb.map(|c| c.round().clamp(0.0, 255.0) as u8)
}

/// RGB of pairs of pixels that share their chroma: Y, U, Y, V (YUY2).
pub fn yuyv_to_rgb(bytes: &[u8]) -> Vec<[u8; 3]> {
    let pairs = bytes.as_chunks::<4>().0.iter();
    pairs
        .flat_map(|[first, u, second, v]| [first, second].map(|y| yuv_to_rgb(*y, *u, *v)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_of_the_standard_have_their_colours() {
        // ITU-R BT.601: white, black, red, green, blue.
        let bars = [
            ([235, 128, 128], [255, 255, 255]),
            ([16, 128, 128], [0, 0, 0]),
            ([81, 90, 240], [255, 0, 0]),
            ([145, 54, 34], [0, 255, 0]),
            ([41, 240, 110], [0, 0, 255]),
        ];
        for ([y, u, v], want) in bars {
            let got = yuv_to_rgb(y, u, v);
            let off = got.iter().zip(&want).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(off <= Some(2), "{got:?} is no {want:?}");
        }
        assert_eq!(yuyv_to_rgb(&[235, 128, 16, 128]), [[255; 3], [0; 3]]);
    }
}
