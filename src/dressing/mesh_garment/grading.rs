//! Grading of rest triangles: stretched around and along the limb that they lie over, by the steps of the size table.

use nalgebra::{Matrix2, Matrix3x2, Vector2};
use tryon_body::Template;
use tryon_garment::SizeRow;
use tryon_geometry::math::{P3, V3d};

/// Trunk, left arm, right arm, left leg, right leg.
pub(super) const LIMBS: usize = 5;

/// Share of each limb in a point of cloth; they sum to one.
pub(super) type LimbShares = [f64; LIMBS];

/// Limbs of a body at rest.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LimbAxes {
    /// Directions, unit vectors.
    axes: [V3d; LIMBS],
    /// Limb of each joint.
    of_joint: Vec<u8>,
}

impl LimbAxes {
    /// Limbs of a template; one whose joints are missing is vertical.
    pub(super) fn new(template: &Template) -> Self {
        let sk = template.skeleton();
        let at = |name: String| sk.index(&name).map(|j| sk.joints()[j].rest);
        let axis = |side: &str, [from, to]: [&str; 2]| {
            let ends = (at(format!("{side}_{from}")), at(format!("{side}_{to}")));
            let along = ends.0.zip(ends.1).map(|(a, b)| b - a);
            along
                .and_then(|d| d.try_normalize(1e-6))
                .unwrap_or(V3d::y())
        };
        let (arm, leg) = (["shoulder", "wrist"], ["hip", "ankle"]);
        let parts = template.parts();
        let limb = |j: usize| {
            let segment = parts.segment(j);
            let first = match (segment.is_arm(), segment.is_leg()) {
                (true, _) => 1,
                (_, true) => 3,
                _ => return 0,
            };
            let is_right = parts.side(j) == Some(tryon_body::parts::BodySide::Right);
            first + u8::from(is_right)
        };
        Self {
            axes: [
                V3d::y(),
                axis("left", arm),
                axis("right", arm),
                axis("left", leg),
                axis("right", leg),
            ],
            of_joint: (0..sk.len()).map(limb).collect(),
        }
    }

    /// Shares of the limbs in a point with these joint weights, shape `[joints]`.
    pub(super) fn shares(&self, joints: &[f32]) -> LimbShares {
        let mut out = [0.0; LIMBS];
        for (limb, w) in self.of_joint.iter().zip(joints) {
            out[usize::from(*limb)] += f64::from(*w);
        }
        let sum: f64 = out.iter().sum();
        out.map(|w| w / sum.max(f64::MIN_POSITIVE))
    }
}

/// Grade from one size to another.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grading<'a> {
    /// Limbs of the body that the garment was made on.
    pub(super) limbs: &'a LimbAxes,
    /// Heights of hip, waist, chest and shoulders (m, ascending), and the scale of girths there.
    pub(super) girths: [(f64, f64); 4],
    /// Rows of the garment's own size and of the wanted one.
    pub(super) rows: [SizeRow; 2],
}

