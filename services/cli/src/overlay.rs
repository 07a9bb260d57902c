//! The tracked body over its frame: green on the measured surface, red in free space, blue behind it, orange where nothing
//! was measured. Or half transparent over the picture.

use tryon::geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};
use tryon::geometry::math::order_statistics::quantile;
use tryon::geometry::math::{P3, V3};
use tryon::geometry::mesh::{Face, MeshError, Topology, TriMesh, vertex_normals};
use tryon::geometry::par::Par;
use tryon::geometry::raster::{Cull, Options, View, VisibilityBuffer, rasterise, rasterise_with};
use tryon::geometry::settings;

settings! {
    /// Settings of bodies drawn over a frame.
    pub struct OverlaySettings {
        /// Difference in depth up to which the body lies on the measured surface, metres.
        pub on_surface: f32 = 0.06,
        /// Share of the body's colour; the rest is the depth image.
        pub opacity: f32 = 0.65,
        /// Nearest drawn surface, metres.
        pub near: f32 = 0.05,
        /// Shares of the readings below and above the range of greys.
        pub range: [f64; 2] = [0.01, 0.99],
        /// Greys of the nearest and farthest reading of the range.
        pub greys: [f32; 2] = [225.0, 45.0],
        /// Colour of a body over the picture, sRGB.
        pub tint: [f32; 3] = [80.0, 200.0, 255.0],
        /// Share of light on a surface seen edge-on.
        pub ambient: f32 = 0.3,
        /// Distance of the darkest grey of a depth image (mm).
        pub farthest_mm: f32 = 5000.0,
        /// Darkest grey of a depth image.
        pub darkest: f32 = 0.05,
    }
}

/// Colours of [`Place`], in its order.
const COLORS: [[f32; 3]; 4] = [
    [60.0, 220.0, 60.0],
    [255.0, 60.0, 40.0],
    [70.0, 70.0, 255.0],
    [255.0, 150.0, 0.0],
];

/// Place of a body pixel against its reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    OnSurface,
    InFreeSpace,
    Behind,
    Unmeasured,
}

impl Place {
    /// Place at depth `body` before a reading, metres, 0 = no reading; `on_surface` within that difference.
    fn of(body: f32, reading: f32, on_surface: f32) -> Self {
        if reading <= 0.0 {
            Self::Unmeasured
        } else if body < reading - on_surface {
            Self::InFreeSpace
        } else if body > reading + on_surface {
            Self::Behind
        } else {
            Self::OnSurface
        }
    }
}

/// Draws a body over a depth image, at its size. Vertices in the camera frame, metres; faces counter-clockwise seen from
/// outside.
pub(crate) fn overlay(
    depth: &DepthImage,
    camera: &Intrinsics,
    vertices: &[P3],
    faces: &[Face],
) -> ColorImage {
    let settings = OverlaySettings::default();
    let view = View::Perspective {
        camera: *camera,
        near: settings.near,
    };
    let options = Options {
        par: Par::Seq,
        cull: Cull::Back,
        ..Options::default()
    };
    let mut body = VisibilityBuffer::default();
    rasterise_with(options, &view, vertices, faces, &mut body);

    let readings: Vec<f32> = depth.data().iter().map(|d| f32::from(*d) * 1e-3).collect();
    let range = grey_range(&readings, settings.range);
    let mut picture = ColorImage::filled(depth.width(), depth.height(), [0; 3]);
    let pixels = picture.data_mut().chunks_exact_mut(3);
    for (k, (pixel, &reading)) in pixels.zip(&readings).enumerate() {
        let grey = grey(reading, range, settings.greys);
        let color = match body.face.get(k).and_then(|f| faces.get(*f as usize)) {
            Some(face) => {
                let place = Place::of(body.depth[k], reading, settings.on_surface);
                let shade = facing(face, vertices);
                COLORS[place as usize].map(|c| grey + settings.opacity * (c * shade - grey))
            }
            None => [grey; 3],
        };
        for (out, c) in pixel.iter_mut().zip(color) {
            *out = c.round().clamp(0.0, 255.0) as u8;
        }
    }
    picture
}

/// Depth of the nearest and farthest reading that keep a grey of their own, metres.
fn grey_range(readings: &[f32], shares: [f64; 2]) -> [f32; 2] {
    let mut known: Vec<f32> = readings.iter().copied().filter(|d| *d > 0.0).collect();
    shares.map(|share| quantile(&mut known, share).unwrap_or(0.0))
}

