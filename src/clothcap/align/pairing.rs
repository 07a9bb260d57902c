//! Pairs of scan points and surface points, by distance and direction of their normals.

use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::face_normal;
use tryon_geometry::spatial::{Bvh, SurfacePoint};

/// Normal of a scan point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanNormal {
    /// Unit vector; zero if unknown.
    pub(crate) normal: V3,
    /// Points outwards; else of either sign.
    pub(crate) oriented: bool,
}

impl ScanNormal {
    /// Agrees with a unit normal of the surface to the least cosine; an unknown normal agrees with any.
    pub(crate) fn agrees(&self, surface: &V3, least: f32) -> bool {
        let cos = surface.dot(&self.normal);
        let cos = if self.oriented { cos } else { cos.abs() };
        self.normal == V3::zeros() || cos >= least
    }
}

/// Surface point closest to a scan point, and the unit normal of its face; `None` if the normals differ.
pub(crate) fn closest_facing(
    (bvh, surface): (&Bvh, &[P3]),
    point: &P3,
    normal: ScanNormal,
    least: f32,
) -> Option<(SurfacePoint, V3)> {
    let found = bvh.closest(surface, point)?;
    facing((bvh, surface), found, normal, least)
}

/// A point of the surface and the unit normal of its face; `None` if it differs.
pub(super) fn facing(
    (bvh, surface): (&Bvh, &[P3]),
    found: SurfacePoint,
    normal: ScanNormal,
    least: f32,
) -> Option<(SurfacePoint, V3)> {
    let face = &bvh.faces()[found.face as usize];
    let own = face_normal(surface, face).try_normalize(f32::MIN_POSITIVE)?;
    normal.agrees(&own, least).then_some((found, own))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_of_either_sign_and_unknown_ones_agree() {
        let up = V3::z();
        let agrees = |normal, oriented| ScanNormal { normal, oriented }.agrees(&up, 0.2);
        assert!(agrees(up, true) && !agrees(-up, true) && agrees(-up, false));
        assert!(!agrees(V3::x(), false) && agrees(V3::zeros(), true));
    }
}
