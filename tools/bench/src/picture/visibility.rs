//! Rows `visibility`: pixels at borders of garments that the picture gives to the right surface.

use super::border::{DecisionCount, Seen, borders, eroded, near};
use super::film::WornFilm;
use super::gallery::{Crop, Gallery, marked};
use super::person_truth::{CoveredSkin, truth};
use super::plan::{PersonLook, Progress};
use super::signal::SignalPainter;
use crate::{EvaluateError, Row};
use tryon_synth::{Routine, Sequence};

/// Reach of the judged band around a border, pixels of 720 rows.
const BAND: f32 = 6.0;
/// First picture judged: the garments have come to rest and the tracked body has its size.
const SETTLED: u64 = 60;
/// Pictures between two that are composed in signal colours, and between two that are judged.
const STEP: u64 = 5;
/// Pixels of a garment's outline left out: there it covers a part of a pixel.
const OUTLINE: f32 = 1.5;

/// A person, garments and their film.
pub(super) struct VisibilityCase {
    pub(super) look: PersonLook,
    pub(super) garments: &'static [&'static str],
}

impl VisibilityCase {
    /// Plays the try-on routine at 1280×720 and judges a picture in so many.
    pub(super) fn measure(&self, progress: &Progress<'_>) -> Result<Row, EvaluateError> {
        let (actor, setting) = self.look.scene(Routine::TryOn);
        let rate = setting.rate;
        let sequence = Sequence::new(actor, setting.with_wide_color(720));
        let mut film = WornFilm::new(sequence.calibration(), self.garments)?;
        let mut painter = SignalPainter::new();
        let pictures = (Routine::TryOn.period() * rate) as u64;
        let judged_every = if progress.is_quick() {
            6 * STEP
        } else {
            2 * STEP
        };
        let mut covered = None;
        let mut scores = Scores::default();
        let mut gallery = Gallery::default();
        for i in 0..pictures {
            let (frame, person) = sequence.frame(i);
            let seen = film.step(&frame)?;
            let Some(scene) = film
                .scene()
                .filter(|_| seen.is_dressed && i.is_multiple_of(STEP))
            else {
                continue;
            };
            let cover = painter.cover(&film, &frame, &scene)?;
            if i < SETTLED || !i.is_multiple_of(judged_every) {
                continue;
            }
            let covered = covered.get_or_insert_with(|| CoveredSkin::of(&scene));
            let truth = truth(&film, &scene, covered, &person.vertices);
            let width = film.camera().width as usize;
            let judged = JudgedPicture::of(&truth, width);
            let drawn: Vec<bool> = cover.iter().map(|c| *c >= 0.5).collect();
            let is_shown = scores.add(&judged, &truth, &drawn);
            if is_shown && progress.has_pictures() {
                let garment = (0..truth.len()).filter(|i| truth[*i] != Seen::Outside);
                let crop = Crop::around(garment, [seen.picture.width(), seen.picture.height()]);
                gallery.add(&marked(&seen.picture, &truth, &judged.all, &drawn), &crop);
            }
        }
        progress.write(gallery)?;
        Ok(scores.add_to(Row::new(
            progress.scene(),
            self.garments.join("+"),
            film.run_ms(),
        )))
    }
}

/// Pixels judged in a picture.
struct JudgedPicture {
    /// Near a border of garment and person.
    before: Vec<bool>,
    /// Near that or the garments' outline.
    all: Vec<bool>,
}

impl JudgedPicture {
    fn of(truth: &[Seen], width: usize) -> Self {
        let is_covered: Vec<bool> = truth.iter().map(|t| *t != Seen::Outside).collect();
        let whole = eroded(&is_covered, width, OUTLINE);
        let band = |is_border: fn(Seen, Seen) -> bool| {
            let near = near(&borders(truth, width, is_border), width, BAND);
            near.iter().zip(&whole).map(|(n, w)| *n && *w).collect()
        };
        Self {
            before: band(|a, b| a != b && a != Seen::Outside && b != Seen::Outside),
            all: band(|a, b| a != b),
        }
    }
}

#[derive(Default)]
struct Scores {
    before: DecisionCount,
    all: DecisionCount,
    pictures: usize,
    worst: f64,
}

impl Scores {
    /// Adds a picture; true for one with a worse score than all before, and for each tenth.
    fn add(&mut self, judged: &JudgedPicture, truth: &[Seen], drawn: &[bool]) -> bool {
        let count = |mask: &[bool]| {
            let mut count = DecisionCount::default();
            for i in (0..mask.len()).filter(|i| mask[*i]) {
                count.add(drawn[i], truth[i] == Seen::Garment);
            }
            count
        };
        let (before, all) = (count(&judged.before), count(&judged.all));
        self.before.join(&before);
        self.all.join(&all);
        self.pictures += 1;
        let is_worst = all.all() > 0 && (self.pictures == 1 || all.f1() < self.worst);
        if is_worst {
            self.worst = all.f1();
        }
        is_worst || self.pictures.is_multiple_of(10)
    }

    fn add_to(&self, row: Row) -> Row {
        let share = |n: usize| 100.0 * n as f64 / self.before.all().max(1) as f64;
        row.with("pictures", self.pictures)
            .with("pixels", self.all.all())
            .error("f1", self.all.f1())
            .error("f1_person", self.before.f1())
            .error("over_person_percent", share(self.before.false_ones))
            .error("missed_percent", share(self.before.missed))
            .error("worst_picture_f1", self.worst)
    }
}
