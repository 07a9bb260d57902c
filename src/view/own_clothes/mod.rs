//! Own clothes disappear where a garment takes their place: what sticks out of it becomes the scene behind, or skin of the
//! tracked body in the person's own tone. Where neither is known they stay, and are counted.

mod field;
mod plate;
mod worn;

pub(crate) use field::BodyField;
pub(crate) use plate::Plate;

use crate::area::{Area, NEAR};
use crate::captured_pixels::CapturedPixels;
use crate::config::Config;
use crate::input::BodyView;
use crate::room_light::RoomLight;
use crate::settings::OwnClothesSettings;
use crate::srgb::{ToSrgb, linear};
use field::{NearBody, normals, segment};
use serde::{Deserialize, Serialize};
use tryon_body::parts::BodySegment;
use tryon_geometry::math::order_statistics::medians;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::par;
use tryon_geometry::raster::{View, barycentrics};
use worn::OwnWorn;

/// Rows looked at by one task.
const ROWS: usize = 8;
/// Light over the mean on skin below which its colour tells little of it.
const LEAST_LIGHT: f32 = 0.1;

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

/// New state of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Change {
    None,
    Scene([u8; 3]),
    Skin([u8; 3]),
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
        let skin = SkinLight::new(picture, &worn, &self.field);
        Some(self.changes(picture, skin.as_ref(), &cover))
    }

    /// Place of a pixel of the window.
    fn pixel(&self, i: usize) -> [u32; 2] {
        let (x, y) = (i as u32 % self.window.width, i as u32 / self.window.width);
        [self.window.left + x, self.window.top + y]
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
            let pixel @ [u, v] = self.pixel(i);
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
            segment(&picture.body, near.face)
                .is_some_and(|segment| worn.is_own(segment, color, head.has(u, v)))
        };
        let (par, width) = (picture.config.par, self.window.width as usize);
        let mut marks = Vec::new();
        par::map_into(par, self.window.len(), ROWS * width, &mut marks, is_own);
        drop_lone(&mut marks, width);
        self.is_own = marks;
    }

    fn changes(
        &self,
        picture: &DressedPicture<'_>,
        skin: Option<&SkinLight<'_>>,
        cover: &impl Fn([u32; 2]) -> f32,
    ) -> (ChangedPixels, OwnClothesReport) {
        let captured = &picture.captured;
        let (mut out, mut report) = (Vec::new(), OwnClothesReport::default());
        // Antialiased pixels around own clothes are part of them.
        let edge = ((2.0 * captured.viewport.scale).ceil() as usize).max(1);
        let (columns, width) = (captured.image.width() as usize, self.window.width as usize);
        for (i, &is_own) in self.is_own.iter().enumerate() {
            if !is_own && !is_beside(&self.is_own, width, i, edge) {
                continue;
            }
            let pixel @ [u, v] = self.pixel(i);
            let Some(near) = self.field.at(pixel) else {
                continue;
            };
            let seen = usize::from(is_own && cover(pixel) < 0.5);
            let color = match change(picture, skin, &near, pixel) {
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

fn change(
    picture: &DressedPicture<'_>,
    skin: Option<&SkinLight<'_>>,
    near: &NearBody,
    pixel: [u32; 2],
) -> Change {
    if near.is_on {
        let skin = skin.and_then(|s| s.at(near.face, pixel));
        return skin.map_or(Change::None, Change::Skin);
    }
    let scene = picture.plate.at(&picture.captured, pixel);
    scene.map_or(Change::None, Change::Scene)
}

/// True with an own pixel within `edge` pixels along the row or the column.
fn is_beside(is_own: &[bool], width: usize, i: usize, edge: usize) -> bool {
    let at = |k: Option<usize>| k.and_then(|k| is_own.get(k)).is_some_and(|o| *o);
    (1..=edge).any(|d| {
        at(i.checked_sub(d))
            || at(Some(i + d))
            || at(i.checked_sub(d * width))
            || at(Some(i + d * width))
    })
}

/// Keeps pixels most of whose neighbours are marked, and fills holes between them.
fn drop_lone(marks: &mut Vec<bool>, width: usize) {
    const AROUND: isize = 2;
    let rows = (marks.len() / width.max(1)) as isize;
    let columns = width as isize;
    // Sums along rows, then along columns.
    let count = |from: &[u8], step: isize, k: isize, size: isize, at: isize| -> u8 {
        (-AROUND..=AROUND)
            .filter(|d| (0..size).contains(&(k + d)))
            .map(|d| from[(at + d * step) as usize])
            .sum()
    };
    let ones: Vec<u8> = marks.iter().map(|m| u8::from(*m)).collect();
    let across: Vec<u8> = (0..ones.len() as isize)
        .map(|i| count(&ones, 1, i % columns, columns, i))
        .collect();
    let most = (2 * AROUND + 1).pow(2) as u8 / 2;
    *marks = (0..ones.len() as isize)
        .map(|i| count(&across, columns, i / columns, rows, i) > most)
        .collect();
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

/// Skin of the tracked body in the light of the room.
struct SkinLight<'a> {
    picture: &'a DressedPicture<'a>,
    normals: Vec<V3>,
    /// Linear light of skin over that which falls on it.
    albedo: [f32; 3],
}

impl<'a> SkinLight<'a> {
    /// Skin like that which is seen on face, arms and hands; `None` of too little.
    fn new(picture: &'a DressedPicture<'a>, worn: &OwnWorn, field: &BodyField) -> Option<Self> {
        const LEAST: usize = 12;
        let unknown = Self {
            normals: normals(&picture.body, picture.vertices),
            albedo: [0.0; 3],
            picture,
        };
        let captured = &picture.captured;
        let on_body = picture.config.own_clothes.on_body;
        let albedo = |cell: usize| {
            let near = field.at_cell(cell).filter(|n| n.is_on)?;
            let segment = segment(&picture.body, near.face)?;
            use BodySegment::{Fingers, Forearm, Hand, Head, UpperArm};
            if ![Head, UpperArm, Forearm, Hand, Fingers].contains(&segment) {
                return None;
            }
            let pixel @ [u, v] = field.pixel(cell);
            let color = captured.image.at(u, v);
            let metres = captured.metres(u, v);
            let is_seen = metres > 0.0 && (metres - near.depth).abs() < on_body;
            if !is_seen || !worn.is_skin(color) {
                return None;
            }
            let light = unknown.light(&unknown.normal(near.face, pixel)?);
            Some([0, 1, 2].map(|c| linear(color[c]) / light[c].max(LEAST_LIGHT)))
        };
        let seen: Vec<[f32; 3]> = (0..field.cells()).filter_map(albedo).collect();
        let albedo = medians(&seen).filter(|_| seen.len() >= LEAST)?;
        Some(Self { albedo, ..unknown })
    }

    /// Unit normal at a pixel of a face.
    fn normal(&self, face: u32, [u, v]: [u32; 2]) -> Option<V3> {
        let f = self.picture.body.faces.get(face as usize)?;
        let corners = f.map(|k| self.picture.vertices[k as usize]);
        let view = View::Perspective {
            camera: self.picture.captured.viewport.camera,
            near: NEAR,
        };
        let w = barycentrics(&view, corners, u as f32, v as f32).unwrap_or([1.0 / 3.0; 3]);
        // A cell's middle may lie beside the face.
        let w = w.map(|w| w.clamp(0.0, 1.0));
        let n: V3 = (0..3).map(|k| self.normals[f[k] as usize] * w[k]).sum();
        n.try_normalize(0.0)
    }

    /// Light on a surface of normal `n` over the mean, by channel.
    fn light(&self, n: &V3) -> [f32; 3] {
        match self.picture.light {
            Some(room) => room.relative(n),
            None => [1.0 - 0.5 * n.z; 3],
        }
    }

    /// Colour of the body's skin at a pixel of a face.
    fn at(&self, face: u32, pixel: [u32; 2]) -> Option<[u8; 3]> {
        let light = self.light(&self.normal(face, pixel)?);
        let to_srgb = self.picture.to_srgb;
        Some([0, 1, 2].map(|c| to_srgb.get(self.albedo[c] * light[c]).round() as u8))
    }
}
