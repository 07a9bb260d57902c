//! Quality of the part network on recordings with joints of another tracker: ITOP's stills, MSR-Action3D.

use crate::parts::{HitRate, PartScoreSettings};
use crate::people::stills::JointsFile;
use crate::{DepthScene, EvaluateError};
use std::path::Path;
use tryon_body::parts::BodySide;
use tryon_body::{Template, TrunkSides};
use tryon_geometry::camera::DepthImage;
use tryon_geometry::math::order_statistics::medians;
use tryon_geometry::math::{P3d, V3, V3d};
use tryon_geometry::spatial::OrganisedCloud;
use tryon_tracking::part_classes::{NECK_CLASS, PartKind};
use tryon_tracking::segment::part_network::{PartNetwork, PersonCells, PersonParts};
use tryon_tracking::segment::{
    PersonChoice, ScenePlanes, SegmentScratch, find_person, find_planes,
};
use tryon_tracking::settings::{ProposalSettings, SegmentSettings};
use tryon_tracking::{JointProposals, PartClasses, facing};

/// Joints of the recordings (lower case, without their side) and the kind whose anchor they are.
const NAMES: [(&str, PartKind); 8] = [
    ("shoulder", PartKind::Shoulder),
    ("elbow", PartKind::Elbow),
    ("hand", PartKind::Hand),
    ("hip", PartKind::Hip),
    ("knee", PartKind::Knee),
    ("ankle", PartKind::Foot),
    ("foot", PartKind::Foot),
    ("head", PartKind::Head),
];
/// Farthest reading, metres.
const FARTHEST: f32 = 8.0;
/// Offsets of a joint up to this length count for its mean, metres.
const SAME_JOINT: f64 = 0.2;

/// Scores on a recording.
#[derive(Clone, Debug, Default)]
pub struct RecordedScores {
    /// Joints whose heaviest proposal, and any, is within reach.
    pub joints: [HitRate; 2],
    /// Frames whose facing is more than a quarter turn off.
    pub turned: HitRate,
    /// Share of joints per name, of the heaviest proposal.
    pub per_joint: Vec<(String, HitRate)>,
}

/// Truth of one frame: joints of classes, metres.
struct RecordedFrame<'a> {
    depth: &'a DepthImage,
    joints: Vec<P3d>,
}

/// Proposals of one joint in one frame less the truth, heaviest first.
type Offsets = Vec<V3d>;

/// Class of a joint's name; `None` for joints that no class stands for.
fn class_of(name: &str) -> Option<u8> {
    let name = name.to_lowercase().replace('_', " ");
    let (side, kind) = match name.split_once(' ') {
        Some(("right" | "r", kind)) => (BodySide::Right, kind),
        Some(("left" | "l", kind)) => (BodySide::Left, kind),
        _ => (BodySide::Left, name.as_str()),
    };
    if kind == "neck" {
        return Some(NECK_CLASS);
    }
    let found = NAMES.iter().find(|n| n.0 == kind);
    found.map(|n| n.1.class(side))
}

/// Class of each joint. Toes are no class's anchor where there are ankles; the neck of the stills is the middle of the
/// shoulders.
fn classes_of(names: &[String], is_video: bool) -> Vec<Option<u8>> {
    let ends = |n: &String, end: &str| n.to_lowercase().ends_with(end);
    let ankles = names.iter().any(|n| ends(n, "ankle"));
    let counts = |n: &String| !(ankles && ends(n, "foot") || !is_video && ends(n, "neck"));
    let of = |n: &String| class_of(n).filter(|_| counts(n));
    names.iter().map(of).collect()
}

/// The cells of the person in one image.
struct RecordedPerson {
    cloud: OrganisedCloud,
    cells: Vec<u32>,
    up: V3,
}

impl RecordedPerson {
    fn find(scene: &DepthScene, depth: &DepthImage, planes: &mut Option<ScenePlanes>) -> Self {
        let mut cloud = OrganisedCloud::new(&scene.calibration.depth, None);
        cloud.sample(depth, FARTHEST);
        let settings = SegmentSettings::default();
        let planes = planes.get_or_insert_with(|| find_planes(&cloud, &settings.planes));
        let up = planes
            .floor
            .map_or_else(|| V3::new(0.0, -1.0, 0.0), |f| f.normal.cast());
        let mut cells = find_person(
            &mut cloud,
            planes,
            PersonChoice::First,
            &settings,
            &mut SegmentScratch::default(),
        )
        .cells;
        cloud.refine(depth, &cells);
        cells.retain(|&c| cloud.depth[c as usize] > 0.0);
        Self { cloud, cells, up }
    }
    fn cells(&self) -> PersonCells<'_> {
        PersonCells {
            cloud: &self.cloud,
            cells: &self.cells,
            up: self.up,
        }
    }
}

