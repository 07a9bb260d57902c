//! Drawing of a painted body: visible faces, then material and light of each pixel.

use super::furniture::NEAR;
use super::material::{CameraLights, Exposure};
use super::paint::{FacePoint, PaintedBody};
use super::settings::LightSettings;
use super::shadow_map::ShadowMap;
use tryon_geometry::camera::Intrinsics;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::vertex_normals;
use tryon_geometry::par::Par;
use tryon_geometry::raster::{Cull, Options, View, VisibilityBuffer, barycentrics, rasterise_with};

/// Depths within a pixel that differ by more belong to two surfaces, both of which are shaded (m).
const SURFACES_APART: f32 = 0.012;
/// Cosine between normal and ray beyond which no face at a vertex is seen.
const UNSEEN: f32 = 0.6;
/// Softness of the shadow that the body casts on itself, to either side (m).
const SHADOW_SOFTNESS: f32 = 0.05;

/// Visible faces of a body in a part of the picture, with `samples` samples along each side of a pixel.
#[derive(Debug)]
pub(super) struct BodyRaster {
    samples: u32,
    /// First column and row of the picture.
    corner: [u32; 2],
    /// Columns and rows of the picture.
    size: [u32; 2],
    view: View,
    buffer: VisibilityBuffer,
}

impl BodyRaster {
    /// The whole picture, one sample a pixel.
    pub(super) fn whole(camera: &Intrinsics, body: &PaintedBody<'_>) -> Self {
        Self::new(camera, body, 1, [[0, camera.width], [0, camera.height]])
    }

    /// The part of the picture that shows the body.
    pub(super) fn around(camera: &Intrinsics, body: &PaintedBody<'_>, samples: u32) -> Self {
        if samples <= 1 {
            return Self::whole(camera, body);
        }
        let is_ahead = |p: &&P3| p.z > NEAR;
        let mut bounds = [[f32::MAX, f32::MIN]; 2];
        for p in body.vertices.iter().filter(is_ahead) {
            let at = camera.project(p);
            for (b, x) in bounds.iter_mut().zip([at.x, at.y]) {
                *b = [b[0].min(x), b[1].max(x)];
            }
        }
        let clip = |[low, high]: [f32; 2], size: u32| {
            let limit = size as f32;
            let ends = [low.floor() - 1.0, high.ceil() + 2.0];
            ends.map(|x| x.clamp(0.0, limit) as u32)
        };
        let columns = clip(bounds[0], camera.width);
        Self::new(
            camera,
            body,
            samples,
            [columns, clip(bounds[1], camera.height)],
        )
    }

    fn new(
        camera: &Intrinsics,
        body: &PaintedBody<'_>,
        samples: u32,
        [columns, rows]: [[u32; 2]; 2],
    ) -> Self {
        let size = [columns, rows].map(|[low, high]| high.saturating_sub(low));
        let s = f64::from(samples);
        // Samples are at the middles of the cells of a pixel, pixels at whole numbers.
        let centre = |c: f64, from: u32| s * (c - f64::from(from)) + 0.5 * (s - 1.0);
        let view = View::Perspective {
            camera: Intrinsics {
                width: size[0] * samples,
                height: size[1] * samples,
                fx: s * camera.fx,
                fy: s * camera.fy,
                cx: centre(camera.cx, columns[0]),
                cy: centre(camera.cy, rows[0]),
            },
            near: NEAR,
        };
        let options = Options {
            par: Par::Seq,
            cull: Cull::Back,
            ..Options::default()
        };
        let mut buffer = VisibilityBuffer::default();
        let faces = body.template.mesh().faces();
        if size[0] > 0 && size[1] > 0 {
            rasterise_with(options, &view, body.vertices, faces, &mut buffer);
        }
        Self {
            samples,
            corner: [columns[0], rows[0]],
            size,
            view,
            buffer,
        }
    }

    /// Depth of the nearer of body and room at the pixels of a whole picture with one sample each.
    pub(super) fn depth_over(&self, empty: &[f32]) -> Vec<f32> {
        let seen = self.buffer.face.iter().zip(&self.buffer.depth);
        let nearer = |(empty, (face, z)): (&f32, (&u32, &f32))| {
            if *face == VisibilityBuffer::NONE || z >= empty {
                *empty
            } else {
                *z
            }
        };
        empty.iter().zip(seen).map(nearer).collect()
    }

    /// Visits the samples of a pixel (from the corner) that show the body before `empty` metres.
    fn visit(&self, [x, y]: [u32; 2], empty: f32, mut visit: impl FnMut(Sample)) {
        let n = self.samples;
        for v in y * n..(y + 1) * n {
            for u in x * n..(x + 1) * n {
                let at = (v * self.buffer.width + u) as usize;
                let (face, depth) = (self.buffer.face[at], self.buffer.depth[at]);
                if face != VisibilityBuffer::NONE && depth < empty {
                    visit(Sample {
                        cell: [u, v],
                        face,
                        depth,
                    });
                }
            }
        }
    }
}

