//! Dihedral angle of two triangles on an edge, with its derivative.
//!
//! With the edge e = x₁ − x₀, the wings a = x₂ − x₀ and b = x₃ − x₀ and their normals m = e × a, n = b × e, the angle is
//! atan2(ê · (m × n), m · n): zero when flat, positive when the wings fold away from their normals.
//! ∂θ/∂a = −|e| m/|m|² and ∂θ/∂b = −|e| n/|n|²; moving e turns both wings, by the fractions α = a·e/|e|² and β = b·e/|e|²
//! of what moving the apices does: ∂θ/∂e = −α ∂θ/∂a − β ∂θ/∂b.

use nalgebra::SVector;
use std::f64::consts::{FRAC_PI_2, TAU};
use tryon_geometry::math::V3d;

/// Angle of a hinge with its derivative by the stacked corners (edge start, edge end, left apex, right apex).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dihedral {
    /// Angle (rad) in (−π, π], beyond where it is a continued one.
    pub angle: f64,
    /// Derivative (rad/m).
    pub gradient: SVector<f64, 12>,
}

/// Positions of a sheet, and those from where it moved there.
#[derive(Clone, Copy, Debug)]
pub struct SheetMotion<'a> {
    /// Positions at the start (m): they tell a fold beyond π from one to the other side.
    pub start: &'a [V3d],
    /// Positions now (m).
    pub now: &'a [V3d],
    /// Vertices that stay where they are, at least; empty for none. Elements of these alone are left out.
    pub asleep: &'a [bool],
    /// Length of the step (s), infinite for sheets outside time.
    pub step: f64,
}

impl<'a> SheetMotion<'a> {
    /// Sheet that has not moved: angles lie in (−π, π].
    pub fn still(x: &'a [V3d]) -> Self {
        Self::moved(x, x)
    }
    /// Sheet that moved, all of it, outside time.
    pub fn moved(start: &'a [V3d], now: &'a [V3d]) -> Self {
        Self {
            start,
            now,
            asleep: &[],
            step: f64::INFINITY,
        }
    }
    /// True for an element that is left out; a corner that it lacks, beyond all vertices, keeps nothing awake.
    pub fn is_asleep(&self, vertices: &[u32]) -> bool {
        let sleeps = |v: &u32| self.asleep.get(*v as usize).copied().unwrap_or(true);
        !self.asleep.is_empty() && vertices.iter().all(sleeps)
    }
    /// Corners of a hinge at the start and now.
    pub(super) fn corners(&self, vertices: &[u32; 4]) -> [[V3d; 4]; 2] {
        [self.start, self.now].map(|x| vertices.map(|v| x[v as usize]))
    }
}

/// `angle` (rad), or the turn beside it that is nearest to the angle at the start.
///
/// Folded flat, both sides of ±π are neighbours: without this the energy of a fan of hinges jumps there, and no step is
/// short enough to lower it. Contact keeps most hinges from passing, but not those whose wings are sewn together.
fn continued(angle: f64, start: &[V3d; 4]) -> f64 {
    if angle.abs() < FRAC_PI_2 {
        return angle;
    }
    let turns = (Wings::new(start).angle() - angle) / TAU;
    angle + turns.round() * TAU
}

/// Least squared double area of a wing over the fourth power of the edge: below it the angle has no derivative, and the
/// derivative stays finite.
const SLIVER: f64 = 1e-16;

/// Hinge by its edge and wings.
struct Wings {
    e: V3d,
    arms: [V3d; 2],
    length: f64,
    /// Normals m and n and their squared lengths, not below the sliver's.
    normals: [V3d; 2],
    squared: [f64; 2],
}

impl Wings {
    fn new(x: &[V3d; 4]) -> Self {
        let (e, a, b) = (x[1] - x[0], x[2] - x[0], x[3] - x[0]);
        let length = e.norm().max(f64::MIN_POSITIVE.sqrt());
        let normals = [e.cross(&a), b.cross(&e)];
        let least = (SLIVER * length.powi(4)).max(f64::MIN_POSITIVE.sqrt());
        Self {
            e,
            arms: [a, b],
            length,
            normals,
            squared: normals.map(|n| n.norm_squared().max(least)),
        }
    }
    fn angle(&self) -> f64 {
        let [m, n] = &self.normals;
        let sine = self.e.dot(&m.cross(n)) / self.length;
        sine.atan2(m.dot(n))
    }
    /// Derivatives by the arms.
    fn by_arms(&self) -> [V3d; 2] {
        [0, 1].map(|k| self.normals[k] * (-self.length / self.squared[k]))
    }
    /// Positions of the apices along the edge, as fractions of it.
    fn fractions(&self) -> [f64; 2] {
        [0, 1].map(|k| self.arms[k].dot(&self.e) / self.length.powi(2))
    }
}

