//! The captured image and the garments in one picture: visibility, shading, edges.
