//! Row `shops`: furnished rooms, empty, with one person and with three.

use super::bars::{Bar, greatest, percent, quantile};
use super::common_joints::{Points, torso};
use super::contact_sheet::ContactSheet;
use super::person::Person;
use super::session::TrackedSession;
use super::settings::PeopleSettings;
use tryon_body::embedded;
use tryon_geometry::camera::DepthImage;
use tryon_geometry::math::{P3d, V3d};
use tryon_synth::{Routine, Sequence, Setting, Shop, overlay};

/// Rooms of the row.
pub(super) const ROOMS: usize = 20;
/// Frames of each session.
const FRAMES: u64 = 80;
/// Frame that is shown on the contact sheet.
const PICTURE: u64 = 40;
/// Number of the first person's random shape.
const FIRST_PERSON: usize = 100;
/// Frame of the routine of a passer-by.
const PASSER_FRAME: u64 = 56;
/// Frames between the routines of people who stand together.
const APART: u64 = 97;

/// Somebody in a room: sequence without the room, and the frame it starts with.
struct Visitor {
    person: Person,
    sequence: Sequence,
    first: u64,
}

/// Result of one session.
struct Visit {
    room: String,
    /// Frames with a live track of something that is nobody.
    astray: usize,
    /// First frame with a live track of a person.
    found: Option<u64>,
    /// Changes of the tracked person between live frames.
    swaps: usize,
}

fn visitor(settings: &PeopleSettings, index: usize, setting: Setting, first: u64) -> Visitor {
    let person = Person::random(FIRST_PERSON + index, settings);
    Visitor {
        sequence: Sequence::new(person.actor.clone(), setting),
        person,
        first,
    }
}

/// People of a session; with one in every other room somebody passes behind.
fn visitors(settings: &PeopleSettings, shop: &Shop, room: usize, count: usize) -> Vec<Visitor> {
    let turned = |place: usize| Setting {
        turn: 0.25 * ((room * 7 + place * 3) % 5) as f64 - 0.5,
        ..shop.actor_setting(place)
    };
    let phase = |place: usize| (room as u64 * 53 + place as u64 * APART) % 600;
    let mut out: Vec<Visitor> = (0..count)
        .map(|k| visitor(settings, 3 * room + k, turned(k), phase(k)))
        .collect();
    if count == 1 && room % 2 == 1 {
        let [x, z] = settings.passer;
        let base = shop.actor_setting(0);
        let setting = Setting {
            home: base.home + V3d::new(x, 0.0, z),
            routine: Routine::LeaveAndReturn,
            ..base
        };
        out.push(visitor(settings, 3 * room + 1, setting, PASSER_FRAME));
    }
    out
}

/// Depth image of frame `i` and the joints of everybody.
fn picture(shop: &Shop, visitors: &[Visitor], i: u64) -> (DepthImage, Vec<Points>) {
    let mut depth = shop.surface_depth(i);
    let mut people = Vec::new();
    for v in visitors {
        let (surface, truth) = v.sequence.surface_depth(v.first + i);
        overlay(&mut depth, &surface);
        people.push(v.person.points(&truth));
    }
    let set = shop.setting();
    let image = set.noise.apply(&set.camera, &depth, set.seed, i);
    (image, people)
}

/// The person whose torso is within `near` (m) of the tracked one.
pub(super) fn identity(ours: &Points, people: &[Points], near: f64) -> Option<usize> {
    let at: P3d = torso(ours);
    let off = people.iter().map(|p| (torso(p) - at).norm());
    let nearest = off.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
    (nearest.1 < near).then_some(nearest.0)
}

