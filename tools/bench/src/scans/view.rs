//! Ring of virtual cameras around a subject, and the surface that each sees.

use super::settings::ScanSettings;
use super::surface::SceneSurface;
use nalgebra::Matrix3;
use tryon_geometry::camera::Intrinsics;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::par::{self, Par};
use tryon_geometry::raster::{Options, View, VisibilityBuffer, rasterise_with};

/// Cameras at each height.
const CAMERAS: usize = 12;
/// Cameras: a pixel is 4 mm on the subject; raised arms are in the picture.
const CAMERA: Intrinsics = Intrinsics {
    width: 480,
    height: 720,
    fx: 540.0,
    fy: 540.0,
    cx: 239.5,
    cy: 359.5,
};
/// Label of an empty pixel.
const EMPTY: u8 = 254;

/// Depth and labels from one camera.
pub(super) struct ScanView {
    settings: ScanSettings,
    rotation: Matrix3<f32>,
    pub(super) eye: P3,
    depth: Vec<f32>,
    labels: Vec<u8>,
}

/// Views of one scan.
pub(super) struct ViewRing {
    views: Vec<ScanView>,
    /// Faces with a pixel in some view, shape `[faces]`.
    seen_faces: Vec<bool>,
}

/// Largest label that a garment can have.
pub(super) const MAX_GARMENT: usize = EMPTY as usize - 1;

impl ScanView {
    fn draw(eye: P3, aim: P3, surface: &SceneSurface, seen: &mut [bool]) -> Self {
        let forward = (aim - eye).normalize();
        let right = forward.cross(&V3::y()).normalize();
        let down = forward.cross(&right);
        let rows = [right, down, forward].map(|v| v.transpose());
        let rotation = Matrix3::from_rows(&rows);
        let local: Vec<P3> = surface
            .drawn
            .iter()
            .map(|p| P3::from(rotation * (p - eye)))
            .collect();
        let view = View::Perspective {
            camera: CAMERA,
            near: surface.settings.near,
        };
        let mut buffer = VisibilityBuffer::default();
        rasterise_with(
            Options::default(),
            &view,
            &local,
            &surface.faces,
            &mut buffer,
        );
        let label = |face: &u32| match surface.faces.get(*face as usize) {
            Some(corners) => surface.labels[corners[0] as usize],
            None => EMPTY,
        };
        let labels = buffer.face.iter().map(label).collect();
        for face in &buffer.face {
            if let Some(seen) = seen.get_mut(*face as usize) {
                *seen = true;
            }
        }
        Self {
            settings: surface.settings,
            rotation,
            eye,
            depth: buffer.depth,
            labels,
        }
    }

    /// Cosine between the normal and the ray to a point on the surface, if the camera sees the point.
    ///
    /// Cloth is seen from both sides, skin from outside; so the cosine is negative on the inside of cloth.
    pub(super) fn cosine(&self, p: &P3, normal: &V3, label: u8) -> Option<f32> {
        let cosine = normal.dot(&(self.eye - p).normalize());
        let facing = if label == super::SKIN_LABEL {
            cosine
        } else {
            cosine.abs()
        };
        if facing < self.settings.min_cosine {
            return None;
        }
        let q = P3::from(self.rotation * (p - self.eye));
        if q.z < self.settings.near {
            return None;
        }
        let pixel = CAMERA.project(&q);
        let (column, row) = (pixel.x.round(), pixel.y.round());
        let inside = |x: f32, side: u32| x >= 0.0 && x < side as f32;
        if !inside(column, CAMERA.width) || !inside(row, CAMERA.height) {
            return None;
        }
        let i = row as usize * CAMERA.width as usize + column as usize;
        // Depth changes across the pixel by its width times the tangent of the slope.
        let slope = (1.0 - facing * facing).sqrt() / facing;
        let across = 0.5 * q.z / CAMERA.fx as f32 * slope;
        let is_on_surface = (q.z - self.depth[i]).abs() < self.settings.tolerance + across;
        (self.labels[i] == label && is_on_surface).then_some(cosine)
    }
}

impl ViewRing {
    /// Draws a surface from a ring around `center`, the subject's place on the floor.
    pub(super) fn draw(surface: &SceneSurface, center: P3) -> Self {
        let settings = &surface.settings;
        let heights = settings.ring_heights;
        let mut seen_faces = vec![false; surface.faces.len()];
        let mut views = Vec::new();
        for (k, height) in heights.iter().enumerate() {
            for i in 0..CAMERAS {
                // Rings are turned against each other.
                let turn = (i as f32 + k as f32 / heights.len() as f32) / CAMERAS as f32;
                let (sin, cos) = (std::f32::consts::TAU * turn).sin_cos();
                let away = settings.ring_distance;
                let eye = P3::new(center.x + away * sin, *height, center.z + away * cos);
                let aim = P3::new(center.x, settings.ring_aim, center.z);
                views.push(ScanView::draw(eye, aim, surface, &mut seen_faces));
            }
        }
        Self { views, seen_faces }
    }

    /// Camera that sees a point most frontally, and the cosine; `None` for a hidden point.
    pub(super) fn best(&self, p: &P3, normal: &V3, label: u8) -> Option<(&ScanView, f32)> {
        let seen = self.views.iter().filter_map(|view| {
            let cosine = view.cosine(p, normal, label)?;
            Some((view, cosine))
        });
        seen.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
    }

    /// Share of the cameras in front of each vertex that see it, shape `[vertices]`: small in folds.
    pub(super) fn openness(&self, surface: &SceneSurface) -> Vec<f32> {
        let mut out = Vec::new();
        par::map_into(Par::Rayon, surface.drawn.len(), 512, &mut out, |v| {
            let (p, n) = (&surface.drawn[v], &surface.normals[v]);
            let (mut front, mut open) = (0.0f32, 0.0f32);
            for view in &self.views {
                if n.dot(&(view.eye - p).normalize()) > view.settings.min_cosine {
                    front += 1.0;
                    let cosine = view.cosine(p, n, surface.labels[v]);
                    open += f32::from(u8::from(cosine.is_some()));
                }
            }
            open / front.max(1.0)
        });
        out
    }

    /// Faces that may be visible: with a pixel in some view, or with an open vertex. Shape `[faces]`.
    pub(super) fn candidates(&self, surface: &SceneSurface, openness: &[f32]) -> Vec<bool> {
        let faces = surface.faces.iter().zip(&self.seen_faces);
        let open = |f: &tryon_geometry::mesh::Face| f.iter().any(|v| openness[*v as usize] > 0.0);
        faces.map(|(f, seen)| *seen || open(f)).collect()
    }
}
