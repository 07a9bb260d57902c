//! Quality of the part network on labelled frames: share of right cells, joints within reach, facing by sector, time.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::time::Instant;
use tryon_geometry::math::P3;
use tryon_geometry::math::order_statistics::{median, percentile};
use tryon_geometry::settings;
use tryon_synth::labelled::{LabelledFrame, LabelledFrames};
use tryon_tracking::part_classes::{PART_CLASSES, PartKind, class_name, kind_of};
use tryon_tracking::segment::part_network::{PartNetwork, PersonParts};
use tryon_tracking::settings::ProposalSettings;
use tryon_tracking::{JointProposals, facing};

/// Sectors of yaw: front, left side, back, right side.
const SECTORS: [&str; 4] = ["front", "left", "back", "right"];

settings! {
    /// Bounds of the score.
    pub struct PartScoreSettings {
        /// Largest distance of a proposal that counts from its anchor (m).
        pub within: f64 = 0.10,
        /// Cells of a class in a frame from which its anchor counts as seen.
        pub seen: usize = 8,
    }
}

/// Hits among trials.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HitRate {
    pub(crate) hits: usize,
    pub(crate) trials: usize,
}

impl HitRate {
    pub(crate) fn add(&mut self, hit: bool) {
        self.hits += usize::from(hit);
        self.trials += 1;
    }
    /// Share of hits in all rates together, per cent; 0 without trials.
    pub(crate) fn percent<'a>(rates: impl Iterator<Item = &'a Self>) -> f64 {
        let (hits, trials) = rates.fold((0, 0), |s, r| (s.0 + r.hits, s.1 + r.trials));
        100.0 * hits as f64 / trials.max(1) as f64
    }
}

/// Scores of a network.
#[derive(Clone, Debug, Default)]
pub struct PartScores {
    /// Bounds.
    pub settings: PartScoreSettings,
    /// Cells whose best class is right, shape `[classes]`.
    pub cells: Vec<HitRate>,
    /// Seen anchors with the heaviest proposal, and with any, within reach, shape `[classes]`.
    pub anchors: Vec<[HitRate; 2]>,
    /// Errors of the facing by sector of the true yaw, radians.
    pub facing: [Vec<f64>; 4],
    /// Time of each frame, milliseconds.
    pub ms: Vec<f64>,
}

/// Scores a network on the frames of `people` people.
pub fn score_parts(network: &PartNetwork, frames: &LabelledFrames, people: u64) -> PartScores {
    let mut out = PartScores {
        cells: vec![HitRate::default(); PART_CLASSES],
        anchors: vec![[HitRate::default(); 2]; PART_CLASSES],
        ..PartScores::default()
    };
    let mut parts = PersonParts::default();
    for frame in (0..people).flat_map(|person| frames.person(person)) {
        let start = Instant::now();
        network.infer(&frame.person(), &mut parts);
        out.ms.push(start.elapsed().as_secs_f64() * 1e3);
        let proposals = JointProposals::new(
            frames.classes(),
            &parts.joints,
            &ProposalSettings::default(),
        );
        out.add_frame(frames, &frame, &proposals, &parts);
    }
    out
}

impl PartScores {
    fn add_frame(
        &mut self,
        frames: &LabelledFrames,
        frame: &LabelledFrame,
        proposals: &JointProposals,
        parts: &PersonParts,
    ) {
        let mut seen = [0usize; PART_CLASSES];
        for (i, &label) in frame.labels.iter().enumerate() {
            if usize::from(label) < PART_CLASSES {
                seen[usize::from(label)] += 1;
                let right = parts.map.best(i) == Some(label);
                self.cells[usize::from(label)].add(right);
            }
        }
        // The halves of the head propose one place.
        seen[0] += seen[1];
        seen[1] = 0;
        let PartScoreSettings { within, seen: few } = self.settings;
        for (c, _) in seen.iter().enumerate().filter(|(_, n)| **n >= few) {
            let Some(truth) = frames.classes().anchor_of(c as u8, &frame.joints) else {
                continue;
            };
            let near = |(p, _): (P3, f32)| (p.cast::<f64>() - truth).norm() < within;
            let hits: Vec<bool> = proposals.of_class(c as u8).map(near).collect();
            self.anchors[c][0].add(hits.first() == Some(&true));
            self.anchors[c][1].add(hits.contains(&true));
        }
        if let Some(yaw) = frame.yaw {
            let found = facing(&frame.person(), &parts.yaw);
            let error = found.map_or(PI, |f| angle_between(f.yaw, yaw));
            let quarter = (yaw / FRAC_PI_2).round() as i64;
            self.facing[quarter.rem_euclid(4) as usize].push(error);
        }
    }

