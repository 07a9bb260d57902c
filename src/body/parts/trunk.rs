//! Upright frame of the trunk.

use crate::math::{P3d, V3d};

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
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
