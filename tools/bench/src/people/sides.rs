//! Row `sides`: the heading of standing people found from nothing at eight yaws, and the size suggested from each.

use super::bars::{Bar, greatest, percent};
use super::common_joints::heading_error;
use super::contact_sheet::ContactSheet;
use super::person::Person;
use super::session::TrackedSession;
use super::settings::PeopleSettings;
use crate::tracking::median;
use std::f64::consts::{FRAC_PI_4, TAU};
use tryon_body::embedded;
use tryon_body::measure::measure as tape;
use tryon_dressing::suggest;
use tryon_garment::Size;
use tryon_geometry::camera::NoiseModel;
use tryon_geometry::math::V3d;
use tryon_synth::{Posture, Room, Routine, Sequence, Setting};

/// Yaws from which each person is seen.
const SIDES: usize = 8;
/// Frames until size and shape no longer change, with a margin.
const FRAMES: u64 = 72;
/// Garment whose size is suggested.
const GARMENT: &str = "tshirt";

/// Result of one side.
struct SideView {
    is_live: bool,
    /// Heading against the truth, radians.
    heading: f64,
    /// Suggested size and girth of the chest, metres.
    size: Option<(Size, f64)>,
}

fn setting(index: usize, side: usize) -> Setting {
    Setting {
        world_from_camera: Setting::tilted(1.1, 4.0, 0.0),
        turn: TAU * side as f64 / SIDES as f64,
        room: Some(Room::default()),
        noise: [NoiseModel::KinectV1, NoiseModel::TimeOfFlight][index % 2],
        routine: Routine::Hold(Posture::Standing),
        color: false,
        seed: 100 + index as u64,
        ..Setting::default()
    }
}

fn side(person: &Person, setting: Setting, sheet: &mut ContactSheet) -> SideView {
    let sequence = Sequence::new(person.actor.clone(), setting);
    let (surface, truth) = sequence.surface_depth(0);
    let truth = person.points(&truth);
    let set = sequence.setting();
    let picture = |i| set.noise.apply(&set.camera, &surface, set.seed, i);
    let template = embedded::template();
    let mut session = TrackedSession::new(&template, sequence.calibration());
    let mut found = None;
    for i in 0..FRAMES {
        found = session.track(picture(i));
    }
    sheet.add(&set.camera, &picture(0), Some(&truth), found.as_ref());
    let up = set.world_from_camera.inverse().vector(&V3d::y());
    let rest = template.personalise(&session.state.shape);
    let size = || {
        let measures = tape(&template, &rest).ok()?;
        let suggestion = suggest(GARMENT, &measures).ok()?;
        Some((suggestion.size, measures.chest))
    };
    SideView {
        is_live: found.is_some(),
        heading: found.map_or(f64::NAN, |f| heading_error(&f, &truth, &up)),
        size: if found.is_some() { size() } else { None },
    }
}

/// Measures the row on `people`.
pub(super) fn measure(
    settings: &PeopleSettings,
    people: &[Person],
    sheet: &mut ContactSheet,
) -> Vec<Bar> {
    let (mut right, mut wrong, mut same) = (Vec::new(), Vec::new(), Vec::new());
    let (mut differing, mut spread) = (Vec::new(), Vec::new());
    for (index, person) in people.iter().enumerate() {
        let sides: Vec<SideView> = (0..SIDES)
            .map(|k| side(person, setting(index, k), sheet))
            .collect();
        for (k, s) in sides.iter().enumerate() {
            let is_right = s.is_live && s.heading < FRAC_PI_4;
            right.push(is_right);
            if !is_right {
                let off = if s.is_live {
                    s.heading.to_degrees()
                } else {
                    settings.lost_heading
                };
                wrong.push((format!("{} from {}°", person.name, 45 * k), off));
            }
        }
        let sizes: Vec<Size> = sides.iter().filter_map(|s| Some(s.size?.0)).collect();
        let is_same = sizes.len() == SIDES && sizes.iter().all(|s| *s == sizes[0]);
        same.push(is_same);
        let chests: Vec<f64> = sides.iter().filter_map(|s| Some(s.size?.1 * 1e3)).collect();
        let range = chests.iter().copied().fold(f64::MIN, f64::max)
            - chests.iter().copied().fold(f64::MAX, f64::min);
        spread.push(range);
        if !is_same {
            let text: Vec<String> = sizes.iter().map(ToString::to_string).collect();
            differing.push((format!("{} ({})", person.name, text.join(" ")), range));
        }
    }
    let (sides, count) = (right.len(), people.len());
    vec![
        Bar::new("facing right, live [%]", percent(right), sides).worst(greatest(wrong, "°")),
        Bar::new(
            "same T-shirt size from all sides [% of people]",
            percent(same),
            count,
        )
        .worst(greatest(differing, " mm of chest")),
        Bar::new(
            "range of the chest girth over the sides, median [mm]",
            median(&spread),
            count,
        ),
    ]
}
