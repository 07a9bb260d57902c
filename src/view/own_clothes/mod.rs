//! Own clothes disappear where a garment takes their place: what sticks out of it becomes the scene behind, or skin of the
//! tracked body in the person's own tone. Where neither is known they stay, and are counted.

mod field;
mod plate;
mod replacement;
mod skin_light;
mod worn;

pub(crate) use field::BodyField;
pub(crate) use plate::Plate;

use crate::area::Area;
use crate::captured_pixels::CapturedPixels;
use crate::config::Config;
use crate::input::BodyView;
use crate::room_light::RoomLight;
use crate::settings::OwnClothesSettings;
use crate::srgb::ToSrgb;
use field::segment;
use replacement::{Change, Replacement};
use serde::{Deserialize, Serialize};
use skin_light::SkinLight;
use tryon_body::parts::BodySegment;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::par;
use worn::OwnWorn;

/// Rows looked at by one task.
const ROWS: usize = 8;

/// Pixels of own clothes beside garments that take their place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OwnClothesReport {
    /// Replaced by the scene behind.
    pub by_scene: usize,
    /// Replaced by skin.
    pub by_skin: usize,
    /// Left: the scene behind was never seen.
    pub left: usize,
}

/// Pixels of the picture, by index, with their new colours.
pub(crate) type ChangedPixels = Vec<(usize, [u8; 3])>;

/// Captured colours of the face; `None` of one that is not seen.
pub(crate) fn see_face(
    captured: &CapturedPixels<'_>,
    body: &BodyView<'_>,
    vertices: &[P3],
    settings: &OwnClothesSettings,
) -> Option<Vec<[u8; 3]>> {
    let seen = |v: &u32| {
        let p = vertices.get(*v as usize)?;
        let (rgb, metres) = captured.at(p)?;
        (metres > 0.0 && (metres - p.z).abs() < settings.on_body).then_some(rgb)
    };
    let face: Vec<[u8; 3]> = body.limbs.face.iter().filter_map(seen).collect();
    (2 * face.len() > body.limbs.face.len()).then_some(face)
}

/// Scratch.
#[derive(Clone, Debug, Default)]
pub(crate) struct OwnClothes {
    field: BodyField,
    /// Part of the picture in which the body or its own clothes may be.
    window: Area,
    /// Own cloth by pixel, shape `[window]`.
    is_own: Vec<bool>,
}

/// A picture of a dressed person before the garments are drawn.
pub(crate) struct DressedPicture<'a> {
    pub(crate) config: &'a Config,
    pub(crate) captured: CapturedPixels<'a>,
    pub(crate) body: BodyView<'a>,
    /// Posed vertices of the body in the picture's camera, metres.
    pub(crate) vertices: &'a [P3],
    pub(crate) plate: &'a Plate,
    /// Captured colours of the face.
    pub(crate) face: &'a [[u8; 3]],
    pub(crate) light: Option<&'a RoomLight>,
    pub(crate) to_srgb: &'a ToSrgb,
}

impl DressedPicture<'_> {
    /// Segment that a face of the body belongs to.
    fn segment(&self, face: u32) -> Option<BodySegment> {
        segment(&self.body, face)
    }
}

impl OwnClothes {
    /// The pixels of own clothes beside garments, as they should be; `None` when no own clothes are to disappear. `cover` is the
    /// share of a pixel that a garment takes.
    pub(crate) fn replace(
        &mut self,
        picture: &DressedPicture<'_>,
        cover: impl Fn([u32; 2]) -> f32 + Sync,
    ) -> Option<(ChangedPixels, OwnClothesReport)> {
        let config = picture.config;
        let settings = &config.own_clothes;
        let (captured, body, vertices) = (&picture.captured, &picture.body, picture.vertices);
        if body.limbs.segments.is_empty() {
            return None;
        }
        let (field, reach) = (&mut self.field, settings.reach);
        field.build(config.par, captured.viewport, body, vertices, reach);
        self.window = field.bounds([captured.image.width(), captured.image.height()])?;
        let is_dressed = |pixel: [u32; 2]| cover(pixel) > 0.5;
        let worn = OwnWorn::see(
            captured,
            body,
            picture.face,
            &self.field,
            is_dressed,
            settings,
        )?;
        self.mark(picture, &worn, &cover);
        if !self.is_own.contains(&true) {
            return Some(Default::default());
        }
        Some(self.changes(picture, &worn, &cover))
    }

    /// Marks the pixels of own clothes, without lone ones.
    fn mark(
        &mut self,
        picture: &DressedPicture<'_>,
        worn: &OwnWorn,
        cover: &(impl Fn([u32; 2]) -> f32 + Sync),
    ) {
        let settings = &picture.config.own_clothes;
        let captured = &picture.captured;
        let head = HeadCircle::of(picture, settings.head);
        let is_own = |i: usize| {
            let pixel @ [u, v] = self.window.pixel(i);
            let Some(near) = self.field.at(pixel) else {
                return false;
            };
            let metres = captured.metres(u, v);
            // Without a reading the tracked body may be wrong: only what is beside it is taken away there.
            let is_there = if metres > 0.0 {
                (metres - near.depth).abs() < settings.off_body
            } else {
                !near.is_on
            };
            if !is_there || cover(pixel) >= 1.0 {
                return false;
            }
            let color = captured.image.at(u, v);
            picture
                .segment(near.face)
                .is_some_and(|segment| worn.is_own(segment, color, head.has(u, v)))
        };
        let (par, width) = (picture.config.par, self.window.width as usize);
        let mut marks = Vec::new();
        par::map_into(par, self.window.len(), ROWS * width, &mut marks, is_own);
        drop_lone(&mut marks, width);
        self.is_own = marks;
    }

