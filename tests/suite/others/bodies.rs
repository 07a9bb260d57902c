//! Bodies of other programs.
