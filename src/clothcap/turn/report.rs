//! Report of a capture from one camera.

use crate::segment::BodyRegion;
use serde::{Deserialize, Serialize};

/// Report of one key frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct KeyFrameReport {
    /// Number of the frame in the recording, from 0.
    pub frame: usize,
    /// Yaw of the tracked body from facing the camera to its left, degrees, within ±180.
    pub yaw_degrees: f64,
    /// Quality of the tracked pose, 0 to 1.
    pub quality: f64,
    /// Points on the subject.
    pub points: usize,
    /// Mean distance of the points from those of frames at near yaws, in the tracked poses, metres.
    pub tracked_error: f64,
    /// The same after registration, metres.
    pub registered_error: f64,
}

/// Report of a fused turn.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TurnReport {
    /// Frames of the recording.
    pub frames: usize,
    /// Frames with a tracked subject.
    pub live: usize,
    /// Key frames, by yaw.
    pub used: Vec<KeyFrameReport>,
    /// Number of the frame whose pose the scan has, from 0.
    pub reference: usize,
    /// Range of yaws: a full turn less the largest gap, degrees; 0 for one frame.
    pub yaw_coverage_degrees: f64,
    /// No gap between yaws leaves a side unseen.
    pub is_whole_turn: bool,
    /// Points of the fused scan.
    pub points: usize,
    /// Regions of the body that hardly any point shows.
    pub unseen: Vec<BodyRegion>,
}

impl TurnReport {
    /// Sets the coverage from the yaws of the key frames; a whole turn has gaps up to the given one, degrees.
    pub(super) fn measure_coverage(&mut self, whole_turn_gap: f64) {
        let mut yaws: Vec<f64> = self.used.iter().map(|k| k.yaw_degrees).collect();
        yaws.sort_by(f64::total_cmp);
        let next = yaws.iter().cycle().skip(1);
        let gaps = yaws.iter().zip(next).map(|(a, b)| b - a);
        let largest = gaps.map(|g| g.rem_euclid(360.0)).fold(0.0, f64::max);
        let gap = if yaws.len() < 2 { 360.0 } else { largest };
        self.yaw_coverage_degrees = 360.0 - gap;
        self.is_whole_turn = gap <= whole_turn_gap;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coverage_is_a_turn_less_the_largest_gap() {
        let of = |yaws: &[f64]| {
            let key = |yaw: &f64| KeyFrameReport {
                yaw_degrees: *yaw,
                ..KeyFrameReport::default()
            };
            let mut report = TurnReport {
                used: yaws.iter().map(key).collect(),
                ..TurnReport::default()
            };
            report.measure_coverage(60.0);
            (report.yaw_coverage_degrees, report.is_whole_turn)
        };
        assert_eq!(of(&[]), (0.0, false));
        assert_eq!(of(&[30.0]), (0.0, false));
        assert_eq!(of(&[-40.0, 0.0, 40.0]), (80.0, false));
        assert!(of(&[-150.0, -100.0, -50.0, 0.0, 50.0, 100.0, 150.0]).1);
    }
}
