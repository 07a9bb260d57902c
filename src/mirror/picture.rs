//! Input of the compositor: garments and body in the camera frame.

use crate::body::Template;
use crate::cloth::realtime::{Config, RoomyBody};
use crate::composite::{Appearance, BodyView, GarmentView, Limbs};
use crate::garment::library;
use crate::math::{Camera, P3, Rigid, World};
use crate::mesh::Face;
use crate::par::Par;
use std::sync::Arc;

/// Appearance of a garment of the library; of other names that of its first garment.
pub fn library_appearance(garment: &str) -> Appearance {
    Appearance {
        base: library::dye(garment),
        ..Appearance::default()
    }
}

/// Part of a drawn garment that does not change from frame to frame.
#[derive(Clone, Copy, Debug)]
pub struct DrawnSurface<'a> {
    /// Triangles, counter-clockwise seen from outside.
    pub faces: &'a [Face],
    /// Texture coordinates, shape `[n]`.
    pub uv: &'a [[f32; 2]],
    /// Colour and surface of the fabric.
    pub appearance: &'a Appearance,
}

/// Garment vertices in the camera frame, in buffers that are kept from frame to frame.
#[derive(Debug, Default)]
pub struct CameraGarments {
    vertices: Vec<Vec<P3>>,
}

impl CameraGarments {
    /// Moves garments (world, metres, innermost first) into the camera frame.
    pub fn place<'a>(
        &mut self,
        camera_from_world: &Rigid<Camera, World>,
        world: impl ExactSizeIterator<Item = &'a [P3]>,
    ) {
        self.vertices.resize_with(world.len(), Vec::new);
        for (positions, out) in world.zip(&mut self.vertices) {
            camera_from_world.points_f32(positions, out);
        }
    }

    /// Views of the placed garments, each with its surface.
    pub fn views<'a>(
        &'a self,
        surfaces: impl IntoIterator<Item = DrawnSurface<'a>>,
    ) -> Vec<GarmentView<'a>> {
        (self.vertices.iter().zip(surfaces))
            .map(|(vertices, surface)| GarmentView {
                vertices,
                faces: surface.faces,
                uv: surface.uv,
                normals: &[],
                appearance: surface.appearance,
            })
            .collect()
    }
}

/// Body of the picture: its limbs for occlusion, its parts separated as cloth met them.
#[derive(Debug)]
pub struct DrawnBody {
    template: Arc<Template>,
    limbs: Limbs,
    /// `None` for a template whose mesh is at fault, which only costs finer occlusion.
    separated: Option<RoomyBody>,
}

impl DrawnBody {
    /// Bodies made from `template`.
    pub fn new(template: Arc<Template>) -> Self {
        Self {
            limbs: Limbs::of(&template),
            separated: RoomyBody::new(&template, &Config::tracked()).ok(),
            template,
        }
    }

    /// Template of the body.
    pub fn template(&self) -> &Arc<Template> {
        &self.template
    }

    /// View of a posed body (camera frame, metres). Only under garments are its parts separated.
    pub fn view<'a>(&'a mut self, posed: &'a [P3], is_dressed: bool) -> BodyView<'a> {
        let separated = self.separated.as_mut().filter(|_| is_dressed);
        BodyView {
            vertices: separated.map_or(posed, |s| s.make_room(Par::Rayon, posed)),
            faces: self.template.mesh().faces(),
            limbs: &self.limbs,
        }
    }
}
