//! Garments that are draped together.

use super::context::{DrapeContext, OuterGarment};
use super::state::Drape;
use crate::skin::Skin;
use tryon_garment::{GarmentError, GarmentMesh};
use tryon_geometry::par::Par;

/// Garments, innermost first: each is kept under those further out.
#[derive(Debug, Default)]
pub(crate) struct Layers {
    pub(crate) drapes: Vec<Drape>,
    surfaces: Vec<OuterGarment>,
}

impl Layers {
    pub(crate) fn new(meshes: &[GarmentMesh], drapes: Vec<Drape>) -> Result<Self, GarmentError> {
        Ok(Self {
            surfaces: meshes
                .iter()
                .map(OuterGarment::new)
                .collect::<Result<_, _>>()?,
            drapes,
        })
    }
    /// Applies `f` to every garment, the outermost first; `offsets` from the skin (m).
    pub(crate) fn each(
        &mut self,
        skin: &Skin<'_>,
        offsets: &[f64],
        mut f: impl FnMut(usize, &mut Drape, &DrapeContext<'_>),
    ) {
        for (k, drape) in self.drapes.iter_mut().enumerate().rev() {
            let (own, outer) = self.surfaces.split_at_mut(k + 1);
            let context = DrapeContext {
                skin,
                offset: offsets[k],
                outer,
            };
            f(k, drape, &context);
            own[k].frame.vertices = drape.positions();
            own[k].model.update_normals(Par::Rayon, &mut own[k].frame);
        }
    }
}
