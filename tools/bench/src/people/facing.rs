//! Row `facing`: people whose front is hard to tell, in furnished rooms: they walk towards the camera, or their trousers give
//! no return.

use super::bars::{Bar, greatest, percent};
use super::common_joints::{Points, heading_error};
use super::contact_sheet::ContactSheet;
use super::person::Person;
use super::session::TrackedSession;
use super::settings::PeopleSettings;
use crate::corruptions::drop_returns;
use std::f64::consts::FRAC_PI_2;
use tryon_body::embedded;
use tryon_geometry::camera::{Calibration, DepthImage, Intrinsics};
use tryon_geometry::math::{P3d, V3d};
use tryon_synth::{Routine, Sequence, Setting, Shop, overlay};

/// Rooms of the row.
pub(super) const ROOMS: usize = 12;
/// Frames of each case.
const FRAMES: u64 = 130;
/// Frame shown on the contact sheet.
const SHOWN: u64 = 60;
/// Number of the first person's random shape.
const FIRST_PERSON: usize = 400;
/// Radius about the bones of the legs within which trousers give no return, metres.
const TROUSERS: f32 = 0.16;
/// Hips, knees and ankles among the common joints, left and right.
const LEGS: [[usize; 3]; 2] = [[6, 8, 10], [7, 9, 11]];

/// Live frames of one case, and those that face the other way.
#[derive(Default)]
struct Faced {
    live: usize,
    reversed: usize,
}

/// Cases of the row.
#[derive(Clone, Copy)]
enum Case {
    Approach,
    DarkTrousers,
}

impl Case {
    fn name(self) -> &'static str {
        match self {
            Self::Approach => "walking towards the camera",
            Self::DarkTrousers => "trousers without return",
        }
    }

    fn setting(self, shop: &Shop, room: usize) -> Setting {
        let base = shop.actor_setting(0);
        match self {
            Self::Approach => Setting {
                routine: Routine::Approach,
                home: P3d::new(0.0, 0.0, base.home.z),
                turn: 0.0,
                ..base
            },
            Self::DarkTrousers => Setting {
                turn: 0.3 * (room % 3) as f64 - 0.3,
                ..base
            },
        }
    }
}

/// Takes the readings of the legs away.
fn darken(image: &mut DepthImage, camera: &Intrinsics, person: &Points) {
    for [hip, knee, ankle] in LEGS {
        for bone in [[hip, knee], [knee, ankle]] {
            let segment = bone.map(|j| person[j].cast());
            drop_returns(image, camera, &segment, TROUSERS);
        }
    }
}

fn face(settings: &PeopleSettings, case: Case, room: usize, sheet: &mut ContactSheet) -> Faced {
    let shop = Shop::new(room as u64);
    let person = Person::random(FIRST_PERSON + room, settings);
    let sequence = Sequence::new(person.actor.clone(), case.setting(&shop, room));
    let set = shop.setting();
    let calibration = Calibration::registered(set.camera);
    let mut session = TrackedSession::new(&embedded::template(), &calibration);
    let up = set.world_from_camera.inverse().vector(&V3d::y());
    let mut out = Faced::default();
    for i in 0..FRAMES {
        let mut depth = shop.surface_depth(i);
        let (surface, truth) = sequence.surface_depth(i);
        let truth = person.points(&truth);
        overlay(&mut depth, &surface);
        let mut image = set.noise.apply(&set.camera, &depth, set.seed, i);
        if matches!(case, Case::DarkTrousers) {
            darken(&mut image, &set.camera, &truth);
        }
        if let Some(ours) = sheet.track(&mut session, image, Some(&truth), i == SHOWN) {
            out.live += 1;
            out.reversed += usize::from(heading_error(&ours, &truth, &up) > FRAC_PI_2);
        }
    }
    out
}

/// Measures the row in `rooms`.
pub(super) fn measure(
    settings: &PeopleSettings,
    rooms: &[usize],
    sheet: &mut ContactSheet,
) -> Vec<Bar> {
    let mut bars = Vec::new();
    for case in [Case::Approach, Case::DarkTrousers] {
        let faced: Vec<(usize, Faced)> = rooms
            .iter()
            .map(|&room| (room, face(settings, case, room, sheet)))
            .collect();
        let frames = rooms.len() * FRAMES as usize;
        let live: usize = faced.iter().map(|(_, f)| f.live).sum();
        let named = |count: fn(&Faced) -> usize| {
            let counts = faced.iter().map(|(room, f)| (room, count(f) as f64));
            let some = counts.filter(|c| c.1 > 0.0);
            some.map(|(room, n)| (format!("room {room}"), n)).collect()
        };
        let right = percent(faced.iter().map(|(_, f)| f.reversed == 0));
        let name = case.name();
        bars.push(
            Bar::new(
                format!("people right or undecided, {name} [%]"),
                right,
                rooms.len(),
            )
            .worst(greatest(named(|f| f.reversed), " frames")),
        );
        bars.push(
            Bar::new(
                format!("live frames, {name} [%]"),
                100.0 * live as f64 / frames as f64,
                frames,
            )
            .worst(greatest(
                named(|f| FRAMES as usize - f.live),
                " frames not live",
            )),
        );
    }
    bars
}
