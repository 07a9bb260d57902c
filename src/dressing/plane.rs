//! Contact plane of one vertex of a garment being draped.

use super::settings::DrapeContactSettings;
use tryon_geometry::math::V3d;

/// Half-space constraint n · (x − point) ≥ height, metres.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DrapePlane {
    pub(super) point: V3d,
    pub(super) normal: V3d,
    pub(super) height: f64,
    /// Near enough to constrain the vertex.
    pub(super) near: bool,
}

impl DrapePlane {
    /// Keeps cloth between two facing skins on its own half: sleeve and trunk are pressed together as the arms go down.
    ///
    /// `room`: clearance between the skins; `far`: distance of `x` from each, metres. Returns `false`, and changes
    /// nothing, where the skins do not face each other.
    pub(super) fn keep_half(
        &mut self,
        other: &mut Self,
        x: &V3d,
        far: [f64; 2],
        room: f64,
        settings: &DrapeContactSettings,
    ) -> bool {
        let (facing, halved, half_gap) = (settings.facing, settings.halved, settings.half_gap);
        let away = other.normal - self.normal;
        let steep = away.norm();
        let faces = steep > facing && far[0] < halved && far[1] < 2.0 * halved;
        if faces {
            let gap = half_gap.min(0.25 * room);
            // The point as far from either skin.
            other.point = x - away * ((far[1] - far[0]) / (steep * steep));
            other.normal = away / steep;
            other.height = gap;
            self.height = self.height.min(0.5 * room - gap);
        }
        faces
    }
}