    /// Replaces the marked pixels and those beside them.
    fn changes(
        &self,
        picture: &DressedPicture<'_>,
        worn: &OwnWorn,
        cover: &(impl Fn([u32; 2]) -> f32 + Sync),
    ) -> (ChangedPixels, OwnClothesReport) {
        let replacement = Replacement {
            picture,
            worn,
            field: &self.field,
            skin: SkinLight::new(picture, worn, &self.field),
            is_own: &self.is_own,
            window: self.window,
            cover,
        };
        let near = box_counts(
            &self.is_own,
            self.window.width as usize,
            replacement.edge_width(),
        );
        let (par, width) = (picture.config.par, self.window.width as usize);
        let mut changes = Vec::new();
        par::map_into(par, near.len(), ROWS * width, &mut changes, |i| {
            if near[i] > 0 { replacement.of(i) } else { None }
        });
        let (mut out, mut report) = (Vec::new(), OwnClothesReport::default());
        let columns = picture.captured.image.width() as usize;
        for (i, change) in changes.into_iter().enumerate() {
            let Some(change) = change else {
                continue;
            };
            let [u, v] = self.window.pixel(i);
            let seen = usize::from(self.is_own[i] && cover([u, v]) < 0.5);
            let color = match change {
                Change::None => {
                    report.left += seen;
                    continue;
                }
                Change::Scene(c) => {
                    report.by_scene += seen;
                    c
                }
                Change::Skin(c) => {
                    report.by_skin += seen;
                    c
                }
            };
            out.push((v as usize * columns + u as usize, color));
        }
        (out, report)
    }
}

/// Keeps pixels most of whose neighbours are marked, and fills holes between them.
fn drop_lone(marks: &mut [bool], width: usize) {
    const AROUND: usize = 2;
    const MOST: u8 = ((2 * AROUND + 1) * (2 * AROUND + 1) / 2) as u8;
    let counts = box_counts(marks, width, AROUND);
    for (mark, count) in marks.iter_mut().zip(counts) {
        *mark = count > MOST;
    }
}

/// Marked pixels in the square of `reach` pixels around each, up to 255.
fn box_counts(marks: &[bool], width: usize, reach: usize) -> Vec<u8> {
    let rows = marks.len() / width.max(1);
    let mut across = vec![0u16; marks.len()];
    for (row, out) in marks
        .chunks(width.max(1))
        .zip(across.chunks_mut(width.max(1)))
    {
        let mut sum = row.iter().take(reach).filter(|m| **m).count() as u16;
        for x in 0..width {
            sum += u16::from(row.get(x + reach).is_some_and(|m| *m));
            out[x] = sum;
            sum -= u16::from(x >= reach && row[x - reach]);
        }
    }
    let mut sums = vec![0u16; width];
    let mut out = Vec::with_capacity(marks.len());
    let row = |y: usize| &across[y * width..][..width];
    (0..reach.min(rows)).for_each(|y| sums.iter_mut().zip(row(y)).for_each(|(s, a)| *s += a));
    for y in 0..rows {
        if y + reach < rows {
            let entering = row(y + reach);
            sums.iter_mut().zip(entering).for_each(|(s, a)| *s += a);
        }
        out.extend(sums.iter().map(|s| (*s).min(255) as u8));
        if y >= reach {
            let leaving = row(y - reach);
            sums.iter_mut().zip(leaving).for_each(|(s, a)| *s -= a);
        }
    }
    out
}

/// Part of the picture around the head, where hair may have the colour of clothes.
struct HeadCircle {
    centre: [f32; 2],
    radius: f32,
}

impl HeadCircle {
    fn of(picture: &DressedPicture<'_>, radius: f32) -> Self {
        let limbs = picture.body.limbs;
        let of_head = |i: &usize| limbs.segments.get(*i) == Some(&BodySegment::Head);
        let points = (0..picture.vertices.len()).filter(of_head);
        let (sum, count) = points.fold((V3::zeros(), 0.0f32), |(s, n), i| {
            (s + picture.vertices[i].coords, n + 1.0)
        });
        let centre = P3::from(sum / count.max(1.0));
        if !(centre.z > 0.0) {
            return Self {
                centre: [0.0; 2],
                radius: 0.0,
            };
        }
        let camera = &picture.captured.viewport.camera;
        let q = camera.project(&centre);
        Self {
            centre: [q.x, q.y],
            radius: radius * camera.fx as f32 / centre.z,
        }
    }

    fn has(&self, u: u32, v: u32) -> bool {
        let [x, y] = [u as f32 - self.centre[0], v as f32 - self.centre[1]];
        x * x + y * y < self.radius * self.radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_those_of_every_square() {
        for (width, rows, reach) in [(7, 5, 2), (3, 4, 3), (1, 6, 2), (9, 1, 1), (0, 0, 2)] {
            let marks: Vec<bool> = (0..width * rows).map(|i| i * 7 % 5 < 2).collect();
            let count = |i: usize| {
                let (x, y) = (i % width, i / width);
                let is_near = |k: &usize| {
                    (k % width).abs_diff(x) <= reach && (k / width).abs_diff(y) <= reach
                };
                (0..marks.len())
                    .filter(is_near)
                    .filter(|k| marks[*k])
                    .count() as u8
            };
            let expected: Vec<u8> = (0..marks.len()).map(count).collect();
            assert_eq!(
                box_counts(&marks, width, reach),
                expected,
                "{width} {rows} {reach}"
            );
        }
    }
}
