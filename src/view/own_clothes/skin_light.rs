//! Skin of the tracked body in the person's own tone and the light of the room.

use super::DressedPicture;
use super::field::{BodyField, normals};
use super::worn::OwnWorn;
use crate::area::NEAR;
use crate::srgb::linear;
use tryon_body::parts::BodySegment;
use tryon_geometry::math::V3;
use tryon_geometry::math::order_statistics::medians;
use tryon_geometry::raster::{View, barycentrics};

/// Light over the mean on skin below which its colour tells little of it.
const LEAST_LIGHT: f32 = 0.1;

/// Skin of the tracked body in the light of the room.
pub(super) struct SkinLight<'a> {
    picture: &'a DressedPicture<'a>,
    normals: Vec<V3>,
    /// Linear light of skin over that which falls on it.
    albedo: [f32; 3],
}

impl<'a> SkinLight<'a> {
    /// Skin like that which is seen on face, arms and hands; `None` of too little.
    pub(super) fn new(
        picture: &'a DressedPicture<'a>,
        worn: &OwnWorn,
        field: &BodyField,
    ) -> Option<Self> {
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
            let segment = picture.segment(near.face)?;
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

    /// sRGB (0 to 255) of the body's skin at a pixel of a face. `shade` is the light there over the mean where it was seen on
    /// cloth; otherwise it follows from the body.
    pub(super) fn at(&self, face: u32, pixel: [u32; 2], shade: Option<f32>) -> Option<[f32; 3]> {
        let light = match shade {
            // Most of what is seen faces the camera.
            Some(shade) => self.light(&V3::new(0.0, 0.0, -1.0)).map(|l| l * shade),
            None => self.light(&self.normal(face, pixel)?),
        };
        let to_srgb = self.picture.to_srgb;
        Some([0, 1, 2].map(|c| to_srgb.get(self.albedo[c] * light[c])))
    }
}
