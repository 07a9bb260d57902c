//! One colour and depth camera before the subject: frames as a sensor delivers them, with the label of each pixel.

use super::STRAY_LABEL;
use super::paint::{PaintedSurface, tinted_shade};
use super::random::ScanSeed;
use super::settings::ScanSettings;
use super::surface::SceneSurface;
use tryon_geometry::camera::{Calibration, ColorImage, Intrinsics, NoiseModel, RgbdFrame};
use tryon_geometry::math::{Camera, P3, P3d, Rigid, V3d, World};
use tryon_geometry::mesh::Face;
use tryon_geometry::par::Par;
use tryon_geometry::raster::{Options, View, VisibilityBuffer, barycentrics, rasterise_with};

/// Depth camera with registered colour, before a subject at the origin of the world, on a floor and before a wall.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthCamera {
    /// Projection.
    pub intrinsics: Intrinsics,
    /// Pose; the world's floor is y = 0.
    pub world_from_camera: Rigid<World, Camera>,
    /// Noise of the depth image.
    pub noise: NoiseModel,
}

impl Default for DepthCamera {
    /// A Kinect v1 mounted upright, one metre high and 1.9 m from the subject.
    fn default() -> Self {
        let wide = Intrinsics::KINECT_V1;
        let at: Rigid<World, World> = Rigid::from_parts(
            V3d::new(0.0, 0.0, 1.9),
            nalgebra::UnitQuaternion::identity(),
        );
        Self {
            intrinsics: Intrinsics {
                width: wide.height,
                height: wide.width,
                cx: wide.cy,
                cy: wide.cx,
                ..wide
            },
            world_from_camera: at * Rigid::<World, Camera>::level(1.0),
            noise: NoiseModel::KinectV1,
        }
    }
}

/// Room around the subject.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Backdrop {
    /// A floor, and a wall behind the subject.
    Wall,
    /// A floor only.
    Floor,
}

/// Images without noise. Shapes: `[pixels]`.
#[derive(Clone, Debug)]
pub(super) struct CleanView {
    /// Pixels in a row.
    pub(super) width: usize,
    /// Depth (m); infinite where nothing is seen.
    pub(super) depth: Vec<f32>,
    /// Colours, sRGB.
    pub(super) color: Vec<[u8; 3]>,
    /// Garment from 1, skin, or [`STRAY_LABEL`] beside the subject.
    pub(super) labels: Vec<u8>,
}

impl DepthCamera {
    /// Calibration of the frames.
    pub fn calibration(&self) -> Calibration {
        Calibration::registered(self.intrinsics)
    }

    /// Frame of a painted surface, `rate` a second.
    pub(super) fn shoot(
        &self,
        painted: PaintedSurface<'_>,
        seed: ScanSeed,
        rate: f64,
    ) -> RgbdFrame {
        let clean = self.view(painted, Backdrop::Wall);
        let noise = self.noise;
        let depth = noise.apply(&self.intrinsics, &clean.depth, seed.scene, seed.scan);
        let Intrinsics { width, height, .. } = self.intrinsics;
        let color = ColorImage::new(width, height, clean.color.concat());
        RgbdFrame {
            sequence: seed.scan,
            time_ns: (seed.scan as f64 / rate * 1e9) as u64,
            depth,
            color: color.ok(),
        }
    }

    /// A painted surface in a room as a camera without noise sees it.
    pub(super) fn view(&self, painted: PaintedSurface<'_>, backdrop: Backdrop) -> CleanView {
        let surface = painted.surface;
        let view = View::Perspective {
            camera: self.intrinsics,
            near: surface.settings.near,
        };
        let mut drawn = surface.drawn.clone();
        let mut faces = surface.faces.clone();
        add_room(&surface.settings, &mut drawn, &mut faces, backdrop);
        let mut local = Vec::new();
        (self.world_from_camera.inverse()).points_f32(&drawn, &mut local);
        let mut buffer = VisibilityBuffer::default();
        let options = Options {
            par: Par::Rayon,
            ..Options::default()
        };
        rasterise_with(options, &view, &local, &faces, &mut buffer);

        let eye = self.world_from_camera.point(&P3d::origin()).cast::<f32>();
        let width = self.intrinsics.width;
        let seen = |(i, face): (usize, &u32)| {
            let pixel = [i as u32 % width, i as u32 / width].map(|c| c as f32);
            match faces.get(*face as usize) {
                Some(corners) if (*face as usize) < surface.faces.len() => {
                    let at = corners.map(|v| local[v as usize]);
                    let weights = barycentrics(&view, at, pixel[0], pixel[1]);
                    let label = surface.labels[corners[0] as usize];
                    let weights = weights.unwrap_or([1.0, 0.0, 0.0]);
                    (label, lit(painted, corners, weights, &eye))
                }
                Some(_) => {
                    let wall = *face as usize >= surface.faces.len() + 2;
                    (STRAY_LABEL, surface.settings.room_colors[usize::from(wall)])
                }
                None => (STRAY_LABEL, [0; 3]),
            }
        };
        let (labels, color) = buffer.face.iter().enumerate().map(seen).unzip();
        CleanView {
            width: width as usize,
            depth: buffer.depth,
            color,
            labels,
        }
    }
}

/// Colour of a place on the surface, lit from fixed directions.
fn lit(painted: PaintedSurface<'_>, face: &Face, weights: [f32; 3], eye: &P3) -> [u8; 3] {
    let PaintedSurface { surface, paint } = painted;
    let normal = SceneSurface::blend(&surface.normals, face, weights);
    let place = SceneSurface::place(&surface.drawn, face, weights);
    let normal = if normal.dot(&(eye - place)) < 0.0 {
        -normal
    } else {
        normal
    };
    let normal = normal.try_normalize(f32::MIN_POSITIVE).unwrap_or_default();
    let material = SceneSurface::blend(&surface.material, face, weights);
    let light = tinted_shade(&surface.settings, &normal, 1.0, 0.0).y;
    let color = paint.color(surface.labels[face[0] as usize], &material);
    color.map(|c| (c * light).clamp(0.0, 255.0) as u8)
}

/// Adds two triangles of floor, then two of wall if there is one.
fn add_room(
    settings: &ScanSettings,
    vertices: &mut Vec<P3>,
    faces: &mut Vec<Face>,
    backdrop: Backdrop,
) {
    let room = settings.room;
    let (back, count) = match backdrop {
        Backdrop::Wall => (settings.wall, 2),
        Backdrop::Floor => (-room, 1),
    };
    let quads = [[0.0, room], [room, back]].map(|[y, z]| {
        [
            [-room, 0.0, back],
            [room, 0.0, back],
            [room, y, z],
            [-room, y, z],
        ]
    });
    for quad in &quads[..count] {
        let first = vertices.len() as u32;
        vertices.extend(quad.map(P3::from));
        faces.push([first, first + 1, first + 2]);
        faces.push([first, first + 2, first + 3]);
    }
}
