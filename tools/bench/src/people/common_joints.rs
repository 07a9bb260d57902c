//! Joints that mean the same in every skeleton, their errors, and the offsets between conventions.

use super::settings::PeopleSettings;
use crate::tracking::{mean, median};
use nalgebra::{Matrix3, Vector3};
use tryon_body::Skeleton;
use tryon_geometry::math::{P3d, V3d};

/// Number of common joints.
pub(super) const COUNT: usize = 14;

/// Names, and the joints whose mean is meant.
const JOINTS: [(&str, &[&str]); COUNT] = [
    ("left shoulder", &["left_shoulder"]),
    ("right shoulder", &["right_shoulder"]),
    ("left elbow", &["left_elbow"]),
    ("right elbow", &["right_elbow"]),
    ("left wrist", &["left_wrist"]),
    ("right wrist", &["right_wrist"]),
    ("left hip", &["left_hip"]),
    ("right hip", &["right_hip"]),
    ("left knee", &["left_knee"]),
    ("right knee", &["right_knee"]),
    ("left ankle", &["left_ankle"]),
    ("right ankle", &["right_ankle"]),
    ("head", &["head", "head_end"]),
    ("neck", &["neck"]),
];

/// Positions of the common joints, camera frame, metres.
pub(super) type Points = [P3d; COUNT];

/// Common joints of one skeleton.
#[derive(Clone, Debug)]
pub(super) struct CommonJoints([Vec<usize>; COUNT]);

impl CommonJoints {
    /// Looks the joints up; those that a skeleton lacks stand at its root.
    pub(super) fn new(skeleton: &Skeleton) -> Self {
        Self(JOINTS.map(|(_, names)| {
            let found: Vec<usize> = names.iter().filter_map(|n| skeleton.index(n)).collect();
            if found.is_empty() { vec![0] } else { found }
        }))
    }
    /// Their positions among posed joints.
    pub(super) fn points(&self, joints: &[P3d]) -> Points {
        std::array::from_fn(|k| {
            let sum: V3d = self.0[k].iter().map(|&j| joints[j].coords).sum();
            P3d::from(sum / self.0[k].len() as f64)
        })
    }
}

/// Middle of shoulders and hips.
pub(super) fn torso(p: &Points) -> P3d {
    P3d::from((p[0].coords + p[1].coords + p[6].coords + p[7].coords) / 4.0)
}

/// From the right to the left shoulder and hip, summed, metres.
fn to_the_left(p: &Points) -> V3d {
    (p[0] - p[1]) + (p[6] - p[7])
}

/// Axes of the torso (left, up, front) as columns; identity for a degenerate one.
pub(super) fn torso_axes(p: &Points) -> Matrix3<f64> {
    let up = (p[0] - p[6]) + (p[1] - p[7]);
    let left = to_the_left(p);
    let axes = || {
        let y = up.try_normalize(f64::EPSILON)?;
        let z = left.cross(&y).try_normalize(f64::EPSILON)?;
        Some(Matrix3::from_columns(&[y.cross(&z), y, z]))
    };
    axes().unwrap_or_else(Matrix3::identity)
}

/// Angle between the headings of two torsos about the vertical `up`, radians.
pub(super) fn heading_error(ours: &Points, truth: &Points, up: &V3d) -> f64 {
    let level = |p: &Points| {
        let left = to_the_left(p);
        left - up * left.dot(up)
    };
    level(ours).angle(&level(truth))
}

/// Distance of each joint from the truth, millimetres.
pub(super) fn errors_mm(ours: &Points, truth: &Points) -> [f64; COUNT] {
    std::array::from_fn(|k| (ours[k] - truth[k]).norm() * 1e3)
}

/// Errors of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FrameError {
    /// Mean over the joints, millimetres.
    pub(super) mean: f64,
    /// Greatest, millimetres.
    pub(super) worst: f64,
    /// Name of the joint with the greatest.
    pub(super) joint: &'static str,
}

