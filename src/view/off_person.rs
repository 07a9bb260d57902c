//! Garment pixels off the recorded person: sleeves beside the arm, hems in the air.
//!
//! The person is the captured surface at about the garments' depth. A garment pixel is off the person if nothing of it lies
//! within a radius around the pixel.

use super::area::NEAR;
use super::hand::PosedLimbs;
use super::settings::OffPersonSettings;
use super::silhouette_grid::{DressedArea, PersonBounds, SilhouetteGrid};
use tryon_body::parts::BodyPart;
use tryon_geometry::camera::Intrinsics;

/// Number of [`BodyPart`]s.
const PARTS: usize = BodyPart::ALL.len();
/// Vertices of the body compared with a patch of cloth, about: one each 4 cm of skin.
const VERTICES: usize = 1024;

/// Garment pixels off the recorded person.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OffPerson {
    /// Garment pixels farther than 4 cm from the recorded person, as a share of `garment_pixels`, 0 to 1.
    pub share: f32,
    /// Those of them nearest to each [`BodyPart`], by `BodyPart as usize`, as shares of `garment_pixels`: they add up to
    /// `share`. Zeros without a tracked body, and with one whose parts are unknown.
    pub parts: [f32; PARTS],
    /// Garment pixels in the picture.
    pub garment_pixels: usize,
}

/// Data of a measurement.
pub(super) struct OffPersonInput<'a> {
    pub(super) camera: &'a Intrinsics,
    pub(super) settings: &'a OffPersonSettings,
    pub(super) dressed: DressedArea<'a>,
    /// The tracked body.
    pub(super) body: Option<PosedLimbs<'a>>,
}

impl OffPerson {
    /// Share of a picture's garment pixels above which a garment hangs off the person.
    pub const LIMIT: f32 = 0.02;

    /// Parts of the body that a garment hangs off, each by more than [`Self::LIMIT`] alone.
    pub fn hanging_parts(&self) -> impl Iterator<Item = BodyPart> + use<> {
        let parts = self.parts;
        (BodyPart::ALL.into_iter()).filter(move |part| parts[*part as usize] > Self::LIMIT)
    }

    /// Measures one picture; `None` where too little of garments and captured depth is in it.
    pub(super) fn measure(input: &OffPersonInput<'_>) -> Option<Self> {
        let (camera, dressed) = (input.camera, &input.dressed);
        let middle = dressed.median_depth()?;
        let radius = input.settings.radius * camera.fx as f32 / middle;
        let person = PersonBounds {
            middle,
            reach: input.settings.person_depth,
            cells: input.settings.cells,
        };
        let grid = SilhouetteGrid::new(dressed, &person, radius);
        let garment_pixels = grid.garment_pixels();
        let pixel_area = middle * middle / (camera.fx * camera.fy) as f32;
        if garment_pixels as f32 * pixel_area < input.settings.smallest {
            return None;
        }

        let body = input.sampled_body();
        let (left, top) = (dressed.area.left as f32, dressed.area.top as f32);
        let mut out = Self {
            garment_pixels,
            ..Self::default()
        };
        for patch in grid.patches_off(radius) {
            let share = patch.pixels / garment_pixels as f32;
            out.share += share;
            let at = [left + patch.centre[0], top + patch.centre[1]];
            if let Some(part) = nearest_part(&body, at) {
                out.parts[part as usize] += share;
            }
        }
        Some(out)
    }
}

impl OffPersonInput<'_> {
    /// Places of vertices of the tracked body in the picture, pixels, with their parts; empty without a body.
    fn sampled_body(&self) -> Vec<([f32; 2], BodyPart)> {
        let Some(body) = (self.body.as_ref()).filter(|b| b.limbs.fits(b.vertices.len())) else {
            return Vec::new();
        };
        let step = body.vertices.len().div_ceil(VERTICES);
        let sampled = body.vertices.iter().zip(&body.limbs.parts).step_by(step);
        sampled
            .filter(|(p, _)| p.z > NEAR)
            .map(|(p, part)| (self.camera.project(p).into(), *part))
            .collect()
    }
}

/// Part of the vertex nearest to a place in the picture.
fn nearest_part(body: &[([f32; 2], BodyPart)], at: [f32; 2]) -> Option<BodyPart> {
    let squared = |p: &[f32; 2]| (p[0] - at[0]).powi(2) + (p[1] - at[1]).powi(2);
    let nearest = body.iter().map(|(p, part)| (squared(p), *part));
    nearest.min_by(|a, b| a.0.total_cmp(&b.0)).map(|n| n.1)
}
