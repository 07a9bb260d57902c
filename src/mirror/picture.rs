//! Input of the compositor: garments and body in the camera frame.

use std::sync::Arc;
use tryon_body::Template;
use tryon_cloth::contact::{CollisionBody, CollisionModel, CollisionWorkspace};
use tryon_cloth::{Config, collision_model};
use tryon_garment::library;
use tryon_geometry::math::{Camera, P3, Rigid, V3, World};
use tryon_geometry::mesh::{Face, face_normal};
use tryon_view::{Appearance, BodyView, EdgePlace, GarmentView, Limbs, Print};

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
    /// Simulated vertex under each drawn one, shape `[n]`.
    pub vertex: &'a [u32],
    /// Places in the pattern, shape `[n]`, or empty.
    pub places: &'a [EdgePlace],
    /// Colour and surface of the fabric.
    pub appearance: &'a Appearance,
}

impl DrawnSurface<'_> {
    /// Unit normals that drawn vertices over one simulated vertex share, so that charts of an image show no seams. None for
    /// other patterns: panels do have seams.
    fn shared_normals(&self, positions: &[P3], sums: &mut Vec<V3>, out: &mut Vec<V3>) {
        out.clear();
        if !matches!(self.appearance.pattern, Print::Image(_)) {
            return;
        }
        let count = self.vertex.iter().max().map_or(0, |v| *v as usize + 1);
        sums.clear();
        sums.resize(count, V3::zeros());
        for f in self.faces {
            let n = face_normal(positions, f);
            let corners = f.map(|v| self.vertex[v as usize] as usize);
            corners.into_iter().for_each(|v| sums[v] += n);
        }
        let unit = |v: &u32| sums[*v as usize].try_normalize(0.0);
        out.extend(self.vertex.iter().map(|v| unit(v).unwrap_or_default()));
    }
}

/// Garment vertices in the camera frame, in buffers that are kept from frame to frame.
#[derive(Debug, Default)]
pub struct CameraGarments {
    vertices: Vec<Vec<P3>>,
    normals: Vec<Vec<V3>>,
    sums: Vec<V3>,
}

impl CameraGarments {
    /// Moves garments (world, metres, innermost first) into the camera frame.
    pub fn place<'a>(
        &mut self,
        camera_from_world: &Rigid<Camera, World>,
        world: impl ExactSizeIterator<Item = &'a [P3]>,
    ) {
        self.vertices.resize_with(world.len(), Vec::new);
        self.normals.resize_with(world.len(), Vec::new);
        for (positions, out) in world.zip(&mut self.vertices) {
            camera_from_world.points_f32(positions, out);
        }
    }

    /// Views of the placed garments, each with its surface.
    pub fn views<'a>(
        &'a mut self,
        surfaces: impl IntoIterator<Item = DrawnSurface<'a>>,
    ) -> Vec<GarmentView<'a>> {
        let surfaces: Vec<DrawnSurface<'_>> = surfaces.into_iter().collect();
        for ((positions, normals), surface) in
            self.vertices.iter().zip(&mut self.normals).zip(&surfaces)
        {
            surface.shared_normals(positions, &mut self.sums, normals);
        }
        (self.vertices.iter().zip(&self.normals).zip(surfaces))
            .map(|((vertices, normals), surface)| GarmentView {
                vertices,
                faces: surface.faces,
                uv: surface.uv,
                normals,
                places: surface.places,
                appearance: surface.appearance,
            })
            .collect()
    }
}

/// Body of the picture, with its limbs for occlusion. Under garments it is the collision body that cloth met.
#[derive(Debug)]
pub struct DrawnBody {
    template: Arc<Template>,
    limbs: Limbs,
}

impl DrawnBody {
    /// Bodies made from `template`.
    pub fn new(template: Arc<Template>) -> Self {
        Self {
            limbs: Limbs::of(&template),
            template,
        }
    }

    /// Template of the body.
    pub fn template(&self) -> &Arc<Template> {
        &self.template
    }

    /// View of a body, camera frame, metres.
    pub fn view<'a>(&'a self, vertices: &'a [P3]) -> BodyView<'a> {
        BodyView {
            vertices,
            faces: self.template.mesh().faces(),
            limbs: &self.limbs,
        }
    }
}

/// Collision body of a picture drawn away from the cloth, updated once a pose from the poses that cloth follows too.
#[derive(Debug)]
pub struct FollowedBody {
    /// `None` for a template whose mesh is at fault, which only costs finer occlusion.
    model: Option<CollisionModel>,
    body: CollisionBody,
    work: CollisionWorkspace,
}

impl FollowedBody {
    /// Bodies made from `template`, tracked by a camera.
    pub fn new(template: &Template) -> Self {
        Self {
            model: collision_model(template, &Config::tracked()).ok(),
            body: CollisionBody::default(),
            work: CollisionWorkspace::default(),
        }
    }

    /// Follows a posed body (camera frame, metres) through `dt` seconds; the posed body itself where it is at fault.
    pub fn follow<'a>(&'a mut self, posed: &'a [P3], dt: f64) -> &'a [P3] {
        let Some(model) = &self.model else {
            return posed;
        };
        let updated = self.body.update(model, posed, dt, &mut self.work);
        updated.map_or(posed, |_| self.body.vertices())
    }
}