/// Grey of a reading; black without one.
fn grey(reading: f32, [near, far]: [f32; 2], greys: [f32; 2]) -> f32 {
    if reading <= 0.0 {
        return 0.0;
    }
    let t = (reading - near) / (far - near).max(f32::MIN_POSITIVE);
    greys[0] + (greys[1] - greys[0]) * t.clamp(0.0, 1.0)
}

/// Brightness of a face by its angle to the camera, 0.35 to 1.
fn facing(face: &Face, vertices: &[P3]) -> f32 {
    let [a, b, c] = face.map(|i| vertices[i as usize]);
    let normal: V3 = (b - a).cross(&(c - a));
    let cos = normal.dot(&a.coords) / (normal.norm() * a.coords.norm()).max(f32::MIN_POSITIVE);
    0.35 + 0.65 * cos.abs()
}

/// The tracked body, shaded by its normals, half transparent over the picture.
pub(crate) fn tinted(
    vertices: &[P3],
    mesh: &TriMesh,
    frame: &RgbdFrame,
    calibration: &Calibration,
) -> Result<ColorImage, MeshError> {
    let settings = OverlaySettings::default();
    let topology = Topology::new(mesh)?;
    let mut normals = Vec::new();
    vertex_normals(
        Par::Rayon,
        vertices,
        mesh.faces(),
        topology.vertex_faces(),
        &mut normals,
    );
    let camera = calibration.depth;
    let mut seen = VisibilityBuffer::default();
    rasterise(
        &View::Perspective {
            camera,
            near: settings.near,
        },
        vertices,
        mesh.faces(),
        &mut seen,
    );
    let mut picture = match &frame.color {
        Some(c) if (c.width(), c.height()) == (camera.width, camera.height) => c.clone(),
        _ => depth_picture(frame, &settings),
    };
    for (i, &face) in seen
        .face
        .iter()
        .enumerate()
        .filter(|(_, f)| **f != VisibilityBuffer::NONE)
    {
        let n = mesh.faces()[face as usize]
            .iter()
            .fold(V3::zeros(), |s, &v| s + normals[v as usize]);
        let light = (-n.z / n.norm().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        for (c, tint) in settings.tint.iter().enumerate() {
            let p = &mut picture.data_mut()[3 * i + c];
            *p = (0.5 * f32::from(*p)
                + 0.5 * tint * (settings.ambient + (1.0 - settings.ambient) * light))
                as u8;
        }
    }
    Ok(picture)
}

/// Depth as grey: near is bright, missing readings are black.
fn depth_picture(frame: &RgbdFrame, settings: &OverlaySettings) -> ColorImage {
    let mut out = ColorImage::filled(frame.depth.width(), frame.depth.height(), [0; 3]);
    for (p, &mm) in out.data_mut().chunks_exact_mut(3).zip(frame.depth.data()) {
        if mm > 0 {
            p.fill(
                (255.0 * (1.0 - f32::from(mm) / settings.farthest_mm).clamp(settings.darkest, 1.0))
                    as u8,
            );
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of 0.8 m at 2 m before readings at `depth_mm`.
    fn square(depth_mm: u16) -> [u8; 3] {
        let camera = Intrinsics {
            width: 32,
            height: 24,
            fx: 30.0,
            fy: 30.0,
            cx: 15.5,
            cy: 11.5,
        };
        let corners = [(-0.4, -0.4), (0.4, -0.4), (0.4, 0.4), (-0.4, 0.4)];
        let vertices = corners.map(|(x, y)| P3::new(x, y, 2.0));
        // Counter-clockwise seen from the camera, whose y points down.
        let faces = [[0, 2, 1], [0, 3, 2]];
        let depth = DepthImage::new(32, 24, vec![depth_mm; 32 * 24]).expect("sizes agree");
        overlay(&depth, &camera, &vertices, &faces).at(15, 11)
    }

    #[test]
    fn colours_name_the_place_of_the_body() {
        let dominant = |[r, g, b]: [u8; 3]| {
            if g > r && g > b {
                "green"
            } else if b > r {
                "blue"
            } else if g > b + 40 {
                "orange"
            } else {
                "red"
            }
        };
        let found = [2000, 3000, 1500, 0].map(|mm| dominant(square(mm)));
        assert_eq!(found, ["green", "red", "blue", "orange"]);
    }

    #[test]
    fn nothing_in_view_leaves_the_depth_image() {
        let depth = DepthImage::empty(4, 3);
        let camera = Intrinsics {
            width: 4,
            height: 3,
            fx: 3.0,
            fy: 3.0,
            cx: 1.5,
            cy: 1.0,
        };
        let picture = overlay(&depth, &camera, &[], &[]);
        assert!(picture.data().iter().all(|c| *c == 0));
    }
}
