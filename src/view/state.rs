//! Memory between pictures: colours of one user's skin and clothes, light of the room, grain and blur of the camera, times of
//! the last measurements.

use super::focus::Focus;
use super::grain::Grain;
use super::own_clothes::Plate;
use super::room_light::RoomLight;
use super::settings::{RoomLightSettings, SkinSettings};
use super::skin::{MIN_TONES, SkinClassifier, tone};
use serde::{Deserialize, Serialize};

/// Memory between pictures. Of colours one a place of the body: the classifier is fitted to the last few pictures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Tones by [`ColorRegion`] and slot; `None` = never seen.
    colors: [Vec<Option<[f32; 3]>>; 4],
    /// Number of pictures in which colours were taken.
    pictures: u32,
    /// Colour decided in the last picture; keeps the decision under small changes.
    usable: bool,
    /// Capture time of the last measurement of garments off the person, nanoseconds; `None` = never.
    #[serde(default)]
    off_person_ns: Option<u64>,
    /// Place of the person, which crops follow.
    #[serde(default)]
    pub(super) focus: Option<Focus>,
    /// The scene without the person. A picture of somebody's room goes nowhere.
    #[serde(skip)]
    pub(super) plate: Plate,
    /// Colours of the face as last seen: who turns around has the same skin.
    #[serde(default)]
    pub(super) face: Vec<[u8; 3]>,
    /// Light of the room.
    #[serde(default)]
    pub(super) room_light: Option<RoomLight>,
    /// Grain of the camera, grey levels.
    #[serde(default)]
    grain: f32,
    /// Blur of the camera, pixels.
    #[serde(default)]
    pub(super) blur: f32,
    /// Capture time of the last measurement of both, nanoseconds; `None` = never.
    #[serde(default)]
    room_ns: Option<u64>,
}

/// Measured traits of the camera's picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct CameraTraits {
    /// Standard deviation of the noise, grey levels.
    pub(super) grain: Option<f32>,
    /// Standard deviation of the blur, pixels.
    pub(super) blur: Option<f32>,
}

/// Region of the body a colour was taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ColorRegion {
    Forearm,
    Hand,
    Face,
    Trunk,
}

/// Places with a remembered colour, by [`ColorRegion`].
const SLOTS: [usize; 4] = [160, 64, 64, 320];
/// Pictures in which all places are sampled once, after the first picture.
const TURNS: usize = 4;

impl State {
    /// Forgets the colours when no body is tracked: the next one may be another person.
    pub(crate) fn keep_if(&mut self, tracked: bool) {
        if !tracked && self.pictures > 0 {
            *self = Self {
                off_person_ns: self.off_person_ns,
                focus: self.focus,
                plate: std::mem::take(&mut self.plate),
                room_light: self.room_light,
                grain: self.grain,
                blur: self.blur,
                room_ns: self.room_ns,
                ..Self::default()
            };
        }
    }

    /// Begins a measurement of garments off the person in the picture of `time_ns`, if one is due `interval` seconds after
    /// the last one.
    pub(super) fn begin_off_person(&mut self, interval: f64, time_ns: u64) -> bool {
        let is_due = is_due(self.off_person_ns, interval, time_ns);
        if is_due {
            self.off_person_ns = Some(time_ns);
        }
        is_due
    }

    /// True when light of the room and grain are to be measured in the picture of `time_ns`: `interval` seconds after the last
    /// time.
    pub(super) fn is_room_due(&self, interval: f64, time_ns: u64) -> bool {
        is_due(self.room_ns, interval, time_ns)
    }

    /// Grain of a picture by the number of its exposure.
    pub(super) fn grain_of(&self, sequence: u64) -> Grain {
        Grain {
            sigma: self.grain,
            picture: sequence as u32,
        }
    }