/// Scores a network on a recording with `truth.json` (a video: the mean offset of each joint is taken out) or `joints.json`
/// (stills whose joints are relative to a root: the median offset of each picture is taken out).
///
/// # Errors
/// Names the file at fault.
pub fn score_recording(
    network: &PartNetwork,
    template: &Template,
    folder: &Path,
) -> Result<RecordedScores, EvaluateError> {
    let scene = DepthScene::open(folder)?;
    let (names, frames, is_video) = read_truth(&scene, folder)?;
    let classes = classes_of(&names, is_video);
    let part_classes = PartClasses::new(template);
    let (mut parts, mut planes) = (PersonParts::default(), None);
    let mut out = RecordedScores::default();
    let mut offsets: Vec<Vec<Option<Offsets>>> = Vec::new();
    for frame in &frames {
        // Stills are of different rooms.
        if !is_video {
            planes = None;
        }
        let person = RecordedPerson::find(&scene, frame.depth, &mut planes);
        network.infer(&person.cells(), &mut parts);
        let settings = ProposalSettings::default();
        let proposals = JointProposals::new(&part_classes, &parts.joints, &settings);
        let of = |(class, truth): (&Option<u8>, &P3d)| {
            let places = proposals.of_class((*class)?);
            Some(places.map(|(p, _)| p.cast::<f64>() - truth).collect())
        };
        offsets.push(classes.iter().zip(&frame.joints).map(of).collect());
        out.turned_by(&names, frame, &person, &parts);
    }
    let bias = biases(&mut offsets, names.len(), is_video);
    out.count(&names, &offsets, &bias);
    Ok(out)
}

/// Names of the joints, frames, and if they are a video.
fn read_truth<'a>(
    scene: &'a DepthScene,
    folder: &Path,
) -> Result<(Vec<String>, Vec<RecordedFrame<'a>>, bool), EvaluateError> {
    if !scene.truth.is_empty() {
        let pairs = scene.frames.iter().zip(&scene.truth);
        let frames = pairs.map(|(f, t)| RecordedFrame {
            depth: &f.depth,
            joints: t.joints.clone(),
        });
        return Ok((scene.joint_names.clone(), frames.collect(), true));
    }
    let fault = |why: String| EvaluateError::new(&scene.name, format!("joints.json: {why}"));
    let file = JointsFile::read(folder).map_err(fault)?;
    let mut frames = Vec::new();
    for t in &file.frames {
        let Some(picture) = scene.frames.get(t.frame) else {
            return Err(fault(format!("no picture {}", t.frame)));
        };
        frames.push(RecordedFrame {
            depth: &picture.depth,
            joints: t.joints.iter().map(|j| P3d::from(*j)).collect(),
        });
    }
    Ok((file.joint_names, frames, false))
}

/// Takes the median offset out of each still; returns the mean offset of each joint of a video.
fn biases(offsets: &mut [Vec<Option<Offsets>>], joints: usize, is_video: bool) -> Vec<V3d> {
    if !is_video {
        for frame in offsets.iter_mut() {
            let first: Vec<V3d> = frame
                .iter()
                .flatten()
                .filter_map(|o| o.first().copied())
                .collect();
            let shift = medians(&first).map_or_else(V3d::zeros, V3d::from);
            frame
                .iter_mut()
                .flatten()
                .flatten()
                .for_each(|o| *o -= shift);
        }
        return vec![V3d::zeros(); joints];
    }
    let of_joint = |j: usize| {
        let heaviest = offsets.iter().filter_map(|f| f[j].as_ref()?.first());
        let near: Vec<V3d> = heaviest
            .filter(|o| o.norm() < SAME_JOINT)
            .copied()
            .collect();
        near.iter().sum::<V3d>() / near.len().max(1) as f64
    };
    (0..joints).map(of_joint).collect()
}

impl RecordedScores {
    /// Adds the scores of another recording.
    pub fn add(&mut self, other: &Self) {
        let add = |a: &mut HitRate, b: &HitRate| {
            a.hits += b.hits;
            a.trials += b.trials;
        };
        for k in 0..2 {
            add(&mut self.joints[k], &other.joints[k]);
        }
        add(&mut self.turned, &other.turned);
        for (name, rate) in &other.per_joint {
            match self.per_joint.iter_mut().find(|p| p.0 == *name) {
                Some(own) => add(&mut own.1, rate),
                None => self.per_joint.push((name.clone(), *rate)),
            }
        }
    }

