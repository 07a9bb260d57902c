//! Rooms of shops: a camera at a till, a mirror or a shelf, walls, furniture and the places where people stand.

use super::furniture::{NEAR, Piece, hand};
use super::room::Room;
use super::sequence::Setting;
use super::settings::ShopSettings;
use rand::{Rng, SeedableRng};
use tryon_geometry::camera::NoiseModel;
use tryon_geometry::math::{P3, P3d, V3d};

/// People that stand before the camera at most.
pub const PLACES: usize = 3;
/// Frames in which a hand is before the lens.
const HAND_FRAMES: std::ops::Range<u64> = 24..44;
const SEED: u64 = 0x5eed_0005;

/// A furnished room and its camera. The same number is the same room.
#[derive(Clone, Debug)]
pub struct Shop {
    settings: ShopSettings,
    setting: Setting,
    places: [P3d; PLACES],
    pieces: Vec<Piece>,
    depth: Vec<f32>,
    /// Distance of the hand's fingers from the lens, metres, and the turn it comes in with, radians.
    reach: Option<[f32; 2]>,
}

impl Shop {
    /// Room of this number. Every fourth camera is mounted upright, with its image turned back or left lying by turns;
    /// every third room has a mannequin, every other a rack.
    pub fn new(number: u64) -> Self {
        let settings = ShopSettings::default();
        let mut rng = rand_pcg::Pcg32::seed_from_u64(SEED + number);
        let is_upright = number.is_multiple_of(4);
        let is_lying = number.is_multiple_of(8);
        let mut away = rng.random_range(settings.away[0]..settings.away[1]);
        if !is_upright {
            away = away.max(1.3);
        }
        let height = rng.random_range(settings.height[0]..settings.height[1]);
        // Looks at the chest of a standing person.
        let down = ((height - 1.15) / away).atan().to_degrees() + rng.random_range(-3.0..5.0);
        let roll =
            rng.random_range(-settings.roll..settings.roll) + if is_lying { 90.0 } else { 0.0 };
        let room = Room {
            back_z: -(away + rng.random_range(1.3..2.8)),
            left_x: -rng.random_range(1.5..2.6),
            ..Room::default()
        };
        let setting = Setting {
            world_from_camera: Setting::tilted(height, down, roll),
            home: P3d::new(rng.random_range(-0.15..0.15), 0.0, -away),
            room: Some(room),
            noise: [NoiseModel::KinectV1, NoiseModel::TimeOfFlight][(number % 2) as usize],
            color: false,
            seed: number,
            ..Setting::default()
        };
        let setting = if is_upright && !is_lying {
            setting.portrait()
        } else {
            setting
        };
        let home = setting.home;
        let places = [
            home,
            home + V3d::new(
                -rng.random_range(0.75..0.95),
                0.0,
                -rng.random_range(0.3..0.8),
            ),
            home + V3d::new(
                rng.random_range(0.75..0.95),
                0.0,
                -rng.random_range(0.3..0.8),
            ),
        ];
        let mut shop = Self {
            settings,
            depth: Room::draw(
                setting.room.as_ref(),
                &setting.camera,
                &setting.world_from_camera,
            )
            .depth,
            reach: (number % 5 == 1)
                .then(|| [rng.random_range(0.45..0.65), rng.random_range(-0.6..0.6)]),
            places,
            pieces: Vec::new(),
            setting,
        };
        shop.furnish(number, &mut rng);
        shop
    }

    /// Camera and noise; `room` is there, for people use [`Shop::actor_setting`].
    pub fn setting(&self) -> &Setting {
        &self.setting
    }
    /// The setting of a person at `place`, without the room.
    pub fn actor_setting(&self, place: usize) -> Setting {
        Setting {
            home: self.places[place % PLACES],
            room: None,
            ..self.setting.clone()
        }
    }
    /// Kinds of furniture in the room.
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Depth of the room in frame `i`, nobody in it: metres along the optical axis, row-major, infinity for no surface.
    pub fn surface_depth(&self, i: u64) -> Vec<f32> {
        let mut depth = self.depth.clone();
        if let Some([away, turn]) = self.reach.filter(|_| HAND_FRAMES.contains(&i)) {
            let along =
                (i - HAND_FRAMES.start) as f32 / (HAND_FRAMES.end - HAND_FRAMES.start) as f32;
            let up = 0.18 - 0.36 * (along - 0.5).abs();
            let (s, c) = turn.sin_cos();
            let mut mesh = hand();
            for p in &mut mesh.vertices {
                // The camera's y points down; the arm comes from below.
                let y = p.y + up - 0.12;
                *p = P3::new(c * p.x + s * y, s * p.x - c * y, away + p.z);
            }
            mesh.draw(&self.setting.camera, &mut depth);
        }
        depth
    }

