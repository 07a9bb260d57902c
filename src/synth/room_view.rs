//! A camera before a room: the empty room as it sees it, and a painted body drawn into that.

use super::body_view::{BodyRaster, Canvas, LitBody};
use super::floor_shadow::FloorShadow;
use super::furniture::Piece;
use super::imaging::ColorImaging;
use super::material::CameraLights;
use super::paint::PaintedBody;
use super::room::{Background, Room};
use super::settings::LightSettings;
use tryon_geometry::camera::Intrinsics;
use tryon_geometry::math::{Camera, P3d, Rigid, World};

/// A camera in a room.
#[derive(Clone, Debug)]
pub(super) struct RoomView {
    camera: Intrinsics,
    place: Rigid<World, Camera>,
    background: Background,
    light: LightSettings,
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
            light: room.map_or_else(LightSettings::default, |room| room.light),
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
    pub(super) fn draw(
        &self,
        body: &PaintedBody<'_>,
        imaging: Option<ColorImaging>,
    ) -> (Vec<f32>, Option<Vec<u8>>) {
        let empty = &self.background.depth;
        if body.vertices.is_empty() {
            return (
                empty.clone(),
                imaging.map(|_| self.background.color.clone()),
            );
        }

        let seen = BodyRaster::whole(&self.camera, body);
        let color = imaging.map(|imaging| match imaging.samples {
            0 | 1 => self.paint(body, &seen),
            n => self.paint(body, &BodyRaster::around(&self.camera, body, n)),
        });
        (seen.depth_over(empty), color)
    }

    /// Interleaved sRGB of the room with the body.
    pub(super) fn draw_color(&self, body: &PaintedBody<'_>, imaging: ColorImaging) -> Vec<u8> {
        if body.vertices.is_empty() {
            return self.background.color.clone();
        }
        self.paint(
            body,
            &BodyRaster::around(&self.camera, body, imaging.samples),
        )
    }

    fn paint(&self, body: &PaintedBody<'_>, seen: &BodyRaster) -> Vec<u8> {
        let mut color = self.background.color.clone();
        self.cast_shadow(body, &mut color);
        let lights = CameraLights::new(&self.light, &self.place);
        let mut canvas = Canvas {
            empty: &self.background.depth,
            width: self.camera.width as usize,
            color: &mut color,
        };
        LitBody::new(body, &lights, &self.light).paint(seen, &mut canvas);
        color
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
        } = self.light;
        let spots = [
            (over("left_foot"), shadow[0], shadow_depth[0]),
            (over("right_foot"), shadow[0], shadow_depth[0]),
            (over("pelvis"), shadow[1], shadow_depth[1]),
        ];
        let pelvis = &body.joints[skeleton.index("pelvis").unwrap_or(0)];
        let cast = (self.light.cast > 0.0)
            .then(|| FloorShadow::cast(&self.light, &self.place, body.vertices, pelvis));
        for &(i, at) in &self.background.floor {
            let mut light = cast.as_ref().map_or(1.0f32, |c| c.light(at));
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
