//! Anchors of the detector: the cells of its feature maps.

use crate::network::DETECTOR_PIXELS;

/// Pixels of the input between the cells of each feature map, and how many anchors a cell has.
///
/// Of MediaPipe's graph `pose_detection`: strides of five layers, 8, 16, 32, 32 and 32, with two anchors of the same size each.
const LAYERS: [(usize, usize); 3] = [(8, 2), (16, 2), (32, 6)];

/// Number of anchors.
pub(crate) const ANCHORS: usize = 2254;

/// Centres of all anchors, in the detector's order: columns and rows, shares of the input.
pub(crate) fn anchors() -> Vec<[f32; 2]> {
    let mut anchors = Vec::with_capacity(ANCHORS);
    for (stride, of_a_cell) in LAYERS {
        let cells = DETECTOR_PIXELS / stride;
        let centre = |k: usize| (k as f32 + 0.5) / cells as f32;
        for (row, column) in (0..cells).flat_map(|row| (0..cells).map(move |column| (row, column)))
        {
            anchors.extend(std::iter::repeat_n(
                [centre(column), centre(row)],
                of_a_cell,
            ));
        }
    }
    anchors
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anchors_are_the_cells_of_three_maps() {
        let anchors = anchors();
        assert_eq!(anchors.len(), ANCHORS);
        assert_eq!(anchors[0], [0.5 / 28.0; 2]);
        assert_eq!(anchors[1], anchors[0]);
        assert_eq!(anchors[2], [1.5 / 28.0, 0.5 / 28.0]);
        assert_eq!(anchors[2 * 28 * 28], [0.5 / 14.0; 2]);
        assert_eq!(anchors[2253], [6.5 / 7.0; 2]);
    }
}
