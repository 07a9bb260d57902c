//! Rows `own`: own clothes that stick out of a new garment, with truth.

use super::border::near;
use super::film::WornFilm;
use super::gallery::{Crop, FALSE, Gallery, MISSED};
use super::plan::Progress;
use super::signal::SignalPainter;
use crate::{EvaluateError, Row};
use tryon::view::OwnClothesReport;
use tryon_geometry::camera::{ColorImage, RgbdFrame};
use tryon_synth::{Actor, ActorAppearance, Routine, Sequence, Setting};

/// Colour of clothes in the second rendering, sRGB: pixels that differ between both are theirs.
const OTHER: [u8; 3] = [255, 0, 255];
/// Greatest difference from the captured pixel at which own cloth is still seen, grey levels of any channel.
const ALIKE: u8 = 20;
/// Difference at which a pixel that is no own cloth has changed, and the reach of garments' shadows, which are left out.
const CHANGED: u8 = 10;
const SHADOW: f32 = 9.0;
/// Exposures of the empty scene.
const EMPTY: u64 = 24;
/// Pictures before the judged ones, and between two of those.
const SETTLED: u64 = 75;
const STEP: u64 = 15;

/// Way in which the scene behind the person was seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SceneSeen {
    /// The person stands there from the first picture.
    Never,
    /// Before the person came.
    Empty,
    /// As the person walked.
    Walked,
    /// Beside arms that moved.
    TriedOn,
}

pub(super) struct OwnClothCase {
    pub(super) clothes: ActorAppearance,
    /// The trousers are judged instead of the top.
    pub(super) is_lower: bool,
    pub(super) garments: &'static [&'static str],
    pub(super) seen: SceneSeen,
}

/// Films of one person in two colours of the judged clothes, after the empty scene.
struct OwnClothFilm {
    captured: Sequence,
    other: Sequence,
    /// All clothes are in another colour.
    all_others: Sequence,
    empty: Option<Sequence>,
}

impl OwnClothFilm {
    fn new(case: &OwnClothCase) -> Self {
        let routine = match case.seen {
            SceneSeen::Walked => Routine::Walk,
            SceneSeen::TriedOn => Routine::TryOn,
            SceneSeen::Never | SceneSeen::Empty => Routine::Still,
        };
        let film = |appearance: ActorAppearance, routine: Routine| {
            let (actor, setting) = match appearance {
                ActorAppearance::Figure(_) => (Actor::figure(), Setting::studio()),
                _ => (Actor::default(), Setting::default()),
            };
            let setting = Setting { routine, ..setting };
            Sequence::new(
                Actor {
                    appearance,
                    ..actor
                },
                setting,
            )
        };
        Self {
            captured: film(case.clothes, routine),
            other: film(recoloured(case.clothes, &[case.is_lower]), routine),
            all_others: film(recoloured(case.clothes, &[false, true]), routine),
            empty: (case.seen == SceneSeen::Empty).then(|| film(case.clothes, Routine::Empty)),
        }
    }

    /// Pictures before the person comes.
    fn lead(&self) -> u64 {
        if self.empty.is_some() { EMPTY } else { 0 }
    }

    fn frame(&self, i: u64) -> RgbdFrame {
        let lead = self.lead();
        let empty = self.empty.as_ref().filter(|_| i < lead);
        let (sequence, k) = empty.map_or((&self.captured, i.saturating_sub(lead)), |e| (e, i));
        let rate = sequence.setting().rate;
        RgbdFrame {
            sequence: i,
            time_ns: (i as f64 * 1e9 / rate) as u64,
            ..sequence.frame(k).0
        }
    }

    /// Cloth in a picture after the lead.
    fn cloth(&self, i: u64, captured: &ColorImage) -> OwnClothMask {
        let differs = |film: &Sequence| {
            let Some(other) = film.frame(i - self.lead()).0.color else {
                return vec![false; captured.data().len() / 3];
            };
            let pixels = captured.data().chunks_exact(3);
            let pairs = pixels.zip(other.data().chunks_exact(3));
            pairs.map(|(a, b)| a != b).collect()
        };
        OwnClothMask {
            judged: differs(&self.other),
            any: differs(&self.all_others),
        }
    }
}

/// Pixels of own cloth by truth.
struct OwnClothMask {
    judged: Vec<bool>,
    any: Vec<bool>,
}

/// The same clothes with the top, the trousers (`true`) or both in another colour.
fn recoloured(mut clothes: ActorAppearance, are_lower: &[bool]) -> ActorAppearance {
    for is_lower in are_lower {
        let colors = match &mut clothes {
            ActorAppearance::Street(c) => [&mut c.top, &mut c.trousers],
            ActorAppearance::Figure(c) => [&mut c.top, &mut c.leggings],
            ActorAppearance::Everyday(_) => return clothes,
        };
        let [upper, lower] = colors;
        *(if *is_lower { lower } else { upper }) = OTHER;
    }
    clothes
}

/// Pixels under garments, and those that their shadows may reach.
struct HiddenPixels {
    covered: Vec<bool>,
    shaded: Vec<bool>,
}

/// Own cloth that no garment covers.
#[derive(Clone, Copy, Debug, Default)]
struct OwnClothCount {
    /// Pixels of own cloth beside garments.
    bare: usize,
    /// Those that still look as captured.
    left: usize,
    /// Those not on cloth that changed, beside garments and their shadows.
    harmed: usize,
    pictures: usize,
    report: OwnClothesReport,
}

