//! Things about a person: furniture before, behind and beside them, something held, floor at the feet, a skirt, long hair.

use super::settings::LabelledSettings;
use super::viewpoint::Viewpoint;
use crate::furniture::{FurnitureMesh, Piece};
use rand::Rng;
use rand_pcg::Pcg64Mcg;
use std::f32::consts::TAU;
use tryon_body::parts::BodySide;
use tryon_geometry::math::{P3, P3d, V3};
use tryon_tracking::PartClasses;
use tryon_tracking::part_classes::PartKind;

/// Owner of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    /// The skin, or nothing.
    Body,
    /// Worn: it belongs to the part whose anchor is nearest.
    Worn,
    /// Not the person.
    Other,
}

/// Things about a person, camera frame, metres.
#[derive(Clone, Debug, Default)]
pub(super) struct Surroundings {
    worn: FurnitureMesh,
    others: FurnitureMesh,
    /// Distance from the person's axis within which others count among their cells: segmentation doesn't part what touches.
    pub(super) reach: f32,
}

/// A posed person, world frame, metres.
pub(super) struct PosedPerson<'a> {
    pub(super) classes: &'a PartClasses,
    pub(super) joints: &'a [P3d],
    pub(super) view: &'a Viewpoint,
}

impl Surroundings {
    /// Random things about a person.
    pub(super) fn draw(
        settings: &LabelledSettings,
        person: &PosedPerson<'_>,
        rng: &mut Pcg64Mcg,
    ) -> Self {
        let mut out = Self::default();
        if rng.random_bool(settings.skirts) {
            out.worn.append(&person.skirt(rng));
        }
        if rng.random_bool(settings.long_hair) {
            out.worn.append(&person.hair(rng));
        }
        if rng.random_bool(settings.surrounded) {
            for _ in 0..rng.random_range(1..=2) {
                out.others.append(&person.thing(settings, rng));
            }
            if rng.random_bool(settings.joined) {
                let [near, far] = settings.joined_reach;
                out.reach = rng.random_range(near..far);
            }
        }
        out.seen_from(person.view)
    }

    /// Random things where a person would be: what segmentation takes for a person in an empty shop.
    pub(super) fn draw_alone(
        settings: &LabelledSettings,
        person: &PosedPerson<'_>,
        rng: &mut Pcg64Mcg,
    ) -> Self {
        let [near, far] = settings.joined_reach;
        let mut out = Self {
            reach: rng.random_range(near..far),
            ..Self::default()
        };
        let kind = Piece::ALL[rng.random_range(0..Piece::ALL.len())];
        let [x, z] = person.place();
        let turn = rng.random_range(0.0..TAU);
        out.others.append(&kind.surface().placed([x, 0.0, z], turn));
        if rng.random_bool(0.5) {
            out.others.append(&person.thing(settings, rng));
        }
        out.seen_from(person.view)
    }

    /// The same things in the camera's frame.
    fn seen_from(mut self, view: &Viewpoint) -> Self {
        let to_camera = &view.world_from_camera;
        self.worn = self.worn.seen_from(to_camera);
        self.others = self.others.seen_from(to_camera);
        self
    }

    /// Draws the things over the person's depth image and tells whose each pixel is.
    pub(super) fn overlay(&self, view: &Viewpoint, depth: &mut [f32]) -> Vec<Owner> {
        let mut owners = vec![Owner::Body; depth.len()];
        for (mesh, owner) in [(&self.worn, Owner::Worn), (&self.others, Owner::Other)] {
            if mesh.faces.is_empty() {
                continue;
            }
            let mut own = vec![f32::INFINITY; depth.len()];
            mesh.draw(&view.camera, &mut own);
            let pixels = depth.iter_mut().zip(owners.iter_mut()).zip(own);
            for ((d, o), z) in pixels.filter(|((d, _), z)| z < *d) {
                (*d, *o) = (z, owner);
            }
        }
        owners
    }
}

