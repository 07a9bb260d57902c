//! Garments that are draped together.

use super::context::{DrapeContext, OuterGarment};
use super::state::Drape;
use crate::dressing::skin::Skin;
use crate::garment::{GarmentError, GarmentMesh};
use crate::par::Par;

/// Garments, innermost first: each is kept under those further out.
#[derive(Debug, Default)]
pub(in crate::dressing) struct Layers {
    pub(in crate::dressing) drapes: Vec<Drape>,
    surfaces: Vec<OuterGarment>,
}

impl Layers {
    pub(in crate::dressing) fn new(
        meshes: &[GarmentMesh],
        drapes: Vec<Drape>,
    ) -> Result<Self, GarmentError> {
        Ok(Self {
            surfaces: meshes
                .iter()
                .map(OuterGarment::new)
                .collect::<Result<_, _>>()?,
            drapes,
        })
    }
    /// Applies `f` to every garment, the outermost first; `offsets` from the skin (m).
    pub(in crate::dressing) fn each(
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