    /// Adds the facing of one frame.
    fn turned_by(
        &mut self,
        names: &[String],
        frame: &RecordedFrame<'_>,
        person: &RecordedPerson,
        parts: &PersonParts,
    ) {
        let at = |kind: PartKind, side| {
            let class = Some(kind.class(side));
            let j = names.iter().position(|n| class_of(n) == class)?;
            frame.joints.get(j).copied()
        };
        let pair = |kind| Some([at(kind, BodySide::Left)?, at(kind, BodySide::Right)?]);
        let (Some(shoulders), Some(mut hips)) = (pair(PartKind::Shoulder), pair(PartKind::Hip))
        else {
            return;
        };
        // Joints relative to a root: the person's own place gives the line of sight.
        let cells = &person.cells;
        let points = cells
            .iter()
            .map(|&c| person.cloud.centre(c as usize).coords);
        let middle = points.sum::<V3>() / cells.len().max(1) as f32;
        let shift = middle.cast::<f64>() - nalgebra::center(&hips[0], &hips[1]).coords;
        let shoulders = shoulders.map(|p| p + shift);
        hips = hips.map(|p| p + shift);
        let sides = TrunkSides {
            shoulders: Some(shoulders),
            hips: Some(hips),
        };
        if let Some(yaw) = sides.yaw(&person.up) {
            let found = facing(&person.cells(), &parts.yaw);
            self.turned
                .add(found.is_none_or(|f| (f.yaw - yaw).cos() < 0.0));
        }
    }

    /// Counts the joints within reach.
    fn count(&mut self, names: &[String], offsets: &[Vec<Option<Offsets>>], bias: &[V3d]) {
        let within = PartScoreSettings::default().within;
        for (j, name) in names.iter().enumerate() {
            let mut own = HitRate::default();
            for found in offsets.iter().filter_map(|f| f[j].as_ref()) {
                let near = |o: &V3d| (o - bias[j]).norm() < within;
                let first = found.first().is_some_and(near);
                own.add(first);
                self.joints[0].add(first);
                self.joints[1].add(found.iter().any(near));
            }
            if own.trials > 0 {
                self.per_joint.push((name.clone(), own));
            }
        }
    }

    /// One line and a table as text.
    pub fn to_markdown(&self, title: &str) -> String {
        let [first, any] = self.joints.map(|h| HitRate::percent([h].iter()));
        let mut out = format!(
            "{title}: joints within 10 cm {first:.1} % | {any:.1} % (heaviest | any mode), facing beyond 90° {} of {}\n",
            self.turned.hits, self.turned.trials
        );
        let each = |(name, rate): &(String, HitRate)| {
            format!("{name} {:.0} %", HitRate::percent(std::iter::once(rate)))
        };
        out += &self
            .per_joint
            .iter()
            .map(each)
            .collect::<Vec<_>>()
            .join(", ");
        out.push('\n');
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_recordings_have_their_classes() {
        let of = |name| class_of(name);
        assert_eq!(of("R Hand"), Some(PartKind::Hand.class(BodySide::Right)));
        assert_eq!(of("left_ankle"), Some(PartKind::Foot.class(BodySide::Left)));
        assert_eq!(of("Head"), Some(PartKind::Head.class(BodySide::Left)));
        assert_eq!((of("Neck"), of("spine")), (Some(NECK_CLASS), None));
        let names = ["neck", "left_ankle", "left_foot"].map(String::from);
        let foot = PartKind::Foot.class(BodySide::Left);
        assert_eq!(
            classes_of(&names, true),
            [Some(NECK_CLASS), Some(foot), None]
        );
        assert_eq!(classes_of(&names[..1], false), [None]);
    }

    #[test]
    fn stills_lose_their_common_offset_and_videos_that_of_each_joint() {
        let at = |x: f64| Some(vec![V3d::new(x, 0.0, 0.0)]);
        let mut stills = vec![vec![at(1.0), at(1.0), at(1.5)]];
        assert_eq!(biases(&mut stills, 3, false), vec![V3d::zeros(); 3]);
        assert_eq!(stills[0][2], at(0.5));
        let mut video = vec![
            vec![at(0.1), None],
            vec![at(0.05), None],
            vec![at(3.0), None],
        ];
        let bias = biases(&mut video, 2, true);
        assert!((bias[0].x - 0.075).abs() < 1e-12 && bias[1] == V3d::zeros());
    }
}