impl PosedPerson<'_> {
    fn at(&self, kind: PartKind, side: BodySide) -> P3 {
        let place = self.classes.anchor_of(kind.class(side), self.joints);
        place.map_or_else(P3::origin, |p| p.cast())
    }

    fn both(&self, kind: PartKind) -> [P3; 2] {
        [BodySide::Left, BodySide::Right].map(|side| self.at(kind, side))
    }

    /// A tube about both hips that hangs to the knees or below, as wide as the legs stand apart.
    fn skirt(&self, rng: &mut Pcg64Mcg) -> FurnitureMesh {
        let section = |[a, b]: [P3; 2], more: f32| {
            let middle = nalgebra::center(&a, &b);
            let radius = 0.5 * (a - b).xz().norm() + more;
            ([middle.x, middle.y, middle.z], [radius; 2])
        };
        let flare = rng.random_range(0.0..0.12);
        let share = rng.random_range(0.6..1.6f32);
        let [hips, knees, feet] =
            [PartKind::Hip, PartKind::Knee, PartKind::Foot].map(|k| self.both(k));
        let toward = |a: [P3; 2], b: [P3; 2], s: f32| [0, 1].map(|k| a[k] + (b[k] - a[k]) * s);
        let hem = if share < 1.0 {
            toward(hips, knees, share)
        } else {
            toward(knees, feet, share - 1.0)
        };
        let up = V3::new(0.0, 0.08, 0.0);
        let waist = hips.map(|h| h + up);
        let mut m = FurnitureMesh::default();
        m.loft(&[
            section(waist, 0.07),
            section(hips, 0.1),
            section(hem, 0.1 + flare),
        ]);
        m
    }

    /// Hair about the skull down to the shoulders or the shoulder blades.
    fn hair(&self, rng: &mut Pcg64Mcg) -> FurnitureMesh {
        let [left, right] = self.both(PartKind::Shoulder);
        let skull = self.at(PartKind::Head, BodySide::Left);
        let front = (left - right)
            .cross(&V3::y())
            .try_normalize(0.05)
            .unwrap_or_else(V3::z);
        let wide = rng.random_range(0.085..0.14);
        let long = rng.random_range(0.1..0.35);
        let back = skull - front * 0.045;
        let section = |up: f32, wide: f32, aside: f32| {
            let p = back + V3::y() * up - front * aside;
            ([p.x, p.y, p.z], [wide, 0.8 * wide])
        };
        let mut m = FurnitureMesh::default();
        m.loft(&[
            section(0.15, 0.5 * wide, 0.0),
            section(0.08, wide, 0.0),
            section(-0.1, wide, 0.02),
            section(-long, 0.8 * wide, 0.05),
        ]);
        m
    }

    fn thing(&self, settings: &LabelledSettings, rng: &mut Pcg64Mcg) -> FurnitureMesh {
        match rng.random_range(0..5) {
            0 => self.counter(settings, rng),
            1 => self.wall(rng),
            2 => self.floor(rng),
            3 => self.held(rng),
            _ => self.piece(rng),
        }
    }

    /// Place of the person on the floor: x and z.
    fn place(&self) -> [f32; 2] {
        self.view.place.map(|x| x as f32)
    }

    /// A counter between the camera and the person.
    fn counter(&self, settings: &LabelledSettings, rng: &mut Pcg64Mcg) -> FurnitureMesh {
        let [pelvis, head] = self.view.heights.map(|h| h as f32);
        let [low, high] = settings.table_heights.map(|h| h as f32);
        let top = pelvis + rng.random_range(low..high) * (head - pelvis);
        let [x, z] = self.place();
        let near = z + rng.random_range(0.18..0.6);
        let [left, right] = [0, 1].map(|_| rng.random_range(0.2..1.2));
        let mut m = FurnitureMesh::default();
        m.block([x - left, 0.0, near], [x + right, top, near + 0.4]);
        m
    }

    fn wall(&self, rng: &mut Pcg64Mcg) -> FurnitureMesh {
        let [x, z] = self.place();
        let back = z - rng.random_range(0.15..0.5);
        let from = x + rng.random_range(-1.0..0.3);
        let mut m = FurnitureMesh::default();
        m.block(
            [from, 0.0, back - 0.1],
            [from + rng.random_range(0.1..1.0), 2.2, back],
        );
        m
    }

    /// Floor that was not taken away about the feet.
    fn floor(&self, rng: &mut Pcg64Mcg) -> FurnitureMesh {
        let [x, z] = self.place();
        let half = [0, 1].map(|_| rng.random_range(0.2..0.7));
        let mut m = FurnitureMesh::default();
        m.block(
            [x - half[0], -0.03, z - half[1]],
            [x + half[0], rng.random_range(0.0..0.02), z + half[1]],
        );
        m
    }

    /// A bag, a box or a club in one hand.
    fn held(&self, rng: &mut Pcg64Mcg) -> FurnitureMesh {
        let hands = self.both(PartKind::Hand);
        let hand = hands[rng.random_range(0..2)];
        let half: [f32; 3] = if rng.random_bool(0.5) {
            std::array::from_fn(|_| rng.random_range(0.04..0.22))
        } else {
            [0.02, 0.02, rng.random_range(0.2..0.5)]
        };
        let mut m = FurnitureMesh::default();
        m.block(half.map(|h| -h), half);
        let drop = if rng.random_bool(0.5) { half[1] } else { 0.0 };
        m.placed([hand.x, hand.y - drop, hand.z], rng.random_range(0.0..TAU))
    }

    fn piece(&self, rng: &mut Pcg64Mcg) -> FurnitureMesh {
        let kind = Piece::ALL[rng.random_range(0..Piece::ALL.len())];
        let away = kind.radius() + rng.random_range(0.05..0.45);
        let (s, c) = rng.random_range(0.0..TAU).sin_cos();
        let [x, z] = self.place();
        kind.surface().placed(
            [x + away * s, 0.0, z + away * c],
            rng.random_range(0.0..TAU),
        )
    }
}
