//! Row `unlike`: dances of bodies far outside the shape space, tracked from nothing with the embedded body.

use super::bars::{Bar, greatest, percent};
use super::common_joints::{ConventionOffsets, FrameError, Points};
use super::contact_sheet::ContactSheet;
use super::person::Person;
use super::plan::PeoplePlan;
use super::session::TrackedSession;
use super::settings::PeopleSettings;
use crate::EvaluateError;
use crate::tracking::mean;
use std::path::Path;
use tryon_body::embedded;
use tryon_formats::{MotionClip, read_motion};
use tryon_geometry::camera::NoiseModel;
use tryon_geometry::math::P3d;
use tryon_synth::{Posture, Room, Routine, Sequence, Setting};

/// Folder below the data with the motion clips.
const MOTIONS: &str = "motion/cmu_asf_amc";
/// Clips: Charleston, jumping jacks, sword.
const CLIPS: [(&str, &str); 3] = [
    ("charleston", "93_04.amc"),
    ("jacks", "13_29.amc"),
    ("sword", "02_07.amc"),
];
const NOISES: [(&str, NoiseModel); 2] = [
    ("kinect1", NoiseModel::KinectV1),
    ("tof", NoiseModel::TimeOfFlight),
];
/// First frame (one second of blending from the calibration pose, then the clip) and number of frames.
const FIRST: u64 = 30;
const FRAMES: u64 = 90;
/// Frames between pictures of a contact sheet.
const PICTURE_INTERVAL: u64 = 40;

/// Live frames of one sequence, ours and true.
struct TrackedClip {
    name: String,
    pairs: Vec<(Points, Points)>,
}

fn setting(settings: &PeopleSettings, noise: NoiseModel) -> Setting {
    Setting {
        world_from_camera: Setting::tilted(1.1, 4.0, 0.0),
        home: P3d::new(0.0, 0.0, -settings.unlike_away),
        room: Some(Room {
            back_z: -5.0,
            left_x: -2.6,
            ..Room::default()
        }),
        noise,
        color: false,
        seed: 31,
        ..Setting::default()
    }
}

fn follow(person: &Person, sequence: &Sequence, sheet: &mut ContactSheet) -> Vec<(Points, Points)> {
    let mut session = TrackedSession::new(&embedded::template(), sequence.calibration());
    let mut pairs = Vec::new();
    for i in FIRST..FIRST + FRAMES {
        let (frame, truth) = sequence.frame(i);
        let truth = person.points(&truth);
        let is_shown = i % PICTURE_INTERVAL == 0;
        let ours = sheet.track(&mut session, frame.depth, Some(&truth), is_shown);
        pairs.extend(ours.map(|o| (o, truth)));
    }
    pairs
}

/// Adds the standing body from the front and from the side, without noise, to a sheet.
fn show(settings: &PeopleSettings, person: &Person, sheet: &mut ContactSheet) {
    for turn in [0.0, 0.5 * std::f64::consts::PI] {
        let setting = Setting {
            world_from_camera: Setting::tilted(1.0, 0.0, 0.0),
            turn,
            room: None,
            noise: NoiseModel::None,
            routine: Routine::Hold(Posture::Standing),
            ..setting(settings, NoiseModel::None)
        };
        let sequence = Sequence::new(person.actor.clone(), setting);
        let (frame, truth) = sequence.frame(0);
        let points = person.points(&truth);
        let camera = &sequence.setting().camera;
        sheet.add(camera, &frame.depth, Some(&points), None);
    }
}

/// Clips and noises to run: all, or the first of each kind.
fn clips(
    data: &Path,
    is_quick: bool,
) -> Result<Vec<(String, MotionClip, NoiseModel)>, EvaluateError> {
    let mut out = Vec::new();
    for (k, (clip, file)) in CLIPS.iter().enumerate() {
        let motion = read_motion(&data.join(MOTIONS).join(file));
        let motion = motion.map_err(|e| EvaluateError::new(clip, e))?;
        for (n, (noise, model)) in NOISES.iter().enumerate() {
            if !is_quick || n == k % 2 {
                out.push((
                    format!("{clip} {noise}"),
                    motion.clone().at_cmu_rate(),
                    *model,
                ));
            }
        }
    }
    Ok(out)
}

