//! Colours of the tracked body's parts in the captured picture, and the skin classifier fitted to them.

use crate::area::NEAR;
use crate::arm::ArmAxis;
use crate::captured_pixels::CapturedPixels;
use crate::evidence::depth_sigma;
use crate::limbs::Limbs;
use crate::settings::BareArmSettings;
use crate::skin::SkinClassifier;
use crate::state::{ColorRegion, State};
use tryon_geometry::math::P3;

/// Posed body in the picture's camera, metres.
pub(crate) struct PosedLimbs<'a> {
    pub(crate) limbs: &'a Limbs,
    pub(crate) vertices: &'a [P3],
}

impl CapturedPixels<'_> {
    /// Colour at `p` if the captured surface there and around it is the body's, within `tolerance` metres; around it at `radius` depth pixels.
    fn color(&self, p: &P3, tolerance: f32, radius: f64) -> Option<[u8; 3]> {
        if p.z.is_nan() || p.z <= NEAR {
            return None;
        }
        let q = self.viewport.camera.project(p);
        let away = (radius * self.viewport.pixels_per_depth()) as f32;
        let is_inside = |x: f32, side: u32| x >= away && x + away + 1.0 < side as f32;
        if !is_inside(q.x, self.image.width()) || !is_inside(q.y, self.image.height()) {
            return None;
        }
        let is_body = |(dx, dy): (f32, f32)| {
            let (u, v) = (q.x + dx * away + 0.5, q.y + dy * away + 0.5);
            let z = self.metres(u as u32, v as u32);
            z > 0.0 && (z - p.z).abs() < tolerance + depth_sigma(z)
        };
        let around = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
        (around.into_iter().all(is_body))
            .then(|| self.image.at((q.x + 0.5) as u32, (q.y + 0.5) as u32))
    }
}

/// Samples this picture's colours into `state` and fits the classifier; `None` if colour does not separate skin.
pub(super) fn sample_and_fit(
    state: &mut State,
    view: &CapturedPixels<'_>,
    body: &PosedLimbs<'_>,
    axes: &[Option<ArmAxis>; 2],
    settings: &BareArmSettings,
) -> Option<SkinClassifier> {
    let is_by_arm = |p: &P3| {
        let mut axes = axes.iter().flatten();
        axes.any(|a| a.coordinates(p).distance < settings.arm_clearance)
    };
    let mut sample = |region: ColorRegion, vertices: &[u32], tolerance: f32| {
        let due: Vec<(usize, u32)> = state.due(region, vertices).collect();
        for (slot, v) in due {
            let p = &body.vertices[v as usize];
            if region == ColorRegion::Trunk && is_by_arm(p) {
                continue;
            }
            if let Some(rgb) = view.color(p, tolerance, settings.sample_radius) {
                state.put(region, slot, rgb);
            }
        }
    };
    let [left, right] = &body.limbs.arms;
    let forearms = [&left.forearm[..], &right.forearm].concat();
    let hands = [&left.hand[..], &right.hand].concat();
    sample(ColorRegion::Forearm, &forearms, settings.limb_tolerance);
    sample(ColorRegion::Hand, &hands, settings.limb_tolerance);
    sample(ColorRegion::Face, &body.limbs.face, settings.limb_tolerance);
    sample(
        ColorRegion::Trunk,
        &body.limbs.trunk,
        settings.trunk_tolerance,
    );
    state.fit_skin(&settings.skin)
}
