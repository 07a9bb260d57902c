//! Garments from scans: alignment, segmentation, multi-part templates, undressing, retargeting.
