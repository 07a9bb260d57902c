//! Row `limb`: arms that are elsewhere from one frame to the next, and the time until they are found again.

use super::bars::{Bar, greatest, quantile};
use super::common_joints::{Points, errors_mm};
use super::contact_sheet::ContactSheet;
use super::person::Person;
use super::session::TrackedSession;
use super::settings::PeopleSettings;
use tryon_body::embedded;
use tryon_geometry::camera::NoiseModel;
use tryon_synth::{Posture, Room, Routine, Sequence, Setting};

/// Cases of the row.
pub(super) const CASES: usize = 24;
/// Frames before the jump, and at most after it.
const BEFORE: u64 = 30;
const AFTER: u64 = 60;
/// Number of the first person's random shape.
const FIRST_PERSON: usize = 200;
/// Shoulder, elbow and wrist of both arms among the common joints.
const ARMS: [[usize; 3]; 2] = [[0, 2, 4], [1, 3, 5]];
/// Postures before and after the jump.
const JUMPS: [[Posture; 2]; 8] = [
    [Posture::Standing, Posture::HandsOnHips],
    [Posture::Standing, Posture::Overhead],
    [Posture::Standing, Posture::HandsJoined],
    [Posture::Standing, Posture::ArmsCrossed],
    [Posture::Overhead, Posture::Standing],
    [Posture::HandsOnHips, Posture::Overhead],
    [Posture::ArmsCrossed, Posture::Standing],
    [Posture::HandsJoined, Posture::HandsOnHips],
];

fn sequence(person: &Person, case: usize, posture: Posture) -> Sequence {
    let setting = Setting {
        world_from_camera: Setting::tilted(1.1, 4.0, 0.0),
        turn: 0.2 * (case % 5) as f64 - 0.4,
        room: Some(Room::default()),
        noise: [NoiseModel::KinectV1, NoiseModel::TimeOfFlight][case / 2 % 2],
        routine: Routine::Hold(posture),
        color: false,
        seed: 300 + case as u64,
        ..Setting::default()
    };
    Sequence::new(person.actor.clone(), setting)
}

/// Frames until all joints of each arm are found; [`AFTER`] when they never are.
fn jump(settings: &PeopleSettings, case: usize, sheet: &mut ContactSheet) -> [f64; 2] {
    let person = Person::random(FIRST_PERSON + case, settings);
    let [from, to] = JUMPS[case % JUMPS.len()].map(|p| sequence(&person, case, p));
    let mut session = TrackedSession::new(&embedded::template(), from.calibration());
    let set = from.setting().clone();
    let (surface, _) = from.surface_depth(0);
    for i in 0..BEFORE {
        session.advance(set.noise.apply(&set.camera, &surface, set.seed, i));
    }
    let (surface, truth) = to.surface_depth(0);
    let truth = person.points(&truth);
    let is_found = |ours: &Points, arm: usize| {
        let off = errors_mm(ours, &truth);
        ARMS[arm].iter().all(|&k| off[k] < settings.found_limb)
    };
    let mut found = [None; 2];
    for i in 0..AFTER {
        let depth = set.noise.apply(&set.camera, &surface, set.seed, BEFORE + i);
        let last = (i + 1 == AFTER).then(|| depth.clone());
        let ours = session.track(depth);
        for (arm, at) in found.iter_mut().enumerate() {
            if at.is_none() && ours.as_ref().is_some_and(|o| is_found(o, arm)) {
                *at = Some(i as f64);
            }
        }
        if let Some(depth) = last {
            sheet.add(&set.camera, &depth, Some(&truth), ours.as_ref());
        }
    }
    found.map(|f| f.unwrap_or(AFTER as f64))
}

/// Measures the row on `cases`.
pub(super) fn measure(
    settings: &PeopleSettings,
    cases: &[usize],
    sheet: &mut ContactSheet,
) -> Vec<Bar> {
    let (mut times, mut named) = (Vec::new(), Vec::new());
    for &case in cases {
        let [from, to] = JUMPS[case % JUMPS.len()];
        for (time, side) in jump(settings, case, sheet)
            .into_iter()
            .zip(["left", "right"])
        {
            times.push(time);
            named.push((format!("case {case} {from:?}→{to:?} {side}"), time));
        }
    }
    let bar = |measure: &str, q: f64| {
        let measure = format!("frames until a lost arm is found, {measure}");
        Bar::new(measure, quantile(&times, q), times.len())
    };
    vec![
        bar("median", 0.5),
        bar("p95", 0.95),
        bar("worst", 1.0).worst(greatest(named, " frames")),
    ]
}
