//! Axis of a posed arm: elbow, wrist and finger tips, and the sleeve around it.

use tryon_geometry::math::{P3, V3};

/// Axis of a posed arm, metres, in the frame of the vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ArmAxis {
    pub(super) elbow: P3,
    pub(super) wrist: P3,
    pub(super) tip: P3,
}

/// Coordinates of a point relative to an [`ArmAxis`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ArmCoordinates {
    /// Along the axis: 0 elbow, 1 wrist, 2 finger tips.
    pub(super) along: f32,
    /// From the axis, metres.
    pub(super) distance: f32,
}

/// Slices of the forearm tested for a sleeve: about five centimetres each, more than a garment's edge length.
const SLICES: usize = 5;
/// Octants around the axis that a sleeve must cover.
const SLEEVE_OCTANTS: u32 = 6;
/// Largest x component of an axis whose cross product with x is well conditioned.
const MAX_PARALLEL: f32 = 0.6;

impl ArmAxis {
    /// Coordinates of the nearest point on the axis.
    #[inline]
    pub(super) fn coordinates(&self, p: &P3) -> ArmCoordinates {
        let project = |a: &P3, b: &P3| {
            let d = b - a;
            let t = ((p - a).dot(&d) / d.norm_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
            (t, (p - (a + d * t)).norm_squared())
        };
        let (s, forearm) = project(&self.elbow, &self.wrist);
        let (t, hand) = project(&self.wrist, &self.tip);
        let (along, squared) = if hand <= forearm {
            (1.0 + t, hand)
        } else {
            (s, forearm)
        };
        ArmCoordinates {
            along,
            distance: squared.sqrt(),
        }
    }

    /// End of the sleeve: 0 at the elbow, 1 at the wrist. A sleeve surrounds the arm; a shirt under an arm lies on one
    /// side of it, or is farther than `radius` (metres) from the axis.
    pub(super) fn sleeve_end(&self, garments: &[P3], radius: f32) -> f32 {
        let forearm = self.wrist - self.elbow;
        let axis = forearm.normalize();
        let helper = if axis.x.abs() < MAX_PARALLEL {
            V3::x()
        } else {
            V3::y()
        };
        let side = axis.cross(&helper).normalize();
        let other = axis.cross(&side);
        let mut octants = [0u8; SLICES];
        for p in garments {
            let d = p - self.elbow;
            let t = d.dot(&axis) / forearm.norm();
            let (x, y) = (d.dot(&side), d.dot(&other));
            if (0.0..1.0).contains(&t) && x * x + y * y < radius * radius {
                let octant = usize::from(x < 0.0) * 4
                    + usize::from(y < 0.0) * 2
                    + usize::from(x.abs() < y.abs());
                octants[(t * SLICES as f32) as usize] |= 1 << octant;
            }
        }
        // From the elbow on: at the wrist a shirt may surround a hand that rests on it.
        let bare = octants.iter().position(|s| s.count_ones() < SLEEVE_OCTANTS);
        bare.map_or(1.0, |k| k as f32 / SLICES as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight() -> ArmAxis {
        let at = |x: f32| P3::new(x, 0.0, 2.0);
        ArmAxis {
            elbow: at(0.0),
            wrist: at(0.25),
            tip: at(0.45),
        }
    }

    #[test]
    fn coordinates_of_points_beside_and_beyond_the_axis() {
        let axis = straight();
        let c = axis.coordinates(&P3::new(0.125, 0.03, 2.0));
        assert!((c.along - 0.5).abs() < 1e-6 && (c.distance - 0.03).abs() < 1e-6);
        let c = axis.coordinates(&P3::new(0.35, 0.0, 2.04));
        assert!((c.along - 1.5).abs() < 1e-5 && (c.distance - 0.04).abs() < 1e-6);
        let c = axis.coordinates(&P3::new(0.55, 0.0, 2.0));
        assert!((c.distance - 0.1).abs() < 1e-6);
    }

    #[test]
    fn a_degenerate_axis_has_finite_coordinates() {
        let p = P3::new(0.1, 0.2, 2.0);
        let axis = ArmAxis {
            elbow: p,
            wrist: p,
            tip: p,
        };
        let c = axis.coordinates(&P3::new(0.1, 0.2, 2.5));
        assert!(c.along == 1.0 && (c.distance - 0.5).abs() < 1e-6);
    }

    #[test]
    fn only_a_tube_around_the_forearm_is_a_sleeve() {
        let axis = straight();
        // A tube down to 0.58 of the forearm, and the half of it on one side.
        let tube: Vec<P3> = (0..160)
            .map(|k| {
                let a = 0.7 * k as f32;
                axis.elbow
                    + V3::new(
                        0.25 * 0.58 * k as f32 / 160.0,
                        0.06 * a.cos(),
                        0.06 * a.sin(),
                    )
            })
            .collect();
        assert_eq!(axis.sleeve_end(&tube, 0.1), 0.6);
        let half: Vec<P3> = tube.into_iter().filter(|p| p.y > 0.0).collect();
        assert_eq!(axis.sleeve_end(&half, 0.1), 0.0);
        assert_eq!(axis.sleeve_end(&[], 0.1), 0.0);
    }
}