/// Measures the row on `people`.
pub(super) fn measure(
    plan: &PeoplePlan,
    data: &Path,
    people: &[Person],
    sheet: &mut ContactSheet,
) -> Result<Vec<Bar>, EvaluateError> {
    let settings = &plan.settings;
    let clips = clips(data, plan.quick)?;
    let mut all = Vec::new();
    let mut bars = Vec::new();
    people.iter().for_each(|p| show(settings, p, sheet));
    for person in people {
        let mut tracked = Vec::new();
        for (name, clip, noise) in &clips {
            let sequence = Sequence::new(person.actor.clone(), setting(settings, *noise))
                .with_clip(clip.clone())
                .map_err(|e| EvaluateError::new(name, e))?;
            tracked.push(TrackedClip {
                name: format!("{} {name}", person.name),
                pairs: follow(person, &sequence, sheet),
            });
        }
        let offsets = ConventionOffsets::fit(tracked.iter().flat_map(|t| &t.pairs));
        let errors = |t: &TrackedClip| -> Vec<FrameError> {
            let pairs = t.pairs.iter();
            pairs
                .map(|(ours, truth)| FrameError::new(ours, &offsets.convert(truth)))
                .collect()
        };
        let of_person: Vec<(String, Vec<FrameError>)> = tracked
            .iter()
            .map(|t| (t.name.clone(), errors(t)))
            .collect();
        bars.push(person_bar(&person.name, &of_person));
        all.extend(of_person);
    }
    let mut out = summary(settings, &all);
    out.extend(bars);
    Ok(out)
}

fn means(frames: &[FrameError]) -> f64 {
    mean(&frames.iter().map(|e| e.mean).collect::<Vec<_>>())
}

/// The bars over all people.
fn summary(settings: &PeopleSettings, clips: &[(String, Vec<FrameError>)]) -> Vec<Bar> {
    let frames: Vec<FrameError> = clips.iter().flat_map(|c| c.1.iter().copied()).collect();
    let n = frames.len();
    let of_clips = |f: &dyn Fn(&[FrameError]) -> f64| {
        let values = clips.iter().map(|(name, e)| (name.clone(), f(e)));
        values.collect::<Vec<_>>()
    };
    let far = |e: &[FrameError]| percent(e.iter().map(|e| e.mean > settings.far));
    let bad = |e: &[FrameError]| percent(e.iter().map(|e| e.is_bad(settings)));
    let live = |e: &[FrameError]| 100.0 * e.len() as f64 / FRAMES as f64;
    let lost = of_clips(&|e| 100.0 - live(e));
    let bar = |measure: &str, value: f64| Bar::new(measure, value, n);
    vec![
        bar("joint error, mean [mm]", means(&frames)).worst(greatest(of_clips(&means), " mm")),
        bar("frames over 40 mm [%]", far(&frames)).worst(greatest(of_clips(&far), " %")),
        bar("bad live frames [%]", bad(&frames)).worst(greatest(of_clips(&bad), " %")),
        bar("live frames [%]", live(&frames) / clips.len().max(1) as f64).worst(greatest(
            lost.into_iter().filter(|l| l.1 > 0.0).collect(),
            " % lost",
        )),
    ]
}

/// The mean error of one person, with its worst joints.
fn person_bar(name: &str, clips: &[(String, Vec<FrameError>)]) -> Bar {
    let frames: Vec<FrameError> = clips.iter().flat_map(|c| c.1.iter().copied()).collect();
    let worst = clips.iter().filter_map(|(clip, errors)| {
        let e = errors.iter().max_by(|a, b| a.worst.total_cmp(&b.worst))?;
        let clip = clip.trim_start_matches(name).trim();
        Some((format!("{clip} {}", e.joint), e.worst))
    });
    let bar = Bar::new(
        format!("{name}: joint error, mean [mm]"),
        means(&frames),
        frames.len(),
    );
    bar.worst(greatest(worst.collect(), " mm"))
}
