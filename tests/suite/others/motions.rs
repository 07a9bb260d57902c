//! Motions of other programs.
