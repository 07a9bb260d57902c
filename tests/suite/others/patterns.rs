//! Sewing patterns of other programs.
