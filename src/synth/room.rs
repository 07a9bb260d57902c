//! A room with a wooden floor and two walls, or a studio with a seamless backdrop, rendered once.

use super::backdrop::Backdrop;
use super::settings::LightSettings;
use tryon_geometry::camera::Intrinsics;
use tryon_geometry::math::{Camera, P3d, Rigid, V3d, World};

/// Planes and colours of a room. World frame: floor at y = 0, the camera looks towards −z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Room {
    /// z of the back wall, metres (negative: in front of the camera).
    pub back_z: f64,
    /// x of the left wall, metres; −∞ for none.
    pub left_x: f64,
    /// Colour of the walls, sRGB.
    pub wall: [u8; 3],
    /// Mean colour of the floor, sRGB.
    pub floor: [u8; 3],
    /// Width of a floor board, metres.
    pub board: f64,
    /// Height of the skirting, metres.
    pub skirting: f64,
    /// A framed picture on the back wall: x from, to, y from, to, metres.
    pub picture: [f64; 4],
    /// A seamless sheet instead of floor boards and walls of plaster.
    pub backdrop: Option<Backdrop>,
    /// Light on people.
    pub light: LightSettings,
}

impl Default for Room {
    fn default() -> Self {
        Self {
            back_z: -3.9,
            left_x: -2.1,
            wall: [196, 194, 188],
            floor: [150, 112, 76],
            board: 0.12,
            skirting: 0.09,
            picture: [0.75, 1.30, 1.15, 1.85],
            backdrop: None,
            light: LightSettings::default(),
        }
    }
}

/// The empty room as the camera sees it.
#[derive(Clone, Debug)]
pub(super) struct Background {
    /// Metres along the optical axis, row-major; infinity where nothing is.
    pub(super) depth: Vec<f32>,
    /// Interleaved sRGB.
    pub(super) color: Vec<u8>,
    /// Pixels that see the floor: index and world x, z.
    pub(super) floor: Vec<(u32, [f32; 2])>,
}

/// Height to which the backdrop takes the shadow of a person, metres.
const SHADOWED: f64 = 0.2;

