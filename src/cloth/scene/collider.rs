//! Spheres and capsules with sampled motion.

use nalgebra::Isometry3;
use tryon_geometry::math::V3d;

/// A convex solid around the origin of its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Primitive {
    /// Ball.
    Sphere {
        /// Radius (m).
        radius: f64,
    },
    /// Ball swept along the frame's y axis.
    Capsule {
        /// Radius (m).
        radius: f64,
        /// Half the length of the axis (m).
        half_segment: f64,
    },
}

impl Primitive {
    /// Signed distance (negative inside) (m) and outward normal at a point of the solid's frame.
    pub fn distance(&self, p: &V3d) -> (f64, V3d) {
        let (radius, axis_point) = match self {
            Self::Sphere { radius } => (*radius, V3d::zeros()),
            Self::Capsule {
                radius,
                half_segment,
            } => (
                *radius,
                V3d::new(0.0, p.y.clamp(-half_segment, *half_segment), 0.0),
            ),
        };
        let d = p - axis_point;
        let n = d.norm();
        // On the axis every direction is as near.
        let normal = if n > 0.0 { d / n } else { V3d::x() };
        (n - radius, normal)
    }
}

/// A solid with its motion.
#[derive(Clone, Debug)]
pub struct Collider {
    /// Shape.
    pub shape: Primitive,
    /// Coulomb coefficient.
    pub friction: f64,
    /// Times (s) and placements, in order; one entry stands still.
    pub motion: Vec<(f64, Isometry3<f64>)>,
}

impl Collider {
    /// Placement at time `t` (s): interpolated between samples, constant beyond them.
    pub fn placement(&self, t: f64) -> Isometry3<f64> {
        let after = self.motion.partition_point(|(time, _)| *time <= t);
        match (
            after.checked_sub(1).map(|i| &self.motion[i]),
            self.motion.get(after),
        ) {
            (Some((t0, a)), Some((t1, b))) => {
                let s = (t - t0) / (t1 - t0);
                a.try_lerp_slerp(b, s, f64::EPSILON).unwrap_or(*a)
            }
            (Some((_, a)), None) | (None, Some((_, a))) => *a,
            (None, None) => Isometry3::identity(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_has_its_closed_form() {
        let c = Primitive::Capsule {
            radius: 0.1,
            half_segment: 0.4,
        };
        let (d, n) = c.distance(&V3d::new(0.3, 0.2, 0.0));
        assert!((d - 0.2).abs() < 1e-12 && (n - V3d::x()).norm() < 1e-12);
        let (d, n) = c.distance(&V3d::new(0.0, 0.9, 0.0));
        assert!((d - 0.4).abs() < 1e-12 && (n - V3d::y()).norm() < 1e-12);
        assert!((c.distance(&V3d::zeros()).0 + 0.1).abs() < 1e-12);
        assert!(c.distance(&V3d::zeros()).1.norm() > 0.99);
    }

    #[test]
    fn placement_is_interpolated_and_constant_beyond_its_samples() {
        let at = |x: f64| Isometry3::translation(x, 0.0, 0.0);
        let c = Collider {
            shape: Primitive::Sphere { radius: 1.0 },
            friction: 0.0,
            motion: vec![(0.0, at(0.0)), (1.0, at(2.0))],
        };
        for (t, x) in [(-1.0, 0.0), (0.25, 0.5), (1.0, 2.0), (9.0, 2.0)] {
            assert!((c.placement(t).translation.x - x).abs() < 1e-12, "t = {t}");
        }
    }
}
