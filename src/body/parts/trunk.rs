//! Upright frame, elliptic sections and column of the trunk.

use super::BodyPart;
use crate::Template;
use std::f64::consts::SQRT_2;
use tryon_geometry::math::{P3, P3d, V3d};

/// Share of the way from axis to surface within which the direction out isn't known.
const AXIS: f64 = 1e-3;

/// Frame of a trunk between pelvis and shoulders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrunkFrame {
    /// Origin, the pelvis, metres.
    pub pelvis: P3d,
    /// Unit vectors across (to the subject's left), up, and to the front.
    pub axes: [V3d; 3],
    /// Height of the shoulders, metres.
    pub height: f64,
    /// Distance between the shoulders, metres.
    pub width: f64,
}

impl TrunkFrame {
    /// Frame of these joints, left shoulder first; `None` where the shoulders meet each other or the pelvis.
    pub fn new(pelvis: P3d, [left, right]: [P3d; 2]) -> Option<Self> {
        let across = left - right;
        let width = across.norm();
        let across = across.try_normalize(f64::EPSILON)?;
        let up = nalgebra::center(&left, &right) - pelvis;
        let up = up - across * across.dot(&up);
        let height = up.norm();
        let up = up.try_normalize(f64::EPSILON)?;
        Some(Self {
            pelvis,
            axes: [across, up, across.cross(&up)],
            height,
            width,
        })
    }

    /// Coordinates of a point along the axes, metres.
    pub fn local(&self, p: &P3d) -> [f64; 3] {
        self.axes.map(|a| a.dot(&(p - self.pelvis)))
    }

    /// Coordinates of those of a body's `vertices` (metres) that belong to the trunk and lie between pelvis and shoulders.
    pub fn skin(&self, template: &Template, vertices: &[P3]) -> Vec<[f64; 3]> {
        let weights = template.weights();
        let is_trunk = |v: usize| template.parts().part(weights.dominant(v)) == BodyPart::Trunk;
        let trunk = vertices.iter().enumerate().filter(|(v, _)| is_trunk(*v));
        let local = trunk.map(|(_, p)| self.local(&p.cast()));
        let between = local.filter(|p| (0.0..self.height).contains(&p[1]));
        between.collect()
    }
}

/// Ellipse whose axes are those of a [`TrunkFrame`], metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EllipticSection {
    /// Half axes across and to the front.
    pub half: [f64; 2],
    /// Place of its centre to the front.
    pub front: f64,
}

impl EllipticSection {
    /// The ellipse around which these points lie; of no size without points.
    pub fn around(points: &[[f64; 3]]) -> Self {
        let n = points.len().max(1) as f64;
        let mean = |k: usize| points.iter().map(|p| p[k]).sum::<f64>() / n;
        let half = |k: usize| {
            let centre = mean(k);
            let variance = points.iter().map(|p| (p[k] - centre).powi(2)).sum::<f64>() / n;
            // Of an ellipse, over the standard deviation of points on it.
            SQRT_2 * variance.sqrt()
        };
        Self {
            half: [half(0), half(2)],
            front: mean(2),
        }
    }
}

/// An upright column of elliptic section, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EllipticColumn {
    /// Centre of the lower end.
    pub base: P3d,
    /// Unit vectors across, up and to the front.
    pub axes: [V3d; 3],
    /// Half axes of the section, across and to the front.
    pub half: [f64; 2],
    /// Height.
    pub height: f64,
}

impl EllipticColumn {
    /// Distance of `p` from the axis as a share of that of the surface, and its gradient, 1/m; `None` outside and on the axis.
    pub fn inside(&self, p: &P3d) -> Option<(f64, V3d)> {
        let [across, up, front] = self.axes.map(|a| a.dot(&(p - self.base)));
        let scaled = [across / self.half[0], front / self.half[1]];
        let share = scaled[0].hypot(scaled[1]);
        let is_inside = (0.0..self.height).contains(&up) && (AXIS..1.0).contains(&share);
        let slope = |k: usize, axis: usize| self.axes[axis] * (scaled[k] / self.half[k]);
        is_inside.then(|| (share, (slope(0, 0) + slope(1, 2)) / share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_an_ellipse_give_its_axes_and_none_give_nothing() {
        let turns = (0..64).map(|k| std::f64::consts::TAU * f64::from(k) / 64.0);
        let points: Vec<_> = turns
            .map(|t| [0.2 * t.cos(), 0.3, 0.1 * t.sin() + 0.05])
            .collect();
        let section = EllipticSection::around(&points);
        let off = [
            section.half[0] - 0.2,
            section.half[1] - 0.1,
            section.front - 0.05,
        ];
        assert!(off.iter().all(|d| d.abs() < 1e-12), "{section:?}");
        assert_eq!(EllipticSection::around(&[]), EllipticSection::default());
    }

    #[test]
    fn axes_are_the_subjects_and_shoulders_at_the_pelvis_have_none() {
        let pelvis = P3d::new(0.0, 0.0, 2.0);
        let shoulders = [V3d::new(0.2, 0.5, 0.0), V3d::new(-0.2, 0.5, 0.0)];
        let frame = TrunkFrame::new(pelvis, shoulders.map(|s| pelvis + s)).expect("a frame");
        assert_eq!(frame.axes, [V3d::x(), V3d::y(), V3d::z()]);
        assert_eq!((frame.height, frame.width), (0.5, 0.4));
        assert_eq!(frame.local(&(pelvis + V3d::y())), [0.0, 1.0, 0.0]);
        assert_eq!(TrunkFrame::new(pelvis, [pelvis; 2]), None);
        assert_eq!(TrunkFrame::new(pelvis, [pelvis, pelvis + V3d::x()]), None);
    }

    fn column() -> EllipticColumn {
        EllipticColumn {
            base: P3d::new(0.15, 0.3, 1.75),
            axes: [V3d::x(), V3d::y(), V3d::z()],
            half: [0.2, 0.15],
            height: 0.5,
        }
    }

    #[test]
    fn only_points_between_axis_and_surface_are_inside() {
        let c = column();
        let at = |across: f64, up: f64, front: f64| c.base + V3d::new(across, up, front);
        let (share, gradient) = c.inside(&at(0.0, 0.2, 0.075)).expect("halfway");
        assert!((share - 0.5).abs() < 1e-12);
        assert!((gradient - V3d::z() / 0.15).norm() < 1e-12);
        for p in [
            at(0.0, 0.2, 0.0),
            at(0.0, -0.1, 0.05),
            at(0.21, 0.2, 0.0),
            at(0.0, 0.6, 0.05),
        ] {
            assert_eq!(c.inside(&p), None, "{p}");
        }
    }
}