    /// Takes a measured light of the room, and grain and blur of the camera, each where there is one.
    pub(super) fn take_room(
        &mut self,
        light: Option<RoomLight>,
        camera: CameraTraits,
        time_ns: u64,
        settings: &RoomLightSettings,
    ) {
        let passed = self.room_ns.map(|last| time_ns.saturating_sub(last));
        let passed = passed.map_or(f32::INFINITY, |ns| (ns as f64 * 1e-9) as f32);
        if let Some(new) = light {
            let old = self.room_light.unwrap_or(new);
            self.room_light = Some(old.toward(&new, passed, settings));
        }
        let share = settings.share(passed);
        for (kept, new) in [
            (&mut self.grain, camera.grain),
            (&mut self.blur, camera.blur),
        ] {
            *kept += (new.unwrap_or(*kept) - *kept) * share;
        }
        self.room_ns = Some(time_ns);
    }

    /// Slot and vertex of the `vertices` to sample in this picture.
    pub(super) fn due<'a>(
        &'a self,
        source: ColorRegion,
        vertices: &'a [u32],
    ) -> impl Iterator<Item = (usize, u32)> + use<'a> {
        let slots = SLOTS[source as usize].min(vertices.len());
        let (first, turn) = (self.pictures == 0, self.pictures as usize % TURNS);
        (0..slots)
            .filter(move |s| first || s % TURNS == turn)
            .map(move |s| (s, vertices[s * vertices.len() / slots]))
    }

    /// Remembers the sRGB colour of a place.
    pub(super) fn put(&mut self, source: ColorRegion, slot: usize, rgb: [u8; 3]) {
        let colors = &mut self.colors[source as usize];
        if colors.len() <= slot {
            colors.resize(slot + 1, None);
        }
        colors[slot] = Some(tone(rgb));
    }

    /// Fits the classifier; `None` if colour does not separate skin from clothes. Once a picture, after its colours.
    pub(super) fn fit_skin(&mut self, settings: &SkinSettings) -> Option<SkinClassifier> {
        self.pictures = self.pictures.saturating_add(1);
        let tones = |s: ColorRegion| -> Vec<[f32; 3]> {
            self.colors[s as usize].iter().flatten().copied().collect()
        };
        let (arms, trunk) = (tones(ColorRegion::Forearm), tones(ColorRegion::Trunk));
        let skin = SkinClassifier::fit(&arms, &trunk, settings);
        let usable = skin.as_ref().is_some_and(|skin| {
            let share = |s: ColorRegion| {
                let colors = tones(s);
                let like = colors.iter().filter(|c| skin.is_skin(c)).count();
                if colors.len() < MIN_TONES {
                    0.0
                } else {
                    like as f32 / colors.len() as f32
                }
            };
            let hysteresis = usize::from(self.usable);
            let (agree, mixed) = (settings.agree[hysteresis], settings.mixed[hysteresis]);
            share(ColorRegion::Forearm) >= agree
                && share(ColorRegion::Face).max(share(ColorRegion::Hand)) >= agree
                && share(ColorRegion::Trunk) <= mixed
        });
        self.usable = usable;
        skin.filter(|_| usable)
    }
}

/// True `interval` seconds after the `last` time, nanoseconds. A clock that runs backwards has begun anew.
fn is_due(last: Option<u64>, interval: f64, time_ns: u64) -> bool {
    match last.and_then(|last| time_ns.checked_sub(last)) {
        Some(ns) => ns as f64 * 1e-9 >= interval,
        None => interval < f64::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_are_an_interval_apart_whoever_is_tracked() {
        const MS: u64 = 1_000_000;
        let mut state = State {
            pictures: 1,
            ..State::default()
        };
        let mut due = |ms: u64| {
            state.keep_if(false);
            state.begin_off_person(0.2, ms * MS)
        };
        let times = [5000, 5100, 5200, 5390, 5401, 30, 60, 240];
        let expected = [true, false, true, false, true, true, false, true];
        assert_eq!(times.map(&mut due), expected);
        assert_eq!(state.pictures, 0);
    }

    #[test]
    fn an_interval_of_zero_is_every_picture_and_an_endless_one_none() {
        let mut state = State::default();
        assert!(!state.begin_off_person(f64::INFINITY, 0));
        assert!((0..3).all(|_| state.begin_off_person(0.0, 7)));
        assert!(!state.begin_off_person(f64::INFINITY, 1 << 40));
    }
}