/// A sample that shows the body.
#[derive(Clone, Copy)]
struct Sample {
    /// Column and row of the raster.
    cell: [u32; 2],
    face: u32,
    /// Metres.
    depth: f32,
}

/// Picture that is painted on.
pub(super) struct Canvas<'a> {
    /// Depth of the room, metres.
    pub(super) empty: &'a [f32],
    /// Columns.
    pub(super) width: usize,
    /// Interleaved sRGB.
    pub(super) color: &'a mut [u8],
}

/// A body with the light on its vertices.
pub(super) struct LitBody<'a> {
    body: &'a PaintedBody<'a>,
    lights: &'a CameraLights,
    normals: Vec<V3>,
    exposure: Vec<Exposure>,
}

impl<'a> LitBody<'a> {
    pub(super) fn new(
        body: &'a PaintedBody<'a>,
        lights: &'a CameraLights,
        settings: &LightSettings,
    ) -> Self {
        let (faces, vertices) = (body.template.mesh().faces(), body.vertices);
        let mut normals = Vec::new();
        let around = body.template.topology().vertex_faces();
        vertex_normals(Par::Seq, vertices, faces, around, &mut normals);
        let map = (settings.cast > 0.0).then(|| ShadowMap::new(vertices, faces, &lights.key));
        let exposure = |(i, p): (usize, &P3)| {
            if normals[i].dot(&p.coords) > UNSEEN * p.coords.norm() {
                return Exposure::FULL;
            }
            let lit = |map: &ShadowMap| map.visibility(p, SHADOW_SOFTNESS);
            Exposure {
                open: 1.0 - settings.occlusion * (1.0 - body.paint.openness(i)),
                key: 1.0 - settings.cast * (1.0 - map.as_ref().map_or(1.0, lit)),
            }
        };
        let exposure = if settings.occlusion > 0.0 || map.is_some() {
            vertices.iter().enumerate().map(exposure).collect()
        } else {
            Vec::new()
        };
        Self {
            body,
            lights,
            normals,
            exposure,
        }
    }

    /// Paints the visible faces over a picture.
    pub(super) fn paint(&self, seen: &BodyRaster, canvas: &mut Canvas<'_>) {
        let [columns, rows] = seen.size;
        for y in 0..rows {
            let row = (seen.corner[1] + y) as usize * canvas.width;
            for x in 0..columns {
                let i = row + (seen.corner[0] + x) as usize;
                let Some((color, share)) = self.pixel(seen, [x, y], canvas.empty[i]) else {
                    continue;
                };
                for (c, new) in canvas.color[3 * i..3 * i + 3].iter_mut().zip(color) {
                    *c = (f32::from(*c) * (1.0 - share) + new * share) as u8;
                }
            }
        }
    }

    /// Colour of the body in a pixel and the share of the pixel that shows it.
    fn pixel(&self, seen: &BodyRaster, at: [u32; 2], empty: f32) -> Option<([f32; 3], f32)> {
        let (mut color, mut shaded, mut covered) = ([0.0; 3], 0.0, 0.0f32);
        let mut first = None;
        seen.visit(at, empty, |sample| {
            covered += 1.0;
            let depth = *first.get_or_insert(sample.depth);
            if shaded == 0.0 || (sample.depth - depth).abs() > SURFACES_APART {
                let here = self.color(&seen.view, sample.face, sample.cell);
                color = std::array::from_fn(|c| color[c] + here[c]);
                shaded += 1.0;
            }
        });
        first?;
        let share = covered / (seen.samples * seen.samples) as f32;
        Some((color.map(|c| c / shaded), share))
    }

    /// Colour of a face at a cell of the raster.
    fn color(&self, view: &View, face: u32, [u, v]: [u32; 2]) -> [f32; 3] {
        let body = self.body;
        let f = body.template.mesh().faces()[face as usize];
        let corners = f.map(|k| body.vertices[k as usize]);
        let w = barycentrics(view, corners, u as f32, v as f32).unwrap_or([1.0, 0.0, 0.0]);
        let mix = |[a, b, c]: [V3; 3]| a * w[0] + b * w[1] + c * w[2];
        let n = mix(f.map(|k| self.normals[k as usize]));
        let at = FacePoint {
            corners: f,
            weights: w,
            rest: P3::from(mix(f.map(|k| body.rest.base[k as usize].coords))),
        };
        let ray = mix(corners.map(|p| p.coords)).normalize();
        let n = n / n.norm().max(f32::EPSILON);
        let material = body.paint.material(&at);
        (self.lights).color(&material, &n, &ray, self.exposure(f, w))
    }

    fn exposure(&self, face: [u32; 3], weights: [f32; 3]) -> Exposure {
        if self.exposure.is_empty() {
            return Exposure::FULL;
        }
        let at = face.map(|k| self.exposure[k as usize]);
        let mean = |of: fn(&Exposure) -> f32| (0..3).map(|k| of(&at[k]) * weights[k]).sum();
        Exposure {
            open: mean(|e| e.open),
            key: mean(|e| e.key),
        }
    }
}
