//! Information on size by the direction from which the body was seen: many frames from one side are no second side.

use nalgebra::{DMatrix, DVector, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use tryon_body::Pose;
use tryon_geometry::math::Camera;

/// Directions: front, half of it, half of the back, back. Left and right are alike on a symmetric body.
const VIEWS: usize = 4;

/// Direction from which a body is seen, by the angle between its front and the line of sight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SizeView(usize);

impl SizeView {
    /// View of a posed body whose root joint is at `root` (camera frame, metres).
    pub(crate) fn of(pose: &Pose<Camera>, root: &Vector3<f64>) -> Self {
        let front = pose.root.iso().rotation * Vector3::z();
        let share = front.angle(&-root) / PI;
        Self(((share * VIEWS as f64) as usize).min(VIEWS - 1))
    }
}

/// Running sums of one view.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct ViewSum {
    /// Frames so far.
    frames: u32,
    /// Sum of their faded weights.
    weight: f64,
    /// Σ of information, per point, shape `[directions × directions]`; empty before the first frame.
    information: Vec<f64>,
    /// Σ of information × (estimate of the frame), shape `[directions]`.
    evidence: Vec<f64>,
}

/// Information on size of all views.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ViewInformation {
    views: [ViewSum; VIEWS],
}

/// Information Λ of a frame, or a sum of them, and evidence Λ x, shapes `[directions × directions]` and `[directions]`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SizeInformation {
    pub information: DMatrix<f64>,
    pub evidence: DVector<f64>,
}

impl SizeInformation {
    fn add(&mut self, information: &[f64], evidence: &[f64], factor: f64) {
        let n = self.evidence.len();
        if information.len() == n * n && evidence.len() == n {
            self.information += DMatrix::from_column_slice(n, n, information) * factor;
            self.evidence += DVector::from_column_slice(evidence) * factor;
        }
    }
}

impl ViewInformation {
    /// Views of a size that is known: no frame adds to them.
    pub(crate) fn closed() -> Self {
        let closed = || ViewSum {
            frames: u32::MAX,
            ..ViewSum::default()
        };
        Self {
            views: std::array::from_fn(|_| closed()),
        }
    }

    /// Frames of a view so far.
    pub(crate) fn frames(&self, view: SizeView) -> u32 {
        self.views[view.0].frames
    }

    /// Mean of each view's frames, summed over views, for `n` directions; `None` before the first frame.
    pub(crate) fn total(&self, n: usize) -> Option<SizeInformation> {
        let mut total = SizeInformation {
            information: DMatrix::zeros(n, n),
            evidence: DVector::zeros(n),
        };
        for view in self.views.iter().filter(|v| v.weight > 0.0) {
            total.add(&view.information, &view.evidence, 1.0 / view.weight);
        }
        (self.views.iter().any(|v| v.weight > 0.0)).then_some(total)
    }

    /// Mean of each view's frames, summed over views, with `frame` added to its view, whose earlier frames fade by `fade`.
    /// With `keep` it stays added.
    pub(crate) fn with(
        &mut self,
        view: SizeView,
        frame: SizeInformation,
        fade: f64,
        keep: bool,
    ) -> SizeInformation {
        let mut total = frame;
        let own = &mut self.views[view.0];
        total.add(&own.information, &own.evidence, fade);
        let weight = 1.0 + fade * own.weight;
        if keep {
            *own = ViewSum {
                frames: own.frames.saturating_add(1),
                weight,
                information: total.information.as_slice().to_vec(),
                evidence: total.evidence.as_slice().to_vec(),
            };
        }
        total.information /= weight;
        total.evidence /= weight;
        for (k, other) in self.views.iter().enumerate() {
            if k != view.0 && other.weight > 0.0 {
                total.add(&other.information, &other.evidence, 1.0 / other.weight);
            }
        }
        total
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;
    use tryon_geometry::math::Rigid;

    /// Certain by `certainty` of the value `x`.
    fn frame(certainty: f64, x: f64) -> SizeInformation {
        SizeInformation {
            information: DMatrix::from_element(1, 1, certainty),
            evidence: DVector::from_element(1, certainty * x),
        }
    }

    #[test]
    fn many_frames_of_one_view_weigh_as_one() {
        let mut views = ViewInformation::default();
        for _ in 0..50 {
            views.with(SizeView(0), frame(1.0, 3.0), 0.95, true);
        }
        let both = views.with(SizeView(2), frame(1.0, 5.0), 0.95, true);
        assert!((both.information[0] - 2.0).abs() < 1e-12);
        assert!((both.evidence[0] / both.information[0] - 4.0).abs() < 1e-12);
        assert_eq!(
            (views.frames(SizeView(0)), views.frames(SizeView(1))),
            (50, 0)
        );
    }

    #[test]
    fn a_frame_that_is_not_kept_leaves_no_trace() {
        let mut views = ViewInformation::default();
        views.with(SizeView(1), frame(2.0, 1.0), 0.95, true);
        let before = views.clone();
        let tried = views.with(SizeView(1), frame(4.0, 1.0), 0.5, false);
        assert!((tried.information[0] - 5.0 / 1.5).abs() < 1e-12);
        assert_eq!(views, before);
        assert_eq!(ViewInformation::closed().frames(SizeView(3)), u32::MAX);
    }

    #[test]
    fn views_follow_the_angle_to_the_line_of_sight() {
        let template = embedded::template();
        let root = Vector3::new(0.6, 0.1, 2.0);
        let facing = nalgebra::UnitQuaternion::face_towards(&-root, &-Vector3::y());
        let seen = |turn: f64| {
            let turned = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turn);
            let body = Rigid::from_parts(root, facing * turned);
            SizeView::of(&Pose::rest(template.skeleton(), body), &root).0
        };
        let turns = [0.0, 0.7, -0.7, 0.9, -1.5, 1.7, -2.3, 2.5, PI, -PI];
        assert_eq!(turns.map(seen), [0, 0, 0, 1, 1, 2, 2, 3, 3, 3]);
    }
}
