//! Row `crossing`: somebody is tracked while another person walks past, before or behind them.

use super::bars::{Bar, percent};
use super::contact_sheet::ContactSheet;
use super::person::Person;
use super::session::TrackedSession;
use super::settings::PeopleSettings;
use super::shops::identity;
use tryon_body::embedded;
use tryon_geometry::camera::NoiseModel;
use tryon_geometry::math::V3d;
use tryon_synth::{Room, Routine, Sequence, Setting, overlay};

/// Cases of the row.
pub(super) const CASES: usize = 24;
/// Frames of each case: the other one is in the picture from about the thirtieth to the ninetieth.
const FRAMES: u64 = 130;
/// Frames at the end in which the first person is to be live again.
const LAST: u64 = 20;
/// Frame of the other one's routine at the start: on the way in 1 s.
const OTHER_FRAME: u64 = 50;
/// Numbers of the random shapes.
const FIRST_PERSON: usize = 300;
/// Distances of the other one's way before the first person, metres.
const WAYS: [f64; 4] = [0.9, 0.6, -0.6, -0.9];
/// Frames of the first person's figure of eight at the start.
const WALK_FRAMES: [u64; 2] = [200, 300];
/// Frames shown on the contact sheet.
const SHOWN: [u64; 3] = [50, 66, 120];

/// Outcome of one crossing.
#[derive(Clone, Copy)]
struct Crossing {
    /// The other one was live at some time.
    is_swapped: bool,
    /// The first one was live in most of the last frames.
    is_kept: bool,
}

/// First and other person of a case, the second number the frame of the routine.
fn pair(settings: &PeopleSettings, case: usize) -> [(Person, Sequence, u64); 2] {
    let walks = case / WAYS.len() % 2 == 1;
    let home = Setting::default().home;
    let setting = Setting {
        world_from_camera: Setting::tilted(1.2, 6.0, 0.0),
        room: None,
        noise: [NoiseModel::KinectV1, NoiseModel::TimeOfFlight][case % 2],
        color: false,
        seed: 500 + case as u64,
        ..Setting::default()
    };
    let first = Setting {
        routine: if walks { Routine::Walk } else { Routine::TryOn },
        ..setting.clone()
    };
    let other = Setting {
        routine: Routine::LeaveAndReturn,
        home: home + V3d::new(-1.8, 0.0, WAYS[case % WAYS.len()]),
        ..setting
    };
    let start = [
        if walks { WALK_FRAMES[case / 8 % 2] } else { 60 },
        OTHER_FRAME,
    ];
    let mut people = [first, other].into_iter().enumerate().map(|(k, setting)| {
        let person = Person::random(FIRST_PERSON + 2 * case + k, settings);
        let sequence = Sequence::new(person.actor.clone(), setting);
        (person, sequence, start[k])
    });
    std::array::from_fn(|_| people.next().expect("two"))
}

fn cross(settings: &PeopleSettings, case: usize, sheet: &mut ContactSheet) -> Crossing {
    let people = pair(settings, case);
    let set = Setting {
        room: Some(Room::default()),
        routine: Routine::Empty,
        ..people[0].1.setting().clone()
    };
    let room = Sequence::new(people[0].0.actor.clone(), set);
    let mut session = TrackedSession::new(&embedded::template(), room.calibration());
    let (mut swapped, mut kept) = (0, 0);
    for i in 0..FRAMES {
        let mut depth = room.surface_depth(i).0;
        let truth = people.each_ref().map(|(person, sequence, first)| {
            let (surface, truth) = sequence.surface_depth(first + i);
            overlay(&mut depth, &surface);
            person.points(&truth)
        });
        let set = room.setting();
        let image = set.noise.apply(&set.camera, &depth, set.seed, i);
        let ours = sheet.track(&mut session, image, truth.first(), SHOWN.contains(&i));
        match ours.and_then(|o| identity(&o, &truth, settings.near)) {
            Some(0) => kept += u64::from(i + LAST >= FRAMES),
            Some(_) => swapped += 1,
            None => {}
        }
    }
    Crossing {
        is_swapped: swapped > 0,
        is_kept: swapped == 0 && 2 * kept > LAST,
    }
}

/// Measures the row on `cases`.
pub(super) fn measure(
    settings: &PeopleSettings,
    cases: &[usize],
    sheet: &mut ContactSheet,
) -> Vec<Bar> {
    let crossings: Vec<(usize, Crossing)> = cases
        .iter()
        .map(|&case| (case, cross(settings, case, sheet)))
        .collect();
    let bar = |measure: &str, is_it: &dyn Fn(&Crossing) -> bool, named: bool| {
        let all = crossings.iter();
        let share = percent(all.clone().map(|(_, c)| is_it(c)));
        let worst = all.filter(|(_, c)| is_it(c) == named);
        let worst = worst.map(|(case, _)| format!("case {case}")).collect();
        Bar::new(measure, share, cases.len()).worst(worst)
    };
    vec![
        bar("the first person kept [%]", &|c| c.is_kept, false),
        bar(
            "the other one live at some time [%]",
            &|c| c.is_swapped,
            true,
        ),
    ]
}
