//! Part of a glTF model.

use crate::PartName;
use std::ops::Range;

/// One primitive of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfPart {
    /// Names of its node, mesh and material.
    pub names: PartName,
    /// Its faces in the mesh of the model.
    pub faces: Range<usize>,
    /// Base colour, linear RGBA.
    pub color: [f32; 4],
    /// Drawn from both sides.
    pub double_sided: bool,
}
