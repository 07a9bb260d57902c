//! Evidence of one pixel for what is in front: the garment or the captured scene.

use super::config::Margins;
use tryon_geometry::camera::kinect_v1_axial_sigma;

/// Evidence of one pixel, in ascending strength for the captured scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Evidence {
    /// No garment here.
    #[default]
    Outside,
    /// No reading and nothing known.
    Unknown,
    /// The garment is in front.
    Garment,
    /// Something is in front of the garment.
    Front,
    /// Something is clearly in front of the garment.
    ClearFront,
    /// Something is in front of the garment, and the tracked body agrees: an arm.
    Limb,
}

impl Evidence {
    /// Something is in front of the garment.
    #[inline]
    pub(crate) fn is_front(self) -> bool {
        self >= Self::Front
    }
}

/// Depths at one pixel of the drawn area.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelDepths {
    /// Garment depth, metres; infinity = no garment.
    pub(crate) garment: f32,
    /// Garment seen from inside.
    pub(crate) is_inner: bool,
    /// Captured depth, metres; 0 = none.
    pub(crate) captured: f32,
    /// Tracked body's depth, metres; infinity = not on the body.
    pub(crate) body: f32,
    /// A body is tracked.
    pub(crate) is_tracked: bool,
}

/// Standard deviation of captured depth at `z` metres, metres.
pub(crate) fn depth_sigma(z: f32) -> f32 {
    kinect_v1_axial_sigma(z, 0.0)
}

impl Evidence {
    /// Evidence of a single pixel.
    #[inline]
    pub(crate) fn of(m: &Margins, p: &PixelDepths) -> Self {
        if p.garment == f32::INFINITY {
            return Self::Outside;
        }
        let is_limb = p.body < p.garment - m.limb_gap;
        if p.captured <= 0.0 {
            // A sleeve's far end lies behind the tracked arm and beside the real one: colour decides there.
            return if is_limb && !p.is_inner {
                Self::Limb
            } else {
                Self::Unknown
            };
        }
        let margin = if p.is_inner {
            m.inner
        } else if is_limb {
            m.limb
        } else if p.is_tracked && p.body < f32::INFINITY {
            m.covered
        } else {
            m.plain
        };
        let gap = p.garment - p.captured - margin - m.noise_sigmas * depth_sigma(p.captured);
        match () {
            () if gap <= 0.0 => Self::Garment,
            () if is_limb || p.is_inner => Self::Limb,
            () if gap > m.clear => Self::ClearFront,
            () => Self::Front,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn margins_depend_on_body_and_side() {
        let margins = Margins::default();
        let plain = PixelDepths {
            garment: 2.0,
            is_inner: false,
            captured: 2.0,
            body: f32::INFINITY,
            is_tracked: false,
        };
        let of = |p: PixelDepths| Evidence::of(&margins, &p);
        let at = |gap: f32| 2.0 - gap - margins.noise_sigmas * depth_sigma(2.0 - gap);
        assert_eq!(of(plain), Evidence::Garment);
        let captured = at(margins.plain + 0.5 * margins.clear);
        assert_eq!(of(PixelDepths { captured, ..plain }), Evidence::Front);
        let under = PixelDepths {
            captured,
            body: 2.01,
            is_tracked: true,
            ..plain
        };
        assert_eq!(of(under), Evidence::Garment);
        assert_eq!(of(PixelDepths { body: 1.9, ..under }), Evidence::Limb);
        let inner = PixelDepths {
            captured,
            is_inner: true,
            ..plain
        };
        assert_eq!(of(inner), Evidence::Limb);
        let captured = at(margins.plain + 2.0 * margins.clear);
        assert_eq!(of(PixelDepths { captured, ..plain }), Evidence::ClearFront);
    }

    #[test]
    fn without_a_reading_only_the_tracked_arm_is_evidence() {
        let hole = PixelDepths {
            garment: 2.0,
            is_inner: false,
            captured: 0.0,
            body: 1.9,
            is_tracked: true,
        };
        let of = |p: PixelDepths| Evidence::of(&Margins::default(), &p);
        assert_eq!(of(hole), Evidence::Limb);
        assert_eq!(
            of(PixelDepths {
                is_inner: true,
                ..hole
            }),
            Evidence::Unknown
        );
        assert_eq!(of(PixelDepths { body: 2.0, ..hole }), Evidence::Unknown);
        let garment = f32::INFINITY;
        assert_eq!(of(PixelDepths { garment, ..hole }), Evidence::Outside);
    }
}
