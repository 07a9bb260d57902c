//! Garments in other frames, with others in the same file.
