//! The part of a garment's picture that does not change: fabric, and places of its surface in the pattern.

use tryon_garment::RenderMesh;
use tryon_view::{Appearance, EdgePlace, Print, ShadedCloth, edge_places};

/// Look of a garment, prepared once.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnLook {
    /// Colour and surface of the fabric.
    pub appearance: Appearance,
    /// Places in the pattern, shape `[drawn vertices]`; empty for a garment with an image of its own, which shows its seams.
    pub places: Vec<EdgePlace>,
}

impl DrawnLook {
    /// Look of a mesh of a fabric by name ([`Material::PRESETS`](tryon_garment::Material::PRESETS)); of another name it is
    /// that of jersey.
    pub fn of(mesh: &RenderMesh, fabric: &str, appearance: Appearance) -> Self {
        if matches!(appearance.pattern, Print::Image(_)) {
            return Self {
                appearance,
                places: Vec::new(),
            };
        }
        Self {
            appearance: Appearance {
                cloth: Some(ShadedCloth::named(fabric)),
                ..appearance
            },
            places: edge_places(&mesh.faces, &mesh.uv, &mesh.vertex),
        }
    }
}
