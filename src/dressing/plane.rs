//! What a vertex of a garment that is put on stays above.

use crate::math::V3d;

/// Skins face each other where the difference of their normals is longer than this: at a right angle √2.
const FACING: f64 = 1.41;
/// Cloth further from its own skin than this may hang on the other half, metres: a shirt hangs beside a forearm.
const HALVED: f64 = 0.06;
/// Distance of either layer from the middle, metres: half of that between two layers on the skin.
const HALF_GAP: f64 = 0.00125;

/// A plane a vertex stays above.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plane {
    pub(super) point: V3d,
    pub(super) normal: V3d,
    pub(super) height: f64,
    pub(super) near: bool,
}

impl Plane {
    /// Between skins that face each other with `room` between them, `far` metres from `x`, cloth stays on its own half:
    /// sleeves and the trunk of a shirt press on each other as the arms go down. Says whether that is so.
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
            // Where it would be as far from either.
            other.point = x - away * ((far[1] - far[0]) / (steep * steep));
            other.normal = away / steep;
            other.height = gap;
            self.height = self.height.min(0.5 * room - gap);
        }
        facing
    }
}
