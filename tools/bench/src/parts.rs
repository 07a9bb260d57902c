//! Quality of a part forest on labelled frames: share of right cells, joints within reach, facing by sector, time.

use std::fmt::Write;
use std::time::Instant;
use tryon_geometry::math::order_statistics::{median, percentile};
use tryon_synth::labelled::{LabelledFrame, LabelledFrames, NO_CLASS};
use tryon_tracking::part_classes::{PART_CLASSES, PartKind, class_name, kind_of};
use tryon_tracking::segment::part_forest::{PartForest, PartScratch};
use tryon_tracking::settings::ProposalSettings;
use tryon_tracking::{JointProposals, facing};

/// A proposal within this distance of its anchor counts, metres.
pub const WITHIN: f64 = 0.10;
/// Sectors of yaw: front, left side, back, right side.
const SECTORS: [&str; 4] = ["front", "left", "back", "right"];
/// Cells of a class in a frame from which its anchor counts as seen.
const SEEN: usize = 8;

/// Hits among trials.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HitRate {
    /// Successes.
    pub hits: f64,
    /// All.
    pub trials: f64,
}

impl HitRate {
    pub(super) fn add(&mut self, hit: bool) {
        self.hits += f64::from(u8::from(hit));
        self.trials += 1.0;
    }
    /// Share of hits; 0 without trials.
    pub fn share(&self) -> f64 {
        self.hits / self.trials.max(1.0)
    }
}

/// Scores of a forest.
#[derive(Clone, Debug, Default)]
pub struct PartScores {
    /// Frames.
    pub frames: usize,
    /// Cells whose best class is right, shape `[classes]`.
    pub cells: Vec<HitRate>,
    /// Seen anchors with the heaviest proposal, and with any, within [`WITHIN`], shape `[classes]`.
    pub anchors: Vec<[HitRate; 2]>,
    /// Errors of the facing by sector of the true yaw, radians.
    pub facing: [Vec<f64>; 4],
    /// Error and confidence of the facing of each frame.
    pub facing_confidence: Vec<(f64, f32)>,
    /// Time of each frame, milliseconds.
    pub ms: Vec<f64>,
}

/// Scores a forest on the frames of `people` people.
pub fn score_parts(forest: &PartForest, frames: &LabelledFrames, people: u64) -> PartScores {
    let mut out = PartScores {
        cells: vec![HitRate::default(); PART_CLASSES],
        anchors: vec![[HitRate::default(); 2]; PART_CLASSES],
        ..PartScores::default()
    };
    let mut scratch = PartScratch::default();
    for person in 0..people {
        for frame in frames.person(person) {
            let start = Instant::now();
            let found = forest.propose(&frame.person(), &mut scratch);
            out.ms.push(start.elapsed().as_secs_f64() * 1e3);
            out.frames += 1;
            let proposals =
                JointProposals::new(frames.classes(), &found, &ProposalSettings::default());
            out.add_frame(frames, &frame, &proposals, &scratch);
        }
    }
    out
}

impl PartScores {
    fn add_frame(
        &mut self,
        frames: &LabelledFrames,
        frame: &LabelledFrame,
        proposals: &JointProposals,
        scratch: &PartScratch,
    ) {
        let mut seen = [0usize; PART_CLASSES];
        for (i, &label) in frame.labels.iter().enumerate() {
            if label != NO_CLASS {
                seen[usize::from(label)] += 1;
                let right = scratch.map.best(i) == Some(label);
                self.cells[usize::from(label)].add(right);
            }
        }
        // The halves of the head propose one place.
        seen[0] += seen[1];
        seen[1] = 0;
        for (c, _) in seen.iter().enumerate().filter(|(_, n)| **n >= SEEN) {
            let Some(truth) = frames.classes().anchor_of(c as u8, &frame.joints) else {
                continue;
            };
            let near =
                |(p, _): (tryon_geometry::math::P3, f32)| (p.cast::<f64>() - truth).norm() < WITHIN;
            let hits: Vec<bool> = proposals.of_class(c as u8).map(near).collect();
            self.anchors[c][0].add(hits.first() == Some(&true));
            self.anchors[c][1].add(hits.contains(&true));
        }
        if let Some(yaw) = frame.yaw {
            let found = facing(&frame.person(), &scratch.yaw);
            let error = found.map_or(std::f64::consts::PI, |f| angle_between(f.yaw, yaw));
            let quarter = (yaw / std::f64::consts::FRAC_PI_2).round() as i64;
            self.facing[quarter.rem_euclid(4) as usize].push(error);
            self.facing_confidence
                .push((error, found.map_or(0.0, |f| f.confidence)));
        }
    }