    /// Per cent of seen joints, hands and heads with the heaviest proposal, and with any, within reach; anchors between
    /// joints do not count.
    pub fn within(&self) -> [f64; 2] {
        use PartKind::{Belly, Chest, Forearm, Shank, Thigh, UpperArm};
        let is_joint = |c: usize| {
            let kind = kind_of(c as u8).map(|k| k.0);
            !matches!(
                kind,
                Some(UpperArm | Forearm | Chest | Belly | Thigh | Shank)
            )
        };
        let joints = self
            .anchors
            .iter()
            .enumerate()
            .filter(|(c, _)| is_joint(*c));
        [0, 1].map(|k| HitRate::percent(joints.clone().map(|(_, a)| &a[k])))
    }

    /// Per cent of frames whose facing is more than a quarter turn off, in these sectors.
    pub fn turned(&self, sectors: &[Vec<f64>]) -> f64 {
        let mut rate = HitRate::default();
        let errors = sectors.iter().flatten();
        errors.for_each(|e| rate.add(*e > FRAC_PI_2));
        HitRate::percent([rate].iter())
    }

    /// Tables as text.
    pub fn to_markdown(&self) -> String {
        let [first, any] = self.within();
        let [time, most] = [50, 100].map(|p| percentile(&mut self.ms.clone(), p).unwrap_or(0.0));
        let mut out = format!(
            "{} frames: cells {:.1} %, joints within {} m {first:.1} % | {any:.1} % (heaviest | any mode), \
             facing beyond 90° {:.1} %, {time:.2} ms a frame (greatest {most:.2})\n\n\
             | class | cells % | heaviest % | any % |\n|---|---|---|---|\n",
            self.ms.len(),
            HitRate::percent(self.cells.iter()),
            self.settings.within,
            self.turned(&self.facing),
        );
        for (c, anchor) in self.anchors.iter().enumerate() {
            let [cells, first, any] = [&self.cells[c], &anchor[0], &anchor[1]]
                .map(|rate| HitRate::percent(std::iter::once(rate)));
            let name = class_name(c as u8);
            out += &format!("| {name} | {cells:.1} | {first:.1} | {any:.1} |\n");
        }
        out += "\n| facing | frames | median error [°] | beyond 90° % |\n|---|---|---|---|\n";
        for (errors, name) in self.facing.iter().zip(SECTORS) {
            let median = median(&mut errors.clone()).unwrap_or(0.0).to_degrees();
            let (n, beyond) = (errors.len(), self.turned(std::slice::from_ref(errors)));
            out += &format!("| {name} | {n} | {median:.1} | {beyond:.1} |\n");
        }
        out
    }
}

/// Angle between two directions, radians, 0 to π.
fn angle_between(a: f64, b: f64) -> f64 {
    ((a - b + PI).rem_euclid(TAU) - PI).abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_body::embedded;

    #[test]
    fn facing_and_joints_of_synthetic_people() {
        let frames = LabelledFrames::new(embedded::template(), 99);
        let network = PartNetwork::embedded();
        let scores = score_parts(&network, &frames, 12);
        let text = scores.to_markdown();
        assert!(scores.ms.len() >= 40, "{text}");
        assert!(
            scores.turned(&scores.facing) < 8.0 && scores.within()[0] > 75.0,
            "{text}"
        );
        let mut parts = PersonParts::default();
        for frame in frames.person(3) {
            let person = frame.person();
            network.infer(&person, &mut parts);
            let mut again = PersonParts::default();
            network.infer(&person, &mut again);
            assert_eq!(parts.joints, again.joints);
            let found = facing(&person, &parts.yaw).expect("cells");
            assert!((found.front.norm() - 1.0).abs() < 1e-5);
            assert!(found.front.dot(&frame.up).abs() < 1e-5);
            assert!((found.belief.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn angles_between_directions_are_at_most_half_a_turn() {
        assert!((angle_between(0.9 * PI, -0.9 * PI) - 0.2 * PI).abs() < 1e-12);
        assert!((angle_between(0.0, PI) - PI).abs() < 1e-12);
    }
}
