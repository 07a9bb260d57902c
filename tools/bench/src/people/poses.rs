//! Row `poses`: people found from nothing in postures that are no calibration pose.

use super::bars::{Bar, greatest, percent};
use super::common_joints::{ConventionOffsets, FrameError, Points};
use super::contact_sheet::ContactSheet;
use super::person::Person;
use super::session::TrackedSession;
use super::settings::PeopleSettings;
use rand::{Rng, SeedableRng};
use std::f64::consts::PI;
use tryon_body::embedded;
use tryon_geometry::camera::{DepthImage, Intrinsics, NoiseModel};
use tryon_geometry::math::P3d;
use tryon_synth::{Posture, Room, Routine, Sequence, Setting};
use tryon_tracking::Status;

/// Frames until a person must be found.
const FRAMES: u64 = 10;
const SEED: u64 = 0x5eed_0002;

/// Name, posture, turn (radians), and whether only head and trunk are in the picture.
const POSES: [(&str, Posture, f64, bool); 8] = [
    ("hands joined", Posture::HandsJoined, 0.0, false),
    ("arms crossed", Posture::ArmsCrossed, 0.0, false),
    ("hands on hips", Posture::HandsOnHips, 0.0, false),
    ("overhead", Posture::Overhead, 0.0, false),
    ("from behind", Posture::Standing, PI, false),
    ("waist up", Posture::Standing, 0.0, true),
    ("crouching", Posture::Crouching, 0.0, false),
    ("one knee", Posture::OneKnee, 0.0, false),
];

/// Somebody on a chair, who is said to sit; the others aren't.
const SEATED: (&str, Posture, f64, bool) = ("sitting", Posture::Sitting, 0.0, false);

/// One still: last depth image, truth, joints of a live pose, and the last status.
struct Still {
    status: Status,
    sequence: Sequence,
    depth: DepthImage,
    truth: Points,
    found: Option<Points>,
}

/// Setting of case `pose` of person `index`: distance, turn and noise drawn from the case's numbers.
fn setting(settings: &PeopleSettings, index: usize, pose: usize) -> Setting {
    let (_, posture, turn, waist_up) = *POSES.get(pose).unwrap_or(&SEATED);
    let mut rng = rand_pcg::Pcg32::seed_from_u64(SEED + (index * POSES.len() + pose) as u64);
    let turn = turn + rng.random_range(-settings.turn..settings.turn);
    let away = if waist_up {
        1.25
    } else {
        rng.random_range(settings.away[0]..settings.away[1])
    };
    let (height, down) = if waist_up { (1.35, 0.0) } else { (1.1, 4.0) };
    Setting {
        world_from_camera: Setting::tilted(height, down, 0.0),
        home: P3d::new(rng.random_range(-0.25..0.25), 0.0, -away),
        turn,
        room: Some(Room::default()),
        noise: [NoiseModel::KinectV1, NoiseModel::TimeOfFlight][(index + pose) % 2],
        routine: Routine::Hold(posture),
        color: false,
        seed: index as u64,
        ..Setting::default()
    }
}

fn still(person: &Person, setting: Setting) -> Still {
    let sequence = Sequence::new(person.actor.clone(), setting);
    let (surface, truth) = sequence.surface_depth(0);
    let set = sequence.setting();
    let picture = |i| set.noise.apply(&set.camera, &surface, set.seed, i);
    let mut session = TrackedSession::new(&embedded::template(), sequence.calibration());
    let mut found = None;
    for i in 0..FRAMES {
        found = session.track(picture(i));
    }
    Still {
        status: session.state.status,
        depth: picture(0),
        truth: person.points(&truth),
        found,
        sequence,
    }
}

/// A joint in the picture: of the others nothing can be known.
fn is_in_view(camera: &Intrinsics, p: &P3d) -> bool {
    let q = camera.project(&p.cast());
    let (w, h) = (camera.width as f32, camera.height as f32);
    p.z > 0.0 && (0.0..w).contains(&q.x) && (0.0..h).contains(&q.y)
}

/// Measures the row on `people`.
pub(super) fn measure(
    settings: &PeopleSettings,
    people: &[Person],
    sheet: &mut ContactSheet,
) -> Vec<Bar> {
    let mut hits: [Vec<bool>; POSES.len()] = Default::default();
    let mut misses: [Vec<(String, f64)>; POSES.len()] = Default::default();
    let (mut seated, mut others) = (Vec::new(), Vec::new());
    for (index, person) in people.iter().enumerate() {
        let status = still(person, setting(settings, index, POSES.len())).status;
        seated.push((person.name.clone(), status));
        let stills: Vec<Still> = (0..POSES.len())
            .map(|k| still(person, setting(settings, index, k)))
            .collect();
        let offsets = offsets(person, &stills);
        for (k, still) in stills.iter().enumerate() {
            let truth = offsets
                .as_ref()
                .map_or(still.truth, |o| o.convert(&still.truth));
            let camera = still.sequence.setting().camera;
            let error = still
                .found
                .map(|f| FrameError::among(&f, &truth, |p| is_in_view(&camera, p)));
            let is_found = error
                .is_some_and(|e| e.mean < settings.found_mean && e.worst < settings.found_worst);
            hits[k].push(is_found);
            others.push((format!("{} {}", person.name, POSES[k].0), still.status));
            if !is_found {
                let name = error.map_or("lost".to_owned(), |e| e.joint.to_owned());
                let worst = error.map_or(settings.lost, |e| e.worst);
                misses[k].push((format!("{} ({name})", person.name), worst));
            }
            sheet.add(&camera, &still.depth, Some(&truth), still.found.as_ref());
        }
    }
    let all = Bar::new(
        "found, all poses [%]",
        percent(hits.iter().flatten().copied()),
        hits.iter().map(Vec::len).sum(),
    );
    let each = POSES.iter().zip(hits).zip(misses).map(|((p, h), m)| {
        let cases = h.len();
        Bar::new(format!("found, {} [%]", p.0), percent(h), cases).worst(greatest(m, " mm"))
    });
    let ends = [
        seat_bar("said to sit, who sits [%]", &seated, true),
        seat_bar("said to sit, who doesn't [%]", &others, false),
    ];
    std::iter::once(all).chain(each).chain(ends).collect()
}

/// Share of the cases that are said to sit; names those that are not as `expected`, with their status.
fn seat_bar(measure: &str, cases: &[(String, Status)], expected: bool) -> Bar {
    let sits = |status: &Status| *status == Status::Sitting;
    let wrong = cases.iter().filter(|(_, status)| sits(status) != expected);
    let names = wrong.map(|(name, status)| format!("{name} ({status:?})"));
    let share = percent(cases.iter().map(|(_, status)| sits(status)));
    Bar::new(measure, share, cases.len()).worst(names.collect())
}

/// Offsets of a foreign skeleton: the median over this person's live poses.
fn offsets(person: &Person, stills: &[Still]) -> Option<ConventionOffsets> {
    let pairs: Vec<(Points, Points)> = stills
        .iter()
        .filter_map(|s| Some((s.found?, s.truth)))
        .collect();
    person
        .is_foreign
        .then(|| ConventionOffsets::fit(pairs.iter()))
}
