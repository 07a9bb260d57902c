//! Rectangles of charts in one image: rows of falling height.

/// Places of some rectangles in an image, and its height; sizes in texels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Packing {
    /// Upper left corner of each rectangle, shape `[rectangles]`.
    pub(super) corners: Vec<[u32; 2]>,
    pub(super) height: u32,
}

/// Packs rectangles into rows of `width`; `None` if one is wider.
pub(super) fn packed(sizes: &[[u32; 2]], width: u32) -> Option<Packing> {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|k| (std::cmp::Reverse(sizes[*k][1]), *k));
    let mut corners = vec![[0; 2]; sizes.len()];
    let (mut left, mut top, mut row) = (0, 0, 0);
    for k in order {
        let [w, h] = sizes[k];
        if w > width {
            return None;
        }
        if left + w > width {
            (left, top, row) = (0, top + row, 0);
        }
        corners[k] = [left, top];
        left += w;
        row = row.max(h);
    }
    Some(Packing {
        corners,
        height: top + row,
    })
}