    /// Chooses and places furniture against the walls and around the people.
    fn furnish(&mut self, number: u64, rng: &mut rand_pcg::Pcg32) {
        let mut wanted = Vec::new();
        if number.is_multiple_of(3) {
            wanted.push(Piece::Mannequin);
        }
        if number % 3 == 1 {
            wanted.push(Piece::CoatStand);
        }
        if number.is_multiple_of(2) {
            wanted.push(Piece::Rack);
        }
        let count = rng.random_range(self.settings.pieces[0]..=self.settings.pieces[1]);
        while wanted.len() < count {
            wanted.push(Piece::ALL[rng.random_range(0..Piece::ALL.len())]);
        }
        let mut taken: Vec<(P3d, f64)> = self.places.iter().map(|p| (*p, 0.3)).collect();
        for piece in wanted {
            let radius = f64::from(piece.radius());
            let Some(at) = self.free_place(radius, &taken, rng) else {
                continue;
            };
            taken.push((at, radius));
            self.place(piece, &at, rng.random_range(-0.5f32..0.5));
        }
        if self.pieces.is_empty() {
            // A close camera sees little of the room: something hangs at its back.
            let z = self.setting.room.map_or(-3.0, |r| r.back_z) + 0.25;
            let at = P3d::new(self.setting.home.x + 0.5, 0.0, z);
            self.place(Piece::Curtain, &at, 0.0);
        }
    }

    /// Draws a piece into the room.
    fn place(&mut self, piece: Piece, at: &P3d, yaw: f32) {
        let at = [at.x as f32, 0.0, at.z as f32];
        let mesh = piece.surface().placed(at, yaw);
        let mesh = mesh.seen_from(&self.setting.world_from_camera);
        mesh.draw(&self.setting.camera, &mut self.depth);
        self.pieces.push(piece);
    }

    /// A free place on the floor that does not stand between the camera and people.
    fn free_place(
        &self,
        radius: f64,
        taken: &[(P3d, f64)],
        rng: &mut rand_pcg::Pcg32,
    ) -> Option<P3d> {
        let room = self.setting.room?;
        let home = self.setting.home;
        for _ in 0..self.settings.trials {
            let z = rng.random_range(room.back_z + 0.35..-0.9);
            let x = rng.random_range(room.left_x + 0.4..2.2);
            let at = P3d::new(x, 0.0, z);
            let is_free = taken.iter().enumerate().all(|(k, (p, r))| {
                let clearance = if k == 0 { self.settings.clearance } else { 0.0 };
                (p - at).norm() > radius + r.max(clearance)
            });
            // Between camera and people only the edge of the picture is used.
            let is_aside = z < home.z - 0.3 || x.abs() > radius + 0.3;
            if is_free && is_aside && self.is_in_view(&at) {
                return Some(at);
            }
        }
        None
    }

    /// A part of the axis of a piece at `at` is in the picture.
    fn is_in_view(&self, at: &P3d) -> bool {
        let camera = &self.setting.camera;
        let (w, h) = (camera.width as f32, camera.height as f32);
        self.settings.heights.iter().any(|y| {
            let world = at + V3d::new(0.0, *y, 0.0);
            let p = self.setting.world_from_camera.inverse().point(&world);
            let q = camera.project(&p.cast());
            p.z > f64::from(NEAR) && (0.0..w).contains(&q.x) && (0.0..h).contains(&q.y)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_a_room_and_another_another() {
        let (a, b) = (Shop::new(3), Shop::new(4));
        assert_eq!(a.surface_depth(0), Shop::new(3).surface_depth(0));
        assert_ne!(a.pieces(), b.pieces());
        let portrait = b.setting().camera;
        assert!(portrait.height > portrait.width);
    }

    #[test]
    fn furniture_is_before_the_walls_and_leaves_the_first_place_in_view() {
        for number in 0..20 {
            let shop = Shop::new(number);
            let set = shop.setting();
            let bare = Room::draw(set.room.as_ref(), &set.camera, &set.world_from_camera);
            let depth = shop.surface_depth(0);
            let nearer = depth.iter().zip(&bare.depth).filter(|(d, b)| d < b);
            let share = nearer.count() as f64 / depth.len() as f64;
            assert!((0.01..0.85).contains(&share), "{number}: {share}");
            assert!(depth.iter().zip(&bare.depth).all(|(d, b)| d <= b));
            // The chest of somebody at the first place is seen.
            let chest = set.home + V3d::new(0.0, 1.25, 0.0);
            let p = set.world_from_camera.inverse().point(&chest);
            let q = set.camera.project(&p.cast());
            let (w, h) = (set.camera.width as f32, set.camera.height as f32);
            assert!(
                (0.0..w).contains(&q.x) && (0.0..h).contains(&q.y),
                "{number}"
            );
            let at = q.y as usize * w as usize + q.x as usize;
            assert!(f64::from(depth[at]) > p.z, "{number}: hidden");
        }
    }

    #[test]
    fn a_hand_comes_before_the_lens_and_goes() {
        let shop = Shop::new(1);
        let count = |i: u64| {
            let near = shop.surface_depth(i).into_iter().filter(|d| *d < 0.75);
            near.count()
        };
        assert_eq!((count(0), count(60)), (0, 0));
        assert!(count(34) > 3000, "{}", count(34));
    }

    #[test]
    fn every_kind_stands_in_some_room() {
        let shops: Vec<Shop> = (0..20).map(Shop::new).collect();
        for piece in Piece::ALL {
            assert!(
                shops.iter().any(|s| s.pieces().contains(&piece)),
                "{piece:?}"
            );
        }
    }
}