impl Dihedral {
    /// Angle (rad) of the hinge.
    pub fn angle(x: &[V3d; 4]) -> f64 {
        Wings::new(x).angle()
    }
    /// Angle (rad) of a hinge that moved from `start` to `now`, beyond ±π where it passed that.
    pub fn continued_angle([start, now]: &[[V3d; 4]; 2]) -> f64 {
        continued(Wings::new(now).angle(), start)
    }
    /// [`Self::continued_angle`] and its gradient.
    pub fn continued([start, now]: &[[V3d; 4]; 2]) -> Self {
        let principal = Self::new(now);
        Self {
            angle: continued(principal.angle, start),
            ..principal
        }
    }
    /// Angle and gradient.
    pub fn new(x: &[V3d; 4]) -> Self {
        let w = Wings::new(x);
        let ([ga, gb], [alpha, beta]) = (w.by_arms(), w.fractions());
        let ge = -ga * alpha - gb * beta;
        let mut gradient = SVector::<f64, 12>::zeros();
        for (k, g) in [-ge - ga - gb, ge, ga, gb].iter().enumerate() {
            gradient.fixed_rows_mut::<3>(3 * k).copy_from(g);
        }
        Self {
            angle: w.angle(),
            gradient,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::math::derivative_check::{DerivativeCheck, Derivatives};

    /// Folded through itself, an angle goes on beyond π instead of turning into its opposite.
    #[test]
    fn angles_continue_through_a_flat_fold() {
        let corners = |angle: f64| corners(&bent(angle));
        let base = Dihedral::angle(&corners(3.0));
        for side in [1.0, -1.0] {
            let start = corners(side * 3.0);
            for step in 0..8 {
                let turned = 0.05 * f64::from(step);
                let motion = [start, corners(side * (3.0 + turned))];
                let expected = side * (base.abs() + turned);
                let angle = Dihedral::continued_angle(&motion);
                assert!(
                    (angle.abs() - expected.abs()).abs() < 1e-9,
                    "{angle} {expected}"
                );
                assert_eq!(angle.signum(), Dihedral::angle(&start).signum());
                assert_eq!(Dihedral::continued(&motion).angle, angle);
            }
        }
        // Nothing is added where the hinge is open, whatever it was.
        let open = [corners(-3.0), corners(0.4)];
        assert_eq!(Dihedral::continued_angle(&open), Dihedral::angle(&open[1]));
    }

    /// Irregular hinge whose right wing is lifted towards the normals by an angle.
    fn bent(angle: f64) -> Vec<f64> {
        let (s, c) = f64::sin_cos(angle);
        let corners = [
            [0.0, 0.0, 0.0],
            [1.1, 0.0, 0.0],
            [0.3, 0.7, 0.0],
            [0.8, -0.5 * c, 0.5 * s],
        ];
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -0.8, 2.0);
        corners
            .iter()
            .flat_map(|p| {
                let p = turn * V3d::from_column_slice(p);
                [p.x, p.y, p.z]
            })
            .collect()
    }

    fn corners(x: &[f64]) -> [V3d; 4] {
        [0, 1, 2, 3].map(|k| V3d::from_column_slice(&x[3 * k..3 * k + 3]))
    }

    #[test]
    fn derivatives_agree_with_differences_at_any_angle() {
        let evaluate = |x: &[f64], weight: f64| {
            let d = Dihedral::new(&corners(x));
            let gradient = (d.gradient * weight).as_slice().to_vec();
            Derivatives::energy(d.angle * weight, gradient)
        };
        let check = DerivativeCheck::default();
        check.run(&[-2.9, -1.0, -1e-3, 0.0, 0.4, 1.5, 3.0].map(bent), evaluate);
        // Without area, without length, folded flat.
        let mut sliver = bent(0.3);
        sliver.copy_within(0..3, 6);
        check.run_degenerate(
            &[sliver, vec![0.0; 12], bent(std::f64::consts::PI)],
            evaluate,
        );
    }

    #[test]
    fn angle_is_that_between_the_wings() {
        for angle in [-3.1, -0.7, 0.0, 1e-9, 0.5, 2.0, 3.1] {
            assert!((Dihedral::angle(&corners(&bent(angle))) + angle).abs() < 1e-12);
        }
    }
}
