//! Motion of a garment with the body between two poses.

use super::state::{Drape, on_arms};
use crate::skin::Skin;
use tryon_cloth::AnchorBinding;
use tryon_cloth::contact::SurfaceFrame;
use tryon_geometry::math::{P3, V3, V3d};

impl Drape {
    /// Pins the rigid anchors to the body of `frame`.
    pub(crate) fn pin(&mut self, anchors: &[AnchorBinding], frame: &SurfaceFrame) {
        self.pinned.fill(None);
        for a in anchors.iter().filter(|a| a.strength >= 1.0) {
            let [p, q, r] = a.body.map(|v| frame.vertices[v as usize].coords);
            let on = p * a.weights[0] + q * a.weights[1] + r * a.weights[2];
            let normal = (q - p)
                .cross(&(r - p))
                .try_normalize(0.0)
                .unwrap_or_else(V3::zeros);
            self.pinned[a.vertex as usize] = Some((on + normal * a.height).cast());
        }
    }
    /// Moves cloth near the skin with a body that goes from `from` to `to` (m).
    pub(crate) fn follow_skin(&mut self, from: &[P3], to: &[P3]) {
        let settings = self.settings.follow;
        for ((x, near), own) in self.x.iter_mut().zip(&self.nearest).zip(&self.own) {
            let v = near[0] as usize;
            let d = (from[v].coords.cast::<f64>() - *x).norm();
            let within = if on_arms(*own) {
                settings.sleeve_within
            } else {
                settings.within
            };
            let share = (2.0 - d / within).clamp(0.0, 1.0);
            *x += (to[v] - from[v]).cast::<f64>() * share;
        }
    }
    /// Puts rings of sleeves that lost their arm around it again.
    pub(crate) fn recover_sleeves(&mut self, skin: &Skin<'_>) {
        let lines = skin.arm_lines();
        let at = |v: u32| self.point(v as usize);
        let targets: Vec<(u32, P3)> = self
            .sleeves
            .iter()
            .flat_map(|s| s.lost_rings(&lines, at))
            .flat_map(|f| f.vertices.iter().map(move |v| (*v, f.recovery * at(*v))))
            .collect();
        for (v, to) in targets {
            let i = v as usize;
            self.x[i] = to.coords.cast();
            self.velocity[i] = V3d::zeros();
            self.nearest[i][0] = skin.model.nearest_vertex(skin.frame(), &to, self.own[i]);
        }
    }
}
