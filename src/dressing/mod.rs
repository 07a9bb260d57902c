//! A garment onto a body: panel placement, sewing, size choice, first drape, fit map.
