//! Compositing of garments over the captured frames of one camera.

use super::drawn_look::DrawnLook;
use super::picture::{CameraGarments, DrawnBody, DrawnSurface};
use std::sync::Arc;
use tryon_body::Template;
use tryon_garment::GarmentMesh;
use tryon_geometry::camera::{Calibration, ColorImage, RgbdFrame};
use tryon_geometry::math::{Camera, P3, Rigid, World};
use tryon_view::{RenderError, RenderReport};

/// Garments to draw and the body under them.
#[derive(Clone, Copy, Debug)]
pub(super) struct DrawnOutfit<'a> {
    /// Meshes, innermost first.
    pub(super) garments: &'a [GarmentMesh],
    /// Colour and surface of each.
    pub(super) looks: &'a [DrawnLook],
    /// Vertices of each drawn mesh (world, metres).
    pub(super) positions: &'a [Vec<P3>],
    /// Body that the cloth met (world, metres), so that cloth stays off its skin.
    pub(super) body: &'a [P3],
}

/// A captured frame and the place of its camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct CapturedView<'a> {
    pub(super) frame: &'a RgbdFrame,
    pub(super) calibration: &'a Calibration,
    pub(super) camera_from_world: Rigid<Camera, World>,
}

/// Compositor with its state from picture to picture.
#[derive(Debug)]
pub struct OutfitPainter {
    body: DrawnBody,
    garments: CameraGarments,
    compositor: tryon_view::Model,
    state: tryon_view::State,
    work: tryon_view::Workspace,
}

impl OutfitPainter {
    /// Painter of people with bodies made from `template`.
    pub fn new(template: Arc<Template>) -> Self {
        Self {
            body: DrawnBody::new(template),
            garments: CameraGarments::default(),
            compositor: tryon_view::Model::default(),
            state: tryon_view::State::default(),
            work: tryon_view::Workspace::default(),
        }
    }

    /// Sets [`tryon_view::Config::off_person_interval`], seconds.
    pub fn set_off_person_interval(&mut self, seconds: f64) {
        self.compositor.config.off_person_interval = seconds;
    }

    /// Picture of an outfit, or of a body without one (camera frame, metres); the captured one without both.
    pub(super) fn paint(
        &mut self,
        view: &CapturedView<'_>,
        outfit: Option<&DrawnOutfit<'_>>,
        posed: Option<&[P3]>,
    ) -> Result<(ColorImage, RenderReport), RenderError> {
        let positions = outfit.map_or(&[][..], |o| o.positions);
        let camera_from_world = &view.camera_from_world;
        let world = positions.iter().map(Vec::as_slice);
        self.garments.place(camera_from_world, world);
        let surfaces = outfit.iter().flat_map(|outfit| {
            (outfit.garments.iter().zip(outfit.looks)).map(|(mesh, look)| DrawnSurface {
                faces: &mesh.render.faces,
                uv: &look.uv,
                vertex: &mesh.render.vertex,
                places: &look.places,
                appearance: &look.appearance,
            })
        });

        let mut met = Vec::new();
        if let Some(outfit) = outfit {
            camera_from_world.points_f32(outfit.body, &mut met);
        }
        let drawn = outfit.map(|_| &met[..]).or(posed);
        let input = tryon_view::Input {
            frame: view.frame,
            calibration: view.calibration,
            garments: &self.garments.views(surfaces),
            body: drawn.map(|vertices| self.body.view(vertices)),
            output: None,
        };
        tryon_view::render(&self.compositor, &mut self.state, &input, &mut self.work)
    }
}