/// Hash of a cell to [0, 1), for the texture of boards and plaster.
fn speckle(a: i64, b: i64) -> f64 {
    let mut x = (a as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (b as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    x = (x ^ (x >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    ((x ^ (x >> 32)) & 0xffff) as f64 / 65_536.0
}

impl Room {
    /// A photographer's studio: a seamless backdrop under broad lights.
    pub fn studio() -> Self {
        Self {
            back_z: -4.6,
            left_x: f64::NEG_INFINITY,
            backdrop: Some(Backdrop::default()),
            light: LightSettings {
                key: [-0.5, 0.72, 0.62],
                fill: [0.85, 0.25, 0.45],
                shade: [0.40, 0.12, 0.50, 0.20],
                width: [0.35, 0.6],
                cast: 0.42,
                occlusion: 0.75,
                shadow_depth: [0.0, 0.0],
                ..LightSettings::default()
            },
            ..Self::default()
        }
    }

    /// Draws the room, or emptiness without one.
    pub(super) fn draw(
        room: Option<&Self>,
        camera: &Intrinsics,
        world_from_camera: &Rigid<World, Camera>,
    ) -> Background {
        let n = camera.pixels();
        let mut out = Background {
            depth: vec![f32::INFINITY; n],
            color: vec![24; 3 * n],
            floor: Vec::new(),
        };
        let Some(room) = room else { return out };
        let eye = world_from_camera.point(&P3d::origin());
        for i in 0..n {
            let (u, v) = (
                (i % camera.width as usize) as f64,
                (i / camera.width as usize) as f64,
            );
            let ray = V3d::new(
                (u - camera.cx) / camera.fx,
                (v - camera.cy) / camera.fy,
                1.0,
            );
            let d = world_from_camera.vector(&ray);
            if let Some(sheet) = &room.backdrop {
                room.draw_sheet(sheet, i, &eye, &d, &mut out);
                continue;
            }
            // The ray has z = 1 in the camera, so its parameter is the depth.
            let hit = |distance: f64, speed: f64| {
                let t = distance / speed;
                if t.is_finite() && t > 0.0 {
                    t
                } else {
                    f64::INFINITY
                }
            };
            let (floor, back, left) = (
                hit(-eye.y, d.y),
                hit(room.back_z - eye.z, d.z),
                hit(room.left_x - eye.x, d.x),
            );
            let t = floor.min(back).min(left);
            if !t.is_finite() {
                continue;
            }
            let p = eye + d * t;
            // Width of a pixel there: finer texture fades to its mean.
            let pixel = t / camera.fx;
            let (base, shade) = if t == floor {
                out.floor.push((i as u32, [p.x as f32, p.z as f32]));
                (room.floor, room.floor_shade(&p, pixel))
            } else if t == back {
                (
                    room.wall_color(&p),
                    room.wall_shade([p.x, p.y], p.x - room.left_x, pixel),
                )
            } else {
                (
                    room.wall,
                    0.86 * room.wall_shade([p.z, p.y], p.z - room.back_z, pixel),
                )
            };
            out.depth[i] = t as f32;
            for (c, b) in out.color[3 * i..3 * i + 3].iter_mut().zip(base) {
                *c = (f64::from(b) * shade).clamp(0.0, 255.0) as u8;
            }
        }
        out
    }

    /// Pixel `i` of a backdrop, on the ray from `eye` along `d` with z = 1 in the camera.
    fn draw_sheet(&self, sheet: &Backdrop, i: usize, eye: &P3d, d: &V3d, out: &mut Background) {
        let Some(hit) = sheet.hit(self.back_z, eye, d) else {
            return;
        };
        let p = eye + d * hit.at;
        out.depth[i] = hit.at as f32;
        // The shadow goes on where the sheet is still flat.
        if p.y < SHADOWED {
            out.floor.push((i as u32, [p.x as f32, p.z as f32]));
        }
        let light = sheet.light(&p, &hit.normal);
        for (c, b) in out.color[3 * i..3 * i + 3].iter_mut().zip(sheet.color) {
            // Dithered: a soft gradient has no bands.
            *c = (f64::from(b) * light + speckle(i as i64, 3)).clamp(0.0, 255.0) as u8;
        }
    }

    fn wall_color(&self, p: &P3d) -> [u8; 3] {
        let [x0, x1, y0, y1] = self.picture;
        let inside = |m: f64| (x0 + m..x1 - m).contains(&p.x) && (y0 + m..y1 - m).contains(&p.y);
        if inside(0.05) {
            let s = (p.y - y0) / (y1 - y0) + 0.12 * (9.0 * p.x).sin();
            return if s > 0.55 {
                [170, 196, 210]
            } else {
                [92, 128, 104]
            };
        }
        if inside(0.025) {
            return [236, 234, 228];
        }
        if inside(0.0) {
            return [74, 56, 44];
        }
        self.wall
    }

    fn floor_shade(&self, p: &P3d, pixel: f64) -> f64 {
        let row = (p.x / self.board).floor();
        let end = ((p.z + 1.7 * speckle(row as i64, 5)) / 1.1).floor();
        let tint = 0.90 + 0.16 * speckle(row as i64, end as i64);
        let grain =
            0.04 * ((p.x * 310.0 + 3.0 * (p.z * 4.0).sin()).sin()) * (1.0 - pixel / 0.01).max(0.0);
        let from_edge = (p.x / self.board - row).min(row + 1.0 - p.x / self.board) * self.board;
        let gap = 0.35 * (1.0 - from_edge / 0.004).max(0.0) * (1.0 - pixel / 0.012).max(0.0);
        // Ambient occlusion of the corners.
        let corner =
            0.25 * (-(p.z - self.back_z) / 0.35).exp() + 0.2 * (-(p.x - self.left_x) / 0.35).exp();
        (tint + grain - gap) * (1.0 - corner) * 0.95
    }

    fn wall_shade(&self, [along, y]: [f64; 2], to_corner: f64, pixel: f64) -> f64 {
        let plaster =
            0.03 * (speckle((along / 0.012).floor() as i64, (y / 0.012).floor() as i64) - 0.5);
        let plaster = plaster * (1.0 - pixel / 0.012).max(0.0);
        let light = 0.80 + 0.12 * (y / 2.4).clamp(0.0, 1.0);
        let corner = 0.18 * (-to_corner.max(0.0) / 0.4).exp() + 0.15 * (-y.max(0.0) / 0.25).exp();
        if y < self.skirting {
            // A lighter board with a dark line above.
            return if y > self.skirting - 0.008 {
                0.70
            } else {
                1.05 - corner
            };
        }
        light + plaster - corner
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_of_floor_and_wall_equals_the_ray_plane_intersection() {
        let k = Intrinsics::KINECT_V1;
        let world_from_camera = Rigid::<World, Camera>::level(1.0);
        let room = Room {
            left_x: f64::NEG_INFINITY,
            ..Room::default()
        };
        let b = Room::draw(Some(&room), &k, &world_from_camera);
        assert!((b.depth[240 * 640 + 320] - 3.9).abs() < 1e-5);
        // Row 479 looks down at (479 − 239.5)/525: the floor one metre below is at 525/239.5.
        assert!((f64::from(b.depth[479 * 640 + 320]) - 525.0 / 239.5).abs() < 1e-4);
        assert!(b.depth.iter().all(|d| d.is_finite()));
        assert!(!b.floor.is_empty());
        assert!(
            Room::draw(None, &k, &world_from_camera)
                .depth
                .iter()
                .all(|d| d.is_infinite())
        );
    }
}
