//! Rows `match`: grain and edges of a garment against those of the photo around it.

use super::border::{borders, eroded, near};
use super::edge_width::widths;
use super::fault;
use super::film::{DrawnScene, WornFilm};
use super::gallery::{Crop, Gallery};
use super::luma::Luma;
use super::noise::deviation;
use super::plan::Progress;
use super::signal::SignalPainter;
use crate::{EvaluateError, Row};
use std::path::PathBuf;
use tryon_body::embedded;
use tryon_formats::open_recording;
use tryon_geometry::camera::{ColorImage, RgbdFrame};
use tryon_geometry::math::order_statistics::median;
use tryon_geometry::raster::{Cull, VisibilityBuffer};

/// Pictures between two that are judged.
const STEP: usize = 5;
/// Time between repeated pictures (ns).
const INTERVAL_NS: u64 = 33_333_333;
/// Distance from the garment's outline of pixels whose noise is measured, to either side, pixels.
const INSIDE: f32 = 5.0;
const BESIDE: f32 = 8.0;
/// Brightness of pixels whose noise is measured, grey levels.
const EXPOSED: std::ops::RangeInclusive<f32> = 16.0..=240.0;
/// Distance from outlines of garment and body within which an edge is theirs, pixels.
const GARMENT_EDGE: f32 = 1.5;
const PERSON_EDGE: f32 = 6.0;

/// A recording, each frame so many times, and garments.
pub(super) struct PhotoCase {
    pub(super) folder: PathBuf,
    pub(super) repeats: usize,
    pub(super) garments: &'static [&'static str],
}

/// Measures of the garment and of the photo, one a picture.
#[derive(Default)]
struct PhotoPairs {
    grain: [Vec<f32>; 2],
    coarse: [Vec<f32>; 2],
    width: [Vec<f32>; 2],
}

impl PhotoCase {
    pub(super) fn measure(&self, progress: &Progress<'_>) -> Result<Row, EvaluateError> {
        let mut source = open_recording(&self.folder).map_err(fault)?;
        let mut film = WornFilm::new(source.calibration(), self.garments)?;
        let mut painter = SignalPainter::new();
        let (mut pairs, mut gallery) = (PhotoPairs::default(), Gallery::default());
        let mut count = 0;
        while let Some(recorded) = source.next_frame().map_err(fault)? {
            for k in 0..self.repeats {
                let frame = self.repeated(&recorded, k);
                let seen = film.step(&frame)?;
                count += 1;
                let is_due = count % STEP == 0 && k + 3 * STEP >= self.repeats;
                let Some(scene) = film.scene().filter(|_| seen.is_dressed) else {
                    continue;
                };
                let cover = painter.cover(&film, &frame, &scene)?;
                let Some(photo) = frame.color.as_ref().filter(|_| is_due) else {
                    continue;
                };
                let masks = PhotoMasks::of(&film, &scene, &cover);
                pairs.add(&masks, &seen.picture, photo);
                let marks = (0..cover.len()).filter(|i| cover[*i] > 0.5);
                let crop = Crop::around(marks, [photo.width(), photo.height()]);
                gallery.add(&seen.picture, &crop);
            }
        }
        progress.write(gallery)?;
        Ok(pairs.add_to(Row::new(
            progress.scene(),
            self.garments.join("+"),
            film.run_ms(),
        )))
    }

    fn repeated(&self, frame: &RgbdFrame, k: usize) -> RgbdFrame {
        RgbdFrame {
            sequence: frame.sequence * self.repeats as u64 + k as u64,
            time_ns: frame.time_ns + k as u64 * INTERVAL_NS,
            ..frame.clone()
        }
    }
}

/// Pixels of a mask whose noise no end of the range cuts off: a cut-out's ground has none.
fn exposed(luma: &Luma, mask: &[bool]) -> Vec<bool> {
    let is_exposed = |i: usize| EXPOSED.contains(&luma.at(i % luma.width, i / luma.width));
    (0..mask.len()).map(|i| mask[i] && is_exposed(i)).collect()
}

/// Pixels that are compared, shape of the picture.
struct PhotoMasks {
    width: usize,
    inside: Vec<bool>,
    beside: Vec<bool>,
    garment_edge: Vec<bool>,
    person_edge: Vec<bool>,
}

impl PhotoMasks {
    fn of(film: &WornFilm, scene: &DrawnScene, cover: &[f32]) -> Self {
        let width = film.camera().width as usize;
        let garment: Vec<bool> = cover.iter().map(|c| *c >= 0.5).collect();
        let body = film.rasterise(&scene.body, embedded::template().mesh().faces(), Cull::Back);
        let person: Vec<bool> = (body.face.iter())
            .map(|f| *f != VisibilityBuffer::NONE)
            .collect();
        let around = near(&garment, width, BESIDE);
        let outline =
            |mask: &[bool], reach| near(&borders(mask, width, |a, b| a != b), width, reach);
        let person_edge = outline(&person, PERSON_EDGE);
        let beside = (around.iter()).map(|g| !g).collect();
        Self {
            inside: eroded(&garment, width, INSIDE),
            garment_edge: outline(&garment, GARMENT_EDGE),
            person_edge: (person_edge.iter().zip(&around))
                .map(|(e, g)| *e && !g)
                .collect(),
            beside,
            width,
        }
    }

    /// A mask of squares of 2 × 2 pixels that lie in one whole.
    fn halved(&self, mask: &[bool]) -> Vec<bool> {
        let (w, h) = (self.width / 2, mask.len() / self.width / 2);
        let whole = |i: usize| {
            let k = 2 * (i / w) * self.width + 2 * (i % w);
            mask[k] && mask[k + 1] && mask[k + self.width] && mask[k + self.width + 1]
        };
        (0..w * h).map(whole).collect()
    }
}

impl PhotoPairs {
    fn add(&mut self, masks: &PhotoMasks, picture: &ColorImage, photo: &ColorImage) {
        let (drawn, taken) = (Luma::of(picture), Luma::of(photo));
        let inside = exposed(&drawn, &masks.inside);
        let beside = exposed(&taken, &masks.beside);
        self.grain[0].extend(deviation(&drawn, &inside));
        self.grain[1].extend(deviation(&taken, &beside));
        let (inside, beside) = (masks.halved(&inside), masks.halved(&beside));
        self.coarse[0].extend(deviation(&drawn.halved(), &inside));
        self.coarse[1].extend(deviation(&taken.halved(), &beside));
        self.width[0].extend(widths(&drawn, &masks.garment_edge));
        self.width[1].extend(widths(&taken, &masks.person_edge));
    }

    fn add_to(mut self, row: Row) -> Row {
        let of = |v: &mut Vec<f32>| median(v).map_or(f64::NAN, f64::from);
        let edges = self.width.each_ref().map(Vec::len);
        let [grain, coarse, width] = [&mut self.grain, &mut self.coarse, &mut self.width]
            .map(|[garment, photo]| [of(garment), of(photo)]);
        let apart = |[garment, photo]: [f64; 2]| 100.0 * (garment / photo - 1.0);
        row.with("edges", format!("{} {}", edges[0], edges[1]))
            .error("grain", grain[0])
            .error("photo_grain", grain[1])
            .error("grain_apart_percent", apart(grain))
            .error("coarse_grain_apart_percent", apart(coarse))
            .error("edge_px", width[0])
            .error("photo_edge_px", width[1])
            .error("edge_apart_percent", apart(width))
    }
}