impl Grading<'_> {
    /// Scale of the girth of trunk and legs at a height (m); constant below the hip and above the shoulders.
    fn girth(&self, y: f64) -> f64 {
        let within = |w: &&[(f64, f64)]| y < w[1].0;
        let Some([(low, a), (high, b)]) = self.girths.windows(2).find(within) else {
            return self.girths[3].1;
        };
        let t = ((y - low) / (high - low).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        a + (b - a) * t
    }

    /// Scales around and along each limb at a height, metres.
    fn scales(&self, y: f64) -> [[f64; 2]; LIMBS] {
        let ratio = |f: fn(&SizeRow) -> f64| f(&self.rows[1]) / f(&self.rows[0]);
        let girth = self.girth(y);
        let arm = [ratio(|r| r.upper_arm), ratio(|r| r.arm)];
        let leg = [girth, ratio(|r| r.inseam)];
        [[girth, ratio(|r| r.trunk)], arm, arm, leg, leg]
    }

    /// Graded rest shape of a triangle (m, panel coordinates) that lies at `corners` (m) over the limbs.
    pub(super) fn graded(
        &self,
        rest: &[[f64; 2]; 3],
        corners: [P3; 3],
        shares: &LimbShares,
    ) -> [[f64; 2]; 3] {
        let [a, b, c] = corners.map(|p| p.coords.cast::<f64>());
        let [ra, rb, rc] = rest.map(Vector2::from);
        let in_space = Matrix3x2::from_columns(&[b - a, c - a]);
        let Some(to_rest) = Matrix2::from_columns(&[rb - ra, rc - ra]).try_inverse() else {
            return *rest;
        };
        // Panel coordinates to space; an isometry for cloth at rest, whose transpose projects onto the panel.
        let map = in_space * to_rest;
        let scales = self.scales((a.y + b.y + c.y) / 3.0);
        let mut stretch = Matrix2::zeros();
        for ((axis, [around, along]), share) in self.limbs.axes.iter().zip(scales).zip(shares) {
            let d: Vector2<f64> = (map.transpose() * axis).cap_magnitude(1.0);
            let limb = Matrix2::identity() * around + d * d.transpose() * (along - around);
            stretch += limb * *share;
        }
        [ra, rb, rc].map(|r| (stretch * r).into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;
    use tryon_body::embedded;
    use tryon_garment::import::unfold;
    use tryon_garment::{Size, rest_area};

    const OVER_TRUNK: LimbShares = [1.0, 0.0, 0.0, 0.0, 0.0];

    fn grading(limbs: &LimbAxes, to: Size) -> Grading<'_> {
        let rows = [Size::M.row(), to.row()];
        // A garment with 10 cm of ease everywhere.
        let scale = |k: usize| {
            let [own, other] = rows.each_ref().map(|r| r.body.girths()[k]);
            (own + 0.1 + other - own) / (own + 0.1)
        };
        Grading {
            limbs,
            girths: [
                (0.9, scale(2)),
                (1.1, scale(1)),
                (1.25, scale(0)),
                (1.4, 1.05),
            ],
            rows,
        }
    }

    /// Rest lengths of the two upright sides of a cylinder's quad at height `y`: around and along, metres.
    fn sides(g: &Grading<'_>, y: f32, girth: f32, height: f32) -> [f64; 2] {
        let n = 360.0;
        let r = girth / TAU;
        let p = |t: f32, y: f32| P3::new(r * (TAU * t / n).sin(), y, r * (TAU * t / n).cos());
        let corners = [p(0.0, y), p(1.0, y), p(0.0, y + height)];
        let rest = unfold(corners.map(|p| p.coords.cast()));
        let rest = g.graded(&rest, corners, &OVER_TRUNK);
        let length = |k: usize| (rest[k][0] - rest[0][0]).hypot(rest[k][1] - rest[0][1]);
        [length(1) * f64::from(n), length(2)]
    }

    #[test]
    fn a_cylinder_grows_by_the_steps_of_the_table_and_keeps_its_ease() {
        let limbs = LimbAxes::new(&embedded::template());
        for size in Size::ALL {
            let g = grading(&limbs, size);
            // Girths at hip, waist and chest: the wanted size's own, and the same ease.
            let girths = [(2, 0.9f32), (1, 1.1), (0, 1.25)];
            for (k, y) in girths {
                let [own, wanted] = g.rows.each_ref().map(|r| r.body.girths()[k]);
                let [around, along] = sides(&g, y - 5e-4, own as f32 + 0.1, 0.0015);
                assert!((around - wanted - 0.1).abs() < 1e-3, "{size} {k}: {around}");
                let length = g.rows[1].trunk / g.rows[0].trunk;
                assert!(
                    (along / 0.0015 - length).abs() < 1e-3,
                    "{size} {k}: {along}"
                );
            }
        }
    }

    #[test]
    fn the_own_size_changes_no_triangle_however_it_lies() {
        let limbs = LimbAxes::new(&embedded::template());
        let mut g = grading(&limbs, Size::M);
        g.girths[3].1 = 1.0;
        let corners = [[0.1, 1.0, 0.2], [0.12, 1.01, 0.18], [0.09, 1.03, 0.21]].map(P3::from);
        let rest = unfold(corners.map(|p| p.coords.cast()));
        let same = g.graded(&rest, corners, &[0.4, 0.3, 0.1, 0.2, 0.0]);
        for (a, b) in rest.iter().flatten().zip(same.iter().flatten()) {
            assert!((a - b).abs() < 1e-9);
        }
    }

    #[test]
    fn sleeves_grow_along_their_arm() {
        let limbs = LimbAxes::new(&embedded::template());
        let g = grading(&limbs, Size::Xl);
        let axis = limbs.axes[1];
        let across = axis.cross(&V3d::z()).normalize();
        let at = |v: V3d| P3::from((V3d::new(0.4, 1.3, 0.0) + v).cast::<f32>());
        let corners = [at(V3d::zeros()), at(axis * 0.02), at(across * 0.02)];
        let rest = unfold(corners.map(|p| p.coords.cast()));
        let graded = g.graded(&rest, corners, &[0.0, 1.0, 0.0, 0.0, 0.0]);
        let [own, wanted] = &g.rows;
        let (along, around) = (wanted.arm / own.arm, wanted.upper_arm / own.upper_arm);
        let area = rest_area(&graded) / rest_area(&rest);
        assert!((area - along * around).abs() < 1e-4, "{area}");
        let length = (graded[1][0] - graded[0][0]).hypot(graded[1][1] - graded[0][1]);
        assert!((length / 0.02 - along).abs() < 1e-4, "{length}");
    }
}