impl OwnClothCase {
    pub(super) fn measure(&self, progress: &Progress<'_>) -> Result<Row, EvaluateError> {
        let film = OwnClothFilm::new(self);
        let mut worn = WornFilm::new(film.captured.calibration(), self.garments)?;
        let mut painter = SignalPainter::new();
        let (mut count, mut gallery) = (OwnClothCount::default(), Gallery::default());
        let period =
            (film.captured.setting().routine.period() * film.captured.setting().rate) as u64;
        let (start, length) = match self.seen {
            SceneSeen::Walked => (period / 2, period + STEP),
            SceneSeen::TriedOn => (SETTLED, period),
            _ => (SETTLED, SETTLED + 5 * STEP),
        };
        for i in 0..film.lead() + length {
            let frame = film.frame(i);
            let seen = worn.step(&frame)?;
            let scene = worn.scene().filter(|_| seen.is_dressed);
            let is_due = i >= film.lead() + start && i % STEP == 0;
            let (Some(scene), Some(color)) = (scene.filter(|_| is_due), &frame.color) else {
                continue;
            };
            let cover = painter.cover(&worn, &frame, &scene)?;
            let cloth = film.cloth(i, color);
            let is_garment: Vec<bool> = cover.iter().map(|c| *c > 0.0).collect();
            let width = color.width() as usize;
            let hidden = HiddenPixels {
                shaded: near(&is_garment, width, SHADOW),
                covered: is_garment,
            };
            let left = count.add(color, &seen.picture, &cloth, &hidden);
            count.report = added(count.report, seen.render.own_clothes.unwrap_or_default());
            let marks = (0..cloth.judged.len()).filter(|i| cloth.judged[*i]);
            let crop = Crop::around(marks, [color.width(), color.height()]);
            gallery.add(color, &crop);
            gallery.add(&seen.picture, &crop);
            gallery.add(&left, &crop);
        }
        progress.write(gallery)?;
        Ok(count.add_to(Row::new(
            progress.scene(),
            self.garments.join("+"),
            worn.run_ms(),
        )))
    }
}

fn added(a: OwnClothesReport, b: OwnClothesReport) -> OwnClothesReport {
    OwnClothesReport {
        by_scene: a.by_scene + b.by_scene,
        by_skin: a.by_skin + b.by_skin,
        left: a.left + b.left,
    }
}

impl OwnClothCount {
    /// Adds a picture; returns it with the own cloth that is left in a signal colour.
    fn add(
        &mut self,
        captured: &ColorImage,
        picture: &ColorImage,
        cloth: &OwnClothMask,
        hidden: &HiddenPixels,
    ) -> ColorImage {
        self.pictures += 1;
        let mut marked = picture.clone();
        let pixels = captured
            .data()
            .chunks_exact(3)
            .zip(marked.data_mut().chunks_exact_mut(3));
        for (i, (a, b)) in pixels.enumerate().filter(|(i, _)| !hidden.covered[*i]) {
            let difference = (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0);
            if cloth.judged[i] {
                let is_alike = difference <= ALIKE;
                self.bare += 1;
                self.left += usize::from(is_alike);
                if is_alike {
                    b.copy_from_slice(&FALSE);
                }
            } else if difference > CHANGED && !cloth.any[i] && !hidden.shaded[i] {
                self.harmed += 1;
                b.copy_from_slice(&MISSED);
            }
        }
        marked
    }

    fn add_to(&self, row: Row) -> Row {
        let pictures = self.pictures.max(1);
        row.with("pictures", self.pictures)
            .with("pixels", self.bare / pictures)
            .with("by_scene", self.report.by_scene / pictures)
            .with("by_skin", self.report.by_skin / pictures)
            .with("left", self.report.left / pictures)
            .error("left_percent", 100.0 * self.left as f64 / self.bare as f64)
            .error(
                "harmed_percent_of_cloth",
                100.0 * self.harmed as f64 / self.bare as f64,
            )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_synth::StreetClothes;

    #[test]
    fn cloth_that_keeps_its_colour_beside_the_garment_is_left() {
        let captured = ColorImage::filled(4, 1, [90; 3]);
        let mut picture = captured.clone();
        picture.data_mut()[0..3].copy_from_slice(&[200; 3]);
        picture.data_mut()[9..12].copy_from_slice(&[10; 3]);
        let mut count = OwnClothCount::default();
        let judged = vec![true, true, true, false];
        let cloth = OwnClothMask {
            any: judged.clone(),
            judged,
        };
        let hidden = HiddenPixels {
            covered: vec![false, false, true, false],
            shaded: vec![false, false, true, false],
        };
        let marked = count.add(&captured, &picture, &cloth, &hidden);
        assert_eq!((count.bare, count.left, count.harmed), (2, 1, 1));
        assert_eq!(marked.at(1, 0), FALSE);
    }

    #[test]
    fn sleeves_are_own_cloth_and_hands_are_not() {
        let case = OwnClothCase {
            clothes: ActorAppearance::Street(StreetClothes::default()),
            is_lower: false,
            garments: &[],
            seen: SceneSeen::Empty,
        };
        let film = OwnClothFilm::new(&case);
        let frame = film.frame(film.lead());
        let color = frame.color.expect("colour");
        let is_own = film.cloth(film.lead(), &color).judged;
        let own = is_own.iter().filter(|o| **o).count();
        assert!((5_000..60_000).contains(&own), "{own}");
        let skin = |i: usize| color.data()[3 * i] > 190 && color.data()[3 * i + 2] < 190;
        assert!((0..is_own.len()).all(|i| !is_own[i] || !skin(i)));
    }
}
