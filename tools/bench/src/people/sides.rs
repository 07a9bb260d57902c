//! Row `sides`: the heading of standing people found from nothing at eight yaws, and the size suggested from each, before and
//! after they turn around once.

use super::bars::{Bar, greatest, percent};
use super::common_joints::{Points, heading_error};
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
use tryon_geometry::camera::{DepthImage, NoiseModel};
use tryon_geometry::math::V3d;
use tryon_synth::{Posture, Room, Routine, Sequence, Setting};

/// Yaws from which each person is seen.
const SIDES: usize = 8;
/// Frames of a turn: 3.2 s.
const TURN: usize = 96;
/// Frames until size and shape no longer change, with a margin.
const FRAMES: u64 = 72;
/// Garment whose size is suggested.
const GARMENT: &str = "tshirt";

/// Size and chest of a tracked body.
#[derive(Clone, Copy)]
struct Fit {
    size: Size,
    /// Girth of the chest, metres.
    chest: f64,
    /// Its standard deviation as the tracker states it, metres.
    deviation: f64,
}

/// Result of one side.
struct SideView {
    is_live: bool,
    /// Heading against the truth, radians.
    heading: f64,
    /// Fits before and after a turn.
    fits: [Option<Fit>; 2],
}

fn setting(index: usize, yaw: f64) -> Setting {
    Setting {
        world_from_camera: Setting::tilted(1.1, 4.0, 0.0),
        turn: yaw,
        room: Some(Room::default()),
        noise: [NoiseModel::KinectV1, NoiseModel::TimeOfFlight][index % 2],
        routine: Routine::Hold(Posture::Standing),
        color: false,
        seed: 100 + index as u64,
        ..Setting::default()
    }
}

/// A person on a turntable: depth without noise and joints at each step of a turn.
struct Turntable {
    steps: Vec<(Sequence, Vec<f32>, Points)>,
}

impl Turntable {
    fn new(index: usize, person: &Person) -> Self {
        let step = |k: usize| {
            let yaw = TAU * k as f64 / TURN as f64;
            let sequence = Sequence::new(person.actor.clone(), setting(index, yaw));
            let (surface, truth) = sequence.surface_depth(0);
            (sequence, surface, person.points(&truth))
        };
        Self {
            steps: (0..TURN).map(step).collect(),
        }
    }

    /// Picture of a step with the noise of frame `i`.
    fn picture(&self, step: usize, i: u64) -> DepthImage {
        let (sequence, surface, _) = &self.steps[step % TURN];
        let set = sequence.setting();
        set.noise.apply(&set.camera, surface, set.seed, i)
    }

    /// The person found at a side, and then turned around once.
    fn side(&self, side: usize, sheet: &mut ContactSheet) -> SideView {
        let first = side * TURN / SIDES;
        let (sequence, _, truth) = &self.steps[first];
        let set = sequence.setting();
        let mut session = TrackedSession::new(&embedded::template(), sequence.calibration());
        let mut found = None;
        for i in 0..FRAMES {
            found = session.track(self.picture(first, i));
        }
        sheet.add(
            &set.camera,
            &self.picture(first, 0),
            Some(truth),
            found.as_ref(),
        );
        let before = found.and_then(|_| fit(&session));
        let mut is_live = false;
        for k in 1..=TURN {
            is_live = session.advance(self.picture(first + k, FRAMES + k as u64));
        }
        let up = set.world_from_camera.inverse().vector(&V3d::y());
        SideView {
            is_live: found.is_some(),
            heading: found.map_or(f64::NAN, |f| heading_error(&f, truth, &up)),
            fits: [before, is_live.then(|| fit(&session)).flatten()],
        }
    }
}

/// Size of the garment and chest of the tracked body.
fn fit(session: &TrackedSession) -> Option<Fit> {
    let template = session.model.template();
    let measures = tape(template, &template.personalise(&session.state.shape)).ok()?;
    let suggestion = suggest(GARMENT, &measures).ok()?;
    Some(Fit {
        size: suggestion.size,
        chest: measures.chest,
        deviation: session.state.girth_deviations(&session.model)?.chest,
    })
}

