//! The person that a garment's file shows in its clothes: taken for the body that the garment was made on.

use super::piece::merge;
use crate::error::MeshGarmentError;
use crate::file_frame::bounds;
use crate::settings::AvatarSettings;
use crate::source_body::SourceBody;
use tryon_formats::mesh_frame::MeshFrame;
use tryon_formats::sewn_obj::SewnObj;
use tryon_garment::import::split;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Topology, TriMesh};

/// A file's person, and the rest.
pub(super) struct DressedAvatar {
    pub(super) body: SourceBody,
    /// Unit and frame of the file.
    pub(super) clothes: SewnObj,
    /// Findings for people.
    pub(super) note: String,
}

impl DressedAvatar {
    /// Takes a file apart; `None` if it shows no person beside its cloth.
    ///
    /// # Errors
    /// A fault of the mesh.
    pub(super) fn find(
        sewn: &SewnObj,
        stated: &MeshFrame,
        settings: &AvatarSettings,
    ) -> Result<Option<Self>, MeshGarmentError> {
        let mut pieces = split(sewn);
        let whole = extent(&sewn.obj.mesh);
        let is_candidate = |p: &SewnObj| is_closed_and_tall(&p.obj.mesh, whole, settings);
        let Some(found) = pieces.iter().position(is_candidate) else {
            return Ok(None);
        };
        if pieces.len() == 1 {
            return Ok(None);
        }
        let avatar = pieces.remove(found).obj.mesh;
        let Some(body) = SourceBody::of_avatar(&avatar, stated, settings)? else {
            return Ok(None);
        };
        let (own, clothes): (Vec<_>, Vec<_>) = pieces
            .into_iter()
            .partition(|p| body.is_part_of_skin(p.obj.mesh.vertices(), settings));
        let Some(clothes) = merge(&clothes) else {
            return Ok(None);
        };
        let note = format!(
            "the file's person of {} vertices and {} parts at its skin is taken for the body, not for cloth",
            avatar.vertices().len(),
            own.len()
        );
        Ok(Some(Self {
            body,
            clothes,
            note,
        }))
    }
}

fn extent(mesh: &TriMesh) -> f32 {
    mesh.bounds().map_or(0.0, |(lo, hi)| (hi - lo).amax())
}

/// True for a mesh nearly as tall as the file without openings that a limb goes through.
fn is_closed_and_tall(mesh: &TriMesh, whole: f32, settings: &AvatarSettings) -> bool {
    let own = extent(mesh);
    if mesh.vertices().len() < settings.vertices || own < settings.tall * whole {
        return false;
    }
    let Ok(topology) = Topology::new(mesh) else {
        return false;
    };
    let x: &[P3] = mesh.vertices();
    let is_small = |l: &Vec<u32>| {
        let (lo, hi) = bounds(l.iter().map(|v| &x[*v as usize]));
        (hi - lo).norm() < settings.opening * own
    };
    topology.boundary_components().iter().all(is_small)
}
