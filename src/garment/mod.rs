//! A garment before it moves: panels, seams, materials, rest shape, sizes, anchors.