/// True girth of the chest, metres; `None` for a body that the tape cannot measure.
fn chest(person: &Person) -> Option<f64> {
    let actor = &person.actor;
    let rest = actor.template.personalise(&actor.shape);
    Some(tape(&actor.template, &rest).ok()?.chest)
}

/// Fits of people from all sides.
#[derive(Default)]
struct SideFits {
    same: Vec<bool>,
    differing: Vec<(String, f64)>,
    ranges: Vec<f64>,
    /// Of all sides, millimetres.
    errors: Vec<(String, f64)>,
    /// Stated deviations, millimetres.
    deviations: Vec<f64>,
    /// Errors within twice the stated deviation.
    within: Vec<bool>,
}

impl SideFits {
    /// Adds the fits of a person from all sides; `chest` is the true girth, metres.
    fn add(&mut self, name: &str, chest: Option<f64>, fits: impl Iterator<Item = Option<Fit>>) {
        let fits: Vec<Fit> = fits.flatten().collect();
        for (f, chest) in fits.iter().filter_map(|f| Some((f, chest?))) {
            let off = (f.chest - chest).abs();
            self.errors.push((name.to_owned(), 1e3 * off));
            self.within.push(off < 2.0 * f.deviation);
        }
        self.deviations
            .extend(fits.iter().map(|f| 1e3 * f.deviation));
        let is_same = fits.len() == SIDES && fits.iter().all(|f| f.size == fits[0].size);
        self.same.push(is_same);
        let chests = || fits.iter().map(|f| f.chest * 1e3);
        let range = chests().fold(f64::MIN, f64::max) - chests().fold(f64::MAX, f64::min);
        self.ranges.push(range);
        if !is_same {
            let text: Vec<String> = fits.iter().map(|f| f.size.to_string()).collect();
            let name = format!("{name} ({})", text.join(" "));
            self.differing.push((name, range));
        }
    }

    fn bars(self, when: &str) -> [Bar; 5] {
        let count = self.same.len();
        let errors: Vec<f64> = self.errors.iter().map(|e| e.1).collect();
        [
            Bar::new(
                format!("error of the chest girth{when}, median [mm]"),
                median(&errors),
                errors.len(),
            )
            .worst(greatest(self.errors, " mm")),
            Bar::new(
                format!("same T-shirt size from all sides{when} [% of people]"),
                percent(self.same),
                count,
            )
            .worst(greatest(self.differing, " mm of chest")),
            Bar::new(
                format!("range of the chest girth over the sides{when}, median [mm]"),
                median(&self.ranges),
                count,
            ),
            Bar::new(
                format!("stated deviation of the chest girth{when}, median [mm]"),
                median(&self.deviations),
                self.deviations.len(),
            ),
            Bar::new(
                format!("chest girths within two stated deviations{when} [%]"),
                percent(self.within),
                errors.len(),
            ),
        ]
    }
}

/// Measures the row on `people`.
pub(super) fn measure(
    settings: &PeopleSettings,
    people: &[Person],
    sheet: &mut ContactSheet,
) -> Vec<Bar> {
    let (mut right, mut wrong) = (Vec::new(), Vec::new());
    let mut fits = [SideFits::default(), SideFits::default()];
    for (index, person) in people.iter().enumerate() {
        let turntable = Turntable::new(index, person);
        let sides: Vec<SideView> = (0..SIDES).map(|k| turntable.side(k, sheet)).collect();
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
        for (when, fits) in fits.iter_mut().enumerate() {
            let of_sides = sides.iter().map(|s| s.fits[when]);
            fits.add(&person.name, chest(person), of_sides);
        }
    }
    let sides = right.len();
    let facing = Bar::new("facing right, live [%]", percent(right), sides);
    let [before, after] = fits;
    let mut bars = vec![facing.worst(greatest(wrong, "°"))];
    bars.extend(before.bars(""));
    bars.extend(after.bars(" after a turn"));
    bars
}
