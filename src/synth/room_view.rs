//! A camera before a room: the empty room as it sees it, and a painted body drawn into that.

use super::furniture::{NEAR, Piece};
use super::paint::Paint;
use super::room::{Background, Room};
use super::settings::LightSettings;
use tryon_body::{RestBody, Template};
use tryon_geometry::camera::Intrinsics;
use tryon_geometry::math::{Camera, P3, P3d, Rigid, V3, V3d, World};
use tryon_geometry::mesh::vertex_normals;
use tryon_geometry::par::Par;
use tryon_geometry::raster::{Cull, Options, View, VisibilityBuffer, barycentrics, rasterise_with};

/// A posed body and its colours, in the frame of the camera that draws it.
#[derive(Clone, Copy)]
pub(super) struct PaintedBody<'a> {
    pub(super) template: &'a Template,
    pub(super) rest: &'a RestBody,
    pub(super) paint: &'a Paint,
    /// Posed joints, metres.
    pub(super) joints: &'a [P3d],
    /// Posed vertices, metres; empty when nobody is present.
    pub(super) vertices: &'a [P3],
}

/// CameraLights in the frame of a camera, unit vectors.
struct CameraLights {
    key: V3,
    fill: V3,
    up: V3,
    shade: [f32; 4],
}

impl CameraLights {
    fn new(world_from_camera: &Rigid<World, Camera>) -> Self {
        let settings = LightSettings::default();
        let camera_from_world = world_from_camera.inverse();
        let light = |d: [f64; 3]| {
            camera_from_world
                .vector(&V3d::from(d))
                .normalize()
                .cast::<f32>()
        };
        Self {
            key: light(settings.key),
            fill: light(settings.fill),
            up: light([0.0, 1.0, 0.0]),
            shade: settings.shade,
        }
    }

    /// Brightness of a surface with a unit normal.
    fn shade(&self, n: &V3) -> f32 {
        let [ambient, sky, key, fill] = self.shade;
        ambient
            + sky * n.dot(&self.up)
            + key * n.dot(&self.key).max(0.0)
            + fill * n.dot(&self.fill).max(0.0)
    }
}

/// A camera in a room.
#[derive(Clone, Debug)]
pub(super) struct RoomView {
    camera: Intrinsics,
    place: Rigid<World, Camera>,
    background: Background,
}

impl RoomView {
    /// Draws the room.
    pub(super) fn new(
        room: Option<&Room>,
        camera: Intrinsics,
        place: Rigid<World, Camera>,
    ) -> Self {
        Self {
            background: Room::draw(room, &camera, &place),
            camera,
            place,
        }
    }

    /// Adds a chair to the depth of the room; `at` is on the floor, `turn` about the vertical (radians).
    pub(super) fn place_chair(&mut self, at: &P3d, turn: f64) {
        let at = at.cast::<f32>();
        let chair = Piece::Chair.surface();
        let chair = chair.placed([at.x, 0.0, at.z], turn as f32);
        let seen = chair.seen_from(&self.place);
        seen.draw(&self.camera, &mut self.background.depth);
    }

    /// Pose of the camera.
    pub(super) fn place(&self) -> &Rigid<World, Camera> {
        &self.place
    }

    /// Depth of the empty room, metres, row-major.
    #[cfg(test)]
    pub(super) fn empty_depth(&self) -> &[f32] {
        &self.background.depth
    }

    /// Depth (metres, row-major, infinity for no surface) and, if asked for, interleaved sRGB of the room with the body.
    pub(super) fn draw(&self, body: &PaintedBody<'_>, color: bool) -> (Vec<f32>, Option<Vec<u8>>) {
        let mut depth = self.background.depth.clone();
        let mut pixels = color.then(|| self.background.color.clone());
        if !body.vertices.is_empty() {
            if let Some(pixels) = &mut pixels {
                self.cast_shadow(body, pixels);
            }
            self.draw_body(body, &mut depth, pixels.as_deref_mut());
        }
        (depth, pixels)
    }

    fn draw_body(&self, body: &PaintedBody<'_>, depth: &mut [f32], color: Option<&mut [u8]>) {
        let t = body.template;
        let faces = t.mesh().faces();
        let view = View::Perspective {
            camera: self.camera,
            near: NEAR,
        };
        let mut buffer = VisibilityBuffer::default();
        let options = Options {
            par: Par::Seq,
            cull: Cull::Back,
            ..Options::default()
        };
        let vertices = body.vertices;
        rasterise_with(options, &view, vertices, faces, &mut buffer);
        let mut normals = Vec::new();
        if color.is_some() {
            let around = t.topology().vertex_faces();
            vertex_normals(Par::Seq, vertices, faces, around, &mut normals);
        }
        let lights = CameraLights::new(&self.place);
        let mut color = color;
        let width = buffer.width as usize;
        for (i, (&id, &z)) in buffer.face.iter().zip(&buffer.depth).enumerate() {
            if id == VisibilityBuffer::NONE || z >= depth[i] {
                continue;
            }
            depth[i] = z;
            let Some(color) = color.as_deref_mut() else {
                continue;
            };
            let f = faces[id as usize];
            let corners = f.map(|k| vertices[k as usize]);
            let w = barycentrics(&view, corners, (i % width) as f32, (i / width) as f32)
                .unwrap_or([1.0, 0.0, 0.0]);
            let mix = |a: V3, b: V3, c: V3| a * w[0] + b * w[1] + c * w[2];
            let [n0, n1, n2] = f.map(|k| normals[k as usize]);
            let [r0, r1, r2] = f.map(|k| body.rest.base[k as usize].coords);
            let (n, rest) = (mix(n0, n1, n2), mix(r0, r1, r2));
            let nearest = if w[0] >= w[1] && w[0] >= w[2] {
                0
            } else {
                1 + usize::from(w[2] > w[1])
            };
            let base = body.paint.color(f[nearest], &P3::from(rest));
            let shade = lights.shade(&(n / n.norm().max(f32::EPSILON)));
            for (c, b) in color[3 * i..3 * i + 3].iter_mut().zip(base) {
                *c = (f32::from(b) * shade).min(255.0) as u8;
            }
        }
    }

    /// Darkens the floor under feet and body.
    fn cast_shadow(&self, body: &PaintedBody<'_>, color: &mut [u8]) {
        let skeleton = body.template.skeleton();
        let over = |name: &str| {
            let joint = &body.joints[skeleton.index(name).unwrap_or(0)];
            let p = self.place.point(joint);
            [p.x as f32, p.z as f32]
        };
        let LightSettings {
            shadow,
            shadow_depth,
            ..
        } = LightSettings::default();
        let spots = [
            (over("left_foot"), shadow[0], shadow_depth[0]),
            (over("right_foot"), shadow[0], shadow_depth[0]),
            (over("pelvis"), shadow[1], shadow_depth[1]),
        ];
        for &(i, at) in &self.background.floor {
            let mut light = 1.0f32;
            for (c, radius, strength) in spots {
                let r2 = ((at[0] - c[0]).powi(2) + (at[1] - c[1]).powi(2)) / (radius * radius);
                if r2 < 1.0 {
                    light *= 1.0 - strength * (1.0 - r2) * (1.0 - r2);
                }
            }
            if light < 1.0 {
                for c in &mut color[3 * i as usize..3 * i as usize + 3] {
                    *c = (f32::from(*c) * light) as u8;
                }
            }
        }
    }
}