fn visit(
    settings: &PeopleSettings,
    shop: &Shop,
    room: usize,
    count: usize,
    sheet: &mut ContactSheet,
) -> Visit {
    let visitors = visitors(settings, shop, room, count);
    let calibration = tryon_geometry::camera::Calibration::registered(shop.setting().camera);
    let mut session = TrackedSession::new(&embedded::template(), &calibration);
    let mut out = Visit {
        room: format!("room {room}"),
        astray: 0,
        found: None,
        swaps: 0,
    };
    let mut last = None;
    for i in 0..FRAMES {
        let (depth, people) = picture(shop, &visitors, i);
        let ours = sheet.track(&mut session, depth, people.first(), i == PICTURE);
        let Some(ours) = ours else { continue };
        match identity(&ours, &people, settings.near) {
            None => out.astray += 1,
            Some(who) => {
                out.found = out.found.or(Some(i));
                out.swaps += usize::from(last.is_some_and(|l| l != who));
                last = Some(who);
            }
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
    let mut visits: [Vec<Visit>; 3] = Default::default();
    for &room in rooms {
        let shop = Shop::new(room as u64);
        for (k, count) in [0, 1, 3].into_iter().enumerate() {
            visits[k].push(visit(settings, &shop, room, count, sheet));
        }
    }
    let mut bars = Vec::new();
    for (visits, name) in visits.iter().zip(["empty", "one person", "three people"]) {
        bars.push(astray_bar(visits, name));
    }
    for (visits, name) in visits
        .iter()
        .zip(["", "one person", "three people"])
        .skip(1)
    {
        bars.extend(found_bars(visits, name));
    }
    let swaps = visits[2].iter().map(|v| (v.room.clone(), v.swaps as f64));
    let swapped: Vec<(String, f64)> = swaps.filter(|s| s.1 > 0.0).collect();
    let share = percent(visits[2].iter().map(|v| v.swaps > 0));
    let bar = Bar::new(
        "rooms in which the tracked person changes, three people [%]",
        share,
        rooms.len(),
    );
    bars.push(bar.worst(greatest(swapped, " swaps")));
    bars
}

fn astray_bar(visits: &[Visit], name: &str) -> Bar {
    let frames = visits.len() * FRAMES as usize;
    let sum: usize = visits.iter().map(|v| v.astray).sum();
    let worst = visits.iter().filter(|v| v.astray > 0);
    let worst = worst.map(|v| (v.room.clone(), v.astray as f64)).collect();
    Bar::new(
        format!("frames with something else live, {name} [%]"),
        100.0 * sum as f64 / frames as f64,
        frames,
    )
    .worst(greatest(worst, " frames"))
}

fn found_bars(visits: &[Visit], name: &str) -> Vec<Bar> {
    let after = |v: &Visit| v.found.unwrap_or(FRAMES) as f64;
    let times: Vec<f64> = visits.iter().map(after).collect();
    let never = percent(visits.iter().map(|v| v.found.is_none()));
    let late = visits.iter().filter(|v| after(v) > 0.0);
    let late = late.map(|v| (v.room.clone(), after(v))).collect();
    let bar =
        |measure: &str, value: f64| Bar::new(format!("{measure}, {name}"), value, visits.len());
    vec![
        bar("frames until a person is found, p50", quantile(&times, 0.5)),
        bar("frames until a person is found, max", quantile(&times, 1.0))
            .worst(greatest(late, " frames")),
        bar("rooms in which nobody is found [%]", never),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_track_is_somebody_only_near_their_torso() {
        let at = |x: f64| [P3d::new(x, 0.0, 2.0); super::super::common_joints::COUNT];
        let people = [at(0.0), at(1.0)];
        assert_eq!(identity(&at(0.9), &people, 0.4), Some(1));
        assert_eq!(identity(&at(0.5), &people, 0.4), None);
        assert_eq!(identity(&at(0.0), &[], 0.4), None);
    }

    #[test]
    fn visitors_stand_in_the_picture_before_the_furniture() {
        let shop = Shop::new(3);
        let people = visitors(&PeopleSettings::default(), &shop, 3, 3);
        let (empty, nobody) = picture(&shop, &[], 0);
        let (full, truth) = picture(&shop, &people, 0);
        assert!(nobody.is_empty() && truth.len() == 3);
        let nearer = empty.data().iter().zip(full.data());
        let nearer = nearer.filter(|(e, f)| **f > 0 && **f + 300 < **e).count();
        assert!(nearer > 8000, "{nearer} pixels");
    }
}
