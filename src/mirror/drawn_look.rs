//! The part of a garment's picture that does not change: fabric, print, and places of its surface in the pattern.

use tryon_garment::{PlacedTrim, RenderMesh};
use tryon_view::{Appearance, DrawnTrims, EdgePlace, Print, PrintLayout, ShadedCloth, edge_places};

/// Look of a garment, prepared once.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnLook {
    /// Colour and surface of the fabric.
    pub appearance: Appearance,
    /// Texture coordinates, shape `[drawn vertices]`: the mesh's, moved by panels so that its print meets at seams.
    pub uv: Vec<[f32; 2]>,
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
                uv: mesh.uv.clone(),
                places: Vec::new(),
            };
        }
        let period = appearance.pattern.period();
        let layout = PrintLayout::new(&mesh.faces, &mesh.uv, &mesh.vertex, period);
        let trims = mesh.trims.iter().map(|trim| {
            let by = layout.move_at(&mesh.uv, trim.at);
            PlacedTrim {
                at: [trim.at[0] + by[0], trim.at[1] + by[1]],
                ..*trim
            }
        });
        let cloth = ShadedCloth::named(fabric);
        Self {
            appearance: Appearance {
                trims: DrawnTrims::new(&trims.collect::<Vec<_>>(), cloth.look()),
                cloth: Some(cloth),
                ..appearance
            },
            uv: layout.moved(&mesh.uv),
            places: edge_places(&mesh.faces, &mesh.uv, &mesh.vertex),
        }
    }
}