    /// Mean over classes of the share of right cells, and share of all cells.
    pub fn accuracy(&self) -> [f64; 2] {
        let seen = self.cells.iter().filter(|h| h.trials > 0.0);
        let mean = seen.clone().map(HitRate::share).sum::<f64>() / seen.count().max(1) as f64;
        let sum = |f: fn(&HitRate) -> f64| self.cells.iter().map(f).sum::<f64>();
        [mean, sum(|h| h.hits) / sum(|h| h.trials).max(1.0)]
    }
    /// Shares of seen joints, hands and heads with the heaviest proposal, and with any, within [`WITHIN`]; anchors between
    /// joints do not count.
    pub fn within(&self) -> [f64; 2] {
        use PartKind::*;
        let is_joint = |c: &usize| {
            let kind = kind_of(*c as u8).map(|k| k.0);
            !matches!(
                kind,
                Some(UpperArm | Forearm | Chest | Belly | Thigh | Shank)
            )
        };
        let joints: Vec<usize> = (0..self.anchors.len()).filter(is_joint).collect();
        [0, 1].map(|k| {
            let sum = |f: fn(&HitRate) -> f64| {
                joints.iter().map(|c| f(&self.anchors[*c][k])).sum::<f64>()
            };
            sum(|h| h.hits) / sum(|h| h.trials).max(1.0)
        })
    }
    /// Share of frames whose facing is more than a quarter turn off.
    pub fn turned(&self) -> f64 {
        let all = self.facing_confidence.len().max(1) as f64;
        let beyond = |(e, _): &&(f64, f32)| *e > std::f64::consts::FRAC_PI_2;
        self.facing_confidence.iter().filter(beyond).count() as f64 / all
    }
    /// Median and greatest time of a frame, milliseconds.
    pub fn time(&self) -> [f64; 2] {
        let mut ms = self.ms.clone();
        [50, 100].map(|p| percentile(&mut ms, p).unwrap_or(0.0))
    }
    /// Median error of the facing in a sector, degrees, and share of errors beyond a quarter turn.
    pub fn facing_of(&self, sector: usize) -> [f64; 2] {
        let mut e = self.facing[sector].clone();
        let beyond = e
            .iter()
            .filter(|x| **x > std::f64::consts::FRAC_PI_2)
            .count();
        let median = median(&mut e).unwrap_or(0.0);
        [median.to_degrees(), beyond as f64 / e.len().max(1) as f64]
    }

    /// Tables as text.
    pub fn to_markdown(&self) -> String {
        let (cells, within, time) = (self.accuracy(), self.within(), self.time());
        let mut out = format!(
            "{} frames: cells {:.1} % (mean of classes {:.1} %), joints within {WITHIN} m {:.1} % | {:.1} % \
             (heaviest | any mode), facing beyond 90° {:.1} %, {:.2} ms a frame (greatest {:.2})\n\n\
             | class | cells % | heaviest % | any % |\n|---|---|---|---|\n",
            self.frames,
            100.0 * cells[1],
            100.0 * cells[0],
            100.0 * within[0],
            100.0 * within[1],
            100.0 * self.turned(),
            time[0],
            time[1],
        );
        for c in 0..PART_CLASSES {
            let [first, any] = self.anchors[c].map(|h| 100.0 * h.share());
            let cells = 100.0 * self.cells[c].share();
            // Writing to a string does not fail.
            let _ = writeln!(
                out,
                "| {} | {cells:.1} | {first:.1} | {any:.1} |",
                class_name(c as u8)
            );
        }
        out += "\n| facing | frames | median error [°] | beyond 90° % |\n|---|---|---|---|\n";
        for (s, name) in SECTORS.iter().enumerate() {
            let [median, beyond] = self.facing_of(s);
            let n = self.facing[s].len();
            let _ = writeln!(
                out,
                "| {name} | {n} | {median:.1} | {:.1} |",
                100.0 * beyond
            );
        }
        out
    }
}

/// Angle between two directions, radians, 0 to π.
fn angle_between(a: f64, b: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    ((a - b + PI).rem_euclid(TAU) - PI).abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;

    #[test]
    fn facing_and_joints_of_synthetic_people() {
        let frames = LabelledFrames::new(embedded::template(), vec![], 99).expect("no clips");
        let forest = PartForest::embedded();
        let scores = score_parts(&forest, &frames, 12);
        assert!(
            scores.frames >= 40 && scores.turned() < 0.12,
            "{}",
            scores.turned()
        );
        assert!(scores.within()[0] > 0.7, "{}", scores.to_markdown());
        let mut scratch = PartScratch::default();
        for frame in frames.person(3) {
            let person = frame.person();
            let own = forest.propose(&person, &mut scratch);
            assert_eq!(own, forest.propose(&person, &mut PartScratch::default()));
            let found = facing(&person, &scratch.yaw).expect("cells");
            assert!((found.front.norm() - 1.0).abs() < 1e-5);
            assert!(found.front.dot(&frame.up).abs() < 1e-5);
            assert!((found.belief.iter().sum::<f32>() - 1.0).abs() < 1e-5);
            // The same belief given from outside gives the same joints.
            let prior = scratch.yaw.front_and_back();
            assert_eq!(own, forest.propose_for(&person, prior, &mut scratch));
        }
    }

    #[test]
    fn angles_between_directions_are_at_most_half_a_turn() {
        use std::f64::consts::PI;
        assert!((angle_between(0.9 * PI, -0.9 * PI) - 0.2 * PI).abs() < 1e-12);
        assert!((angle_between(0.0, PI) - PI).abs() < 1e-12);
    }
}
