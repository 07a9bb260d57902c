//! Contact plane of one vertex of a garment being draped.

use tryon_geometry::math::V3d;

/// Length of the difference of two skins' normals from which they face each other: √2 at a right angle.
const FACING: f64 = 1.41;
/// Distance from its own skin beyond which cloth may lie on the other half, metres: a shirt hangs beside a forearm.
const HALVED: f64 = 0.06;
/// Distance of either layer from the middle plane, metres: half of that between two layers on the skin.
const HALF_GAP: f64 = 0.00125;

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
    ) -> bool {
        let away = other.normal - self.normal;
        let steep = away.norm();
        let facing = steep > FACING && far[0] < HALVED && far[1] < 2.0 * HALVED;
        if facing {
            let gap = HALF_GAP.min(0.25 * room);
            // The point as far from either skin.
            other.point = x - away * ((far[1] - far[0]) / (steep * steep));
            other.normal = away / steep;
            other.height = gap;
            self.height = self.height.min(0.5 * room - gap);
        }
        facing
    }
}
