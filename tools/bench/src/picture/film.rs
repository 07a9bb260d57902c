//! A person dressed live: frames through the whole chain, the drawn garments of each.

use super::fault;
use crate::EvaluateError;
use tryon::mirror::{Choice, Mirror, MirrorFrame};
use tryon_body::embedded;
use tryon_geometry::camera::{Calibration, Intrinsics, RgbdFrame};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;
use tryon_geometry::par::Par;
use tryon_geometry::raster::{Cull, Options, View, VisibilityBuffer, rasterise_with};

/// Surfaces nearer than this are clipped (m).
const NEAR: f32 = 0.05;

/// The chain before one camera, and its times.
pub(super) struct WornFilm {
    mirror: Mirror,
    calibration: Calibration,
    /// Time of the compositor in each dressed picture (ms).
    ms: Vec<f64>,
}

/// Drawn surfaces of a picture, depth camera, metres.
#[derive(Clone, Debug)]
pub(super) struct DrawnScene {
    /// Vertices of each garment's drawn mesh, innermost first.
    pub(super) garments: Vec<Vec<P3>>,
    pub(super) faces: Vec<Vec<Face>>,
    /// Body that the cloth met.
    pub(super) body: Vec<P3>,
}

impl WornFilm {
    /// Nobody is dressed yet; garments of the library, innermost first.
    pub(super) fn new(calibration: &Calibration, garments: &[&str]) -> Result<Self, EvaluateError> {
        let choices = garments.iter().map(|g| Choice::library(g, None));
        let choices = choices.collect::<Result<Vec<_>, _>>().map_err(fault)?;
        Ok(Self {
            mirror: Mirror::new(embedded::template(), calibration, choices),
            calibration: calibration.clone(),
            ms: Vec::new(),
        })
    }

    /// The next frame.
    pub(super) fn step(&mut self, frame: &RgbdFrame) -> Result<MirrorFrame, EvaluateError> {
        let seen = self.mirror.step(frame).map_err(fault)?;
        let composite = seen.stages_ms.iter().find(|s| s.0 == "composite");
        if let Some((_, ms)) = composite.filter(|_| seen.is_dressed) {
            self.ms.push(*ms);
        }
        Ok(seen)
    }

    /// Mean time of the compositor (ms a picture).
    pub(super) fn run_ms(&self) -> f64 {
        self.ms.iter().sum::<f64>() / self.ms.len().max(1) as f64
    }

    /// Camera of the picture.
    pub(super) fn camera(&self) -> Intrinsics {
        self.calibration.color.unwrap_or(self.calibration.depth)
    }

    /// Camera and registration.
    pub(super) fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Surfaces of the last picture; `None` before anything is worn.
    pub(super) fn scene(&self) -> Option<DrawnScene> {
        let outfit = self.mirror.outfit()?;
        let camera_from_world = self.mirror.world_from_camera().inverse();
        let place = |world: &[P3]| {
            let mut out = Vec::new();
            camera_from_world.points_f32(world, &mut out);
            out
        };
        let meshes = outfit.model.outfit.garments.iter();
        Some(DrawnScene {
            garments: outfit.drawn_positions().iter().map(|p| place(p)).collect(),
            faces: meshes.map(|g| g.render.faces.clone()).collect(),
            body: place(outfit.state.collision_body().vertices()),
        })
    }

    /// Points of the depth camera in that of the picture.
    pub(super) fn in_picture(&self, points: &[P3]) -> Vec<P3> {
        let mut out = Vec::new();
        (self.calibration.color_from_depth).points_f32(points, &mut out);
        out
    }

    /// Nearest surface of a mesh (depth camera) by pixel of the picture, both sides of its faces or their fronts.
    pub(super) fn rasterise(
        &self,
        vertices: &[P3],
        faces: &[Face],
        cull: Cull,
    ) -> VisibilityBuffer {
        let view = View::Perspective {
            camera: self.camera(),
            near: NEAR,
        };
        let options = Options {
            par: Par::Rayon,
            cull,
            ..Options::default()
        };
        let mut out = VisibilityBuffer::default();
        rasterise_with(options, &view, &self.in_picture(vertices), faces, &mut out);
        out
    }
}

impl DrawnScene {
    /// All garments as one mesh.
    pub(super) fn joined(&self) -> (Vec<P3>, Vec<Face>) {
        let (mut vertices, mut all) = (Vec::new(), Vec::new());
        for (positions, faces) in self.garments.iter().zip(&self.faces) {
            let first = vertices.len() as u32;
            all.extend(faces.iter().map(|f| f.map(|v| v + first)));
            vertices.extend_from_slice(positions);
        }
        (vertices, all)
    }
}
