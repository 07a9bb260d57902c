//! Surroundings of one garment that is being draped.

use crate::skin::Skin;
use tryon_cloth::contact::{SurfaceFrame, SurfaceModel};
use tryon_garment::{GarmentError, GarmentMesh};

/// A garment that others are worn under.
#[derive(Debug)]
pub(super) struct OuterGarment {
    pub(super) model: SurfaceModel,
    pub(super) frame: SurfaceFrame,
}

impl OuterGarment {
    pub(super) fn new(mesh: &GarmentMesh) -> Result<Self, GarmentError> {
        let parts = mesh.regions.iter().map(|r| r.decisive().0).collect();
        Ok(Self {
            model: SurfaceModel::new(mesh.faces.clone(), mesh.topology()?, parts),
            frame: SurfaceFrame::default(),
        })
    }
}

/// Skin below and garments above.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DrapeContext<'a> {
    pub(super) skin: &'a Skin<'a>,
    /// Distance from the skin (m).
    pub(super) offset: f64,
    /// Garments further out.
    pub(super) outer: &'a [OuterGarment],
}