impl FrameError {
    pub(super) fn new(ours: &Points, truth: &Points) -> Self {
        Self::among(ours, truth, |_| true)
    }
    /// Errors of the joints whose true position is wanted; NaN when none is.
    pub(super) fn among(ours: &Points, truth: &Points, is_wanted: impl Fn(&P3d) -> bool) -> Self {
        let off = errors_mm(ours, truth);
        let wanted: Vec<usize> = (0..COUNT).filter(|&k| is_wanted(&truth[k])).collect();
        let worst = wanted.iter().copied();
        let worst = worst.max_by(|&a, &b| off[a].total_cmp(&off[b]));
        let values: Vec<f64> = wanted.iter().map(|&k| off[k]).collect();
        Self {
            mean: mean(&values),
            worst: worst.map_or(f64::NAN, |k| off[k]),
            joint: worst.map_or("none", |k| JOINTS[k].0),
        }
    }
    /// Mean or worst joint above the limits of a usable pose; also without any joint.
    pub(super) fn is_bad(&self, settings: &PeopleSettings) -> bool {
        !(self.mean <= settings.usable_mean && self.worst <= settings.usable_worst)
    }
}

/// Constant offset of each joint between two conventions of skeletons, in the axes of the torso, metres.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ConventionOffsets([V3d; COUNT]);

impl ConventionOffsets {
    /// Median over frames of (ours − truth).
    pub(super) fn fit<'a>(frames: impl Iterator<Item = &'a (Points, Points)>) -> Self {
        let mut all: [[Vec<f64>; 3]; COUNT] = Default::default();
        for (ours, truth) in frames {
            let axes = torso_axes(truth).transpose();
            for k in 0..COUNT {
                let off = axes * (ours[k] - truth[k]);
                (0..3).for_each(|d| all[k][d].push(off[d]));
            }
        }
        let middle = |values: &Vec<f64>| {
            if values.is_empty() {
                0.0
            } else {
                median(values)
            }
        };
        Self(all.map(|axes| Vector3::from(axes.each_ref().map(middle))))
    }
    /// The truth in the tracked skeleton's convention.
    pub(super) fn convert(&self, truth: &Points) -> Points {
        let axes = torso_axes(truth);
        std::array::from_fn(|k| truth[k] + axes * self.0[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A standing figure that faces −z of the camera: left is +x, up is −y.
    #[rustfmt::skip]
    fn figure() -> Points {
        [
            [0.2, 1.4], [-0.2, 1.4], [0.3, 1.1], [-0.3, 1.1], [0.3, 0.9], [-0.3, 0.9], [0.1, 0.9],
            [-0.1, 0.9], [0.1, 0.5], [-0.1, 0.5], [0.1, 0.1], [-0.1, 0.1], [0.0, 1.6], [0.0, 1.5],
        ]
        .map(|[x, y]| P3d::new(x, -y, 2.0))
    }

    #[test]
    fn a_constant_offset_is_taken_out_and_a_lost_hand_is_not() {
        let truth = figure();
        let mut ours = truth;
        ours[2] += V3d::new(0.03, 0.01, 0.0);
        let frames: Vec<(Points, Points)> = (0..9).map(|_| (ours, truth)).collect();
        let offsets = ConventionOffsets::fit(frames.iter());
        assert!(FrameError::new(&ours, &offsets.convert(&truth)).worst < 1e-9);
        let mut lost = ours;
        lost[4] += V3d::new(0.0, 0.35, 0.0);
        let error = FrameError::new(&lost, &offsets.convert(&truth));
        assert!(error.is_bad(&PeopleSettings::default()) && error.joint == "left wrist");
    }

    #[test]
    fn only_wanted_joints_count() {
        let truth = figure();
        let mut ours = truth;
        ours[10] += V3d::new(1.0, 0.0, 0.0);
        let above = |p: &P3d| p.y < -0.6;
        assert!(FrameError::among(&ours, &truth, above).worst < 1e-9);
        let none = FrameError::among(&ours, &truth, |_| false);
        assert!(none.mean.is_nan() && none.is_bad(&PeopleSettings::default()));
    }

    #[test]
    fn a_body_turned_about_has_its_heading_off_by_half_a_turn() {
        let truth = figure();
        let turned = truth.map(|p| P3d::new(-p.x, p.y, p.z));
        let up = -V3d::y();
        assert!((heading_error(&turned, &truth, &up) - std::f64::consts::PI).abs() < 1e-9);
        assert!(heading_error(&truth, &truth, &up) < 1e-6);
        assert!((torso(&truth) - P3d::new(0.0, -1.15, 2.0)).norm() < 1e-12);
    }

    #[test]
    fn no_frames_give_no_offset_and_a_point_no_axes() {
        let none = ConventionOffsets::fit(std::iter::empty());
        assert_eq!(none.convert(&figure()), figure());
        assert_eq!(torso_axes(&[P3d::origin(); COUNT]), Matrix3::identity());
    }
}
