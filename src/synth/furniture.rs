//! Furniture of a shop: chairs, tables, shelves, racks with garments, mannequins, curtains, bags, as triangle meshes.

use std::f32::consts::{PI, TAU};
use tryon_body::embedded;
use tryon_body::parts::BodySegment;
use tryon_body::{BodyShape, Template};
use tryon_geometry::camera::Intrinsics;
use tryon_geometry::math::{Camera, P3, Rigid, World};
use tryon_geometry::mesh::Face;
use tryon_geometry::par::Par;
use tryon_geometry::raster::{Cull, Options, View, VisibilityBuffer, rasterise_with};

/// Kind of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Piece {
    /// Seat, back and four legs.
    Chair,
    /// Table with folded garments on it.
    Table,
    /// Shelves of full height with boxes.
    Shelf,
    /// Sofa for two.
    Sofa,
    /// Rail with garments hung side by side.
    Rack,
    /// Stand with one coat that faces the room: as high and wide as a person.
    CoatStand,
    /// Stiff body without a head on a plate.
    Mannequin,
    /// Wavy curtain of full height.
    Curtain,
    /// Bag with handles on the floor.
    Bag,
}

impl Piece {
    /// All kinds.
    pub const ALL: [Self; 9] = [
        Self::Chair,
        Self::Table,
        Self::Shelf,
        Self::Sofa,
        Self::Rack,
        Self::CoatStand,
        Self::Mannequin,
        Self::Curtain,
        Self::Bag,
    ];

    /// Radius of the floor that it takes, metres.
    pub(super) fn radius(self) -> f32 {
        match self {
            Self::Chair | Self::CoatStand | Self::Mannequin => 0.35,
            Self::Table | Self::Rack => 0.75,
            Self::Shelf | Self::Curtain => 0.6,
            Self::Sofa => 0.85,
            Self::Bag => 0.2,
        }
    }

    /// Surface with its middle at the origin of the floor, front towards +z, metres.
    pub(super) fn surface(self) -> FurnitureMesh {
        let mut m = FurnitureMesh::default();
        match self {
            Self::Chair => chair(&mut m),
            Self::Table => table(&mut m),
            Self::Shelf => shelf(&mut m),
            Self::Sofa => sofa(&mut m),
            Self::Rack => rack(&mut m),
            Self::CoatStand => coat_stand(&mut m),
            Self::Mannequin => mannequin(&mut m, &embedded::template()),
            Self::Curtain => m.curtain(1.2, 2.25),
            Self::Bag => bag(&mut m),
        }
        m
    }
}

/// Keeps the nearer of two depth images, pixel by pixel.
pub fn overlay(depth: &mut [f32], other: &[f32]) {
    for (d, o) in depth.iter_mut().zip(other) {
        *d = d.min(*o);
    }
}

/// Triangles of a piece; both sides are seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct FurnitureMesh {
    pub(super) vertices: Vec<P3>,
    pub(super) faces: Vec<Face>,
}

/// Surfaces nearer than this are clipped, metres: no depth camera sees them.
pub(super) const NEAR: f32 = 0.2;
/// Sides of a round section.
const SIDES: u32 = 12;

impl FurnitureMesh {
    /// Turned by `yaw` radians about the vertical and moved to `at`.
    pub(super) fn placed(mut self, at: [f32; 3], yaw: f32) -> Self {
        let (s, c) = yaw.sin_cos();
        for p in &mut self.vertices {
            *p = P3::new(
                at[0] + c * p.x + s * p.z,
                at[1] + p.y,
                at[2] - s * p.x + c * p.z,
            );
        }
        self
    }

    /// The same, world to camera.
    pub(super) fn seen_from(mut self, world_from_camera: &Rigid<World, Camera>) -> Self {
        let mut seen = Vec::new();
        world_from_camera
            .inverse()
            .points_f32(&self.vertices, &mut seen);
        self.vertices = seen;
        self
    }

    /// Draws it (camera frame) over a depth image, where it is nearer.
    pub(super) fn draw(&self, camera: &Intrinsics, depth: &mut [f32]) {
        let view = View::Perspective {
            camera: *camera,
            near: NEAR,
        };
        let options = Options {
            par: Par::Seq,
            cull: Cull::None,
            ..Options::default()
        };
        let mut buffer = VisibilityBuffer::default();
        rasterise_with(options, &view, &self.vertices, &self.faces, &mut buffer);
        overlay(depth, &buffer.depth);
    }

    /// Adds another surface.
    pub(super) fn append(&mut self, other: &Self) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(&other.vertices);
        let faces = other.faces.iter().map(|f| f.map(|v| v + first));
        self.faces.extend(faces);
    }

    /// A box between two corners.
    pub(super) fn block(&mut self, low: [f32; 3], high: [f32; 3]) {
        let first = self.vertices.len() as u32;
        for k in 0..8 {
            let pick = |d: usize| if k >> d & 1 == 0 { low[d] } else { high[d] };
            self.vertices.push(P3::new(pick(0), pick(1), pick(2)));
        }
        for [a, b, c, d] in [
            [0, 1, 3, 2],
            [4, 6, 7, 5],
            [0, 4, 5, 1],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 5, 7, 3],
        ] {
            self.faces.push([a, b, c].map(|v: u32| v + first));
            self.faces.push([a, c, d].map(|v: u32| v + first));
        }
    }

    /// A tube through elliptic sections, closed at both ends: middle, half width along x and half depth along z.
    pub(super) fn loft(&mut self, sections: &[([f32; 3], [f32; 2])]) {
        let first = self.vertices.len() as u32;
        for (at, [rx, rz]) in sections {
            for k in 0..SIDES {
                let (s, c) = (TAU * k as f32 / SIDES as f32).sin_cos();
                self.vertices
                    .push(P3::new(at[0] + rx * c, at[1], at[2] + rz * s));
            }
        }
        let rows = sections.len() as u32;
        for row in 0..rows.saturating_sub(1) {
            for k in 0..SIDES {
                let (a, b) = (
                    first + row * SIDES + k,
                    first + row * SIDES + (k + 1) % SIDES,
                );
                self.faces.push([a, b, b + SIDES]);
                self.faces.push([a, b + SIDES, a + SIDES]);
            }
        }
        for row in [0, rows.saturating_sub(1)] {
            let start = first + row * SIDES;
            for k in 1..SIDES - 1 {
                self.faces.push([start, start + k, start + k + 1]);
            }
        }
    }

    /// A round upright post.
    fn post(&mut self, x: f32, z: f32, y: [f32; 2], radius: f32) {
        self.loft(&[([x, y[0], z], [radius; 2]), ([x, y[1], z], [radius; 2])]);
    }

    /// A capsule-like limb from `a` to `b`: a box of this radius along its longest extent.
    fn beam(&mut self, a: [f32; 3], b: [f32; 3], radius: f32) {
        let low = std::array::from_fn(|d| a[d].min(b[d]) - radius);
        let high = std::array::from_fn(|d| a[d].max(b[d]) + radius);
        self.block(low, high);
    }

    /// A wavy sheet.
    fn curtain(&mut self, width: f32, height: f32) {
        const COLUMNS: u32 = 48;
        let first = self.vertices.len() as u32;
        for y in [0.02, height] {
            for k in 0..=COLUMNS {
                let t = k as f32 / COLUMNS as f32;
                let wave = 0.05 * (7.0 * TAU * t).sin() * if y < 1.0 { 1.3 } else { 0.8 };
                self.vertices.push(P3::new(width * (t - 0.5), y, wave));
            }
        }
        for k in 0..COLUMNS {
            let (a, b) = (first + k, first + k + COLUMNS + 1);
            self.faces.push([a, a + 1, b + 1]);
            self.faces.push([a, b + 1, b]);
        }
    }

    /// A garment on a hanger whose hook is at `top`, facing +z: shoulders, trunk and two sleeves.
    fn hung_garment(&mut self, top: [f32; 3], length: f32, depth: f32) {
        let [x, y, z] = top;
        self.loft(&[
            ([x, y - 0.06, z], [0.06, 0.4 * depth]),
            ([x, y - 0.12, z], [0.20, 0.7 * depth]),
            ([x, y - 0.30, z], [0.23, depth]),
            ([x, y - length, z], [0.25, depth]),
        ]);
        for side in [-1.0, 1.0] {
            self.loft(&[
                ([x + side * 0.18, y - 0.12, z], [0.05, 0.6 * depth]),
                ([x + side * 0.24, y - 0.35, z], [0.055, 0.6 * depth]),
                ([x + side * 0.26, y - 0.66, z], [0.05, 0.5 * depth]),
            ]);
        }
    }
}

fn chair(m: &mut FurnitureMesh) {
    m.block([-0.22, 0.43, -0.22], [0.22, 0.47, 0.22]);
    m.block([-0.22, 0.47, -0.22], [0.22, 0.92, -0.18]);
    for [x, z] in [[-0.2, -0.2], [0.2, -0.2], [-0.2, 0.2], [0.2, 0.2]] {
        m.post(x, z, [0.0, 0.44], 0.02);
    }
}

fn table(m: &mut FurnitureMesh) {
    m.block([-0.6, 0.71, -0.35], [0.6, 0.75, 0.35]);
    for [x, z] in [[-0.55, -0.3], [0.55, -0.3], [-0.55, 0.3], [0.55, 0.3]] {
        m.post(x, z, [0.0, 0.72], 0.03);
    }
    for (k, x) in [-0.4, -0.05, 0.35].into_iter().enumerate() {
        let height = 0.06 + 0.05 * k as f32;
        m.block([x - 0.13, 0.75, -0.16], [x + 0.13, 0.75 + height, 0.14]);
    }
}

fn shelf(m: &mut FurnitureMesh) {
    for x in [-0.5, 0.47] {
        m.block([x, 0.0, -0.2], [x + 0.03, 2.0, 0.2]);
    }
    m.block([-0.5, 0.0, -0.2], [0.5, 2.0, -0.18]);
    for k in 0..5 {
        let y = 0.1 + 0.45 * k as f32;
        m.block([-0.48, y, -0.2], [0.48, y + 0.03, 0.2]);
        let x = -0.35 + 0.15 * (k as f32);
        m.block([x, y + 0.03, -0.12], [x + 0.28, y + 0.2, 0.15]);
    }
}

fn sofa(m: &mut FurnitureMesh) {
    m.block([-0.8, 0.02, -0.4], [0.8, 0.42, 0.4]);
    m.block([-0.8, 0.42, -0.42], [0.8, 0.85, -0.2]);
    for x in [-0.85, 0.7] {
        m.block([x, 0.08, -0.42], [x + 0.15, 0.62, 0.4]);
    }
}

fn rack(m: &mut FurnitureMesh) {
    for x in [-0.7, 0.7] {
        m.post(x, 0.0, [0.0, 1.6], 0.018);
        m.beam([x, 0.02, -0.25], [x, 0.02, 0.25], 0.018);
    }
    m.beam([-0.7, 1.58, 0.0], [0.7, 1.58, 0.0], 0.015);
    for k in 0..11 {
        let mut garment = FurnitureMesh::default();
        let length = 0.75 + 0.08 * (k % 4) as f32;
        garment.hung_garment([0.0, 1.58, 0.0], length, 0.035);
        // Edge on: garments hang side by side along the rail, each turned a little.
        let turn = 0.5 * PI + 0.12 * ((k * 7 % 5) as f32 - 2.0);
        m.append(&garment.placed([-0.58 + 0.115 * k as f32, 0.0, 0.0], turn));
    }
}

fn coat_stand(m: &mut FurnitureMesh) {
    m.post(0.0, 0.0, [0.0, 1.75], 0.02);
    m.post(0.0, 0.0, [0.0, 0.03], 0.2);
    m.post(0.0, 0.0, [1.70, 1.78], 0.04);
    m.hung_garment([0.0, 1.62, 0.03], 1.05, 0.11);
}

fn bag(m: &mut FurnitureMesh) {
    m.loft(&[
        ([0.0, 0.0, 0.0], [0.18, 0.08]),
        ([0.0, 0.22, 0.0], [0.19, 0.10]),
        ([0.0, 0.30, 0.0], [0.15, 0.03]),
    ]);
    for x in [-0.09, 0.09] {
        m.post(x, 0.0, [0.28, 0.42], 0.008);
    }
    m.beam([-0.09, 0.42, 0.0], [0.09, 0.42, 0.0], 0.008);
}

/// The embedded body in its rest pose without head and neck, on a plate.
fn mannequin(m: &mut FurnitureMesh, template: &Template) {
    let rest = template.personalise(&BodyShape {
        coefficients: vec![1.2, -0.9, -1.0],
        ..BodyShape::default()
    });
    let (parts, weights) = (template.parts(), template.weights());
    let is_head = |v: u32| {
        let segment = parts.segment(weights.dominant(v as usize));
        matches!(segment, BodySegment::Head | BodySegment::Neck)
    };
    let low = rest.vertices.iter().map(|v| v.y).fold(0.0, f32::min);
    let lift = 0.06 - low;
    let lifted = rest.vertices.iter().map(|v| P3::new(v.x, v.y + lift, v.z));
    let faces = template.mesh().faces().iter().copied();
    m.append(&FurnitureMesh {
        vertices: lifted.collect(),
        faces: faces.filter(|f| !f.iter().any(|v| is_head(*v))).collect(),
    });
    m.post(0.0, 0.0, [0.0, 0.03], 0.25);
    m.post(0.0, -0.1, [0.0, 0.9], 0.015);
}

/// Forearm and hand that reach into the picture, along +y with the finger tips at the origin.
pub(super) fn hand() -> FurnitureMesh {
    let mut m = FurnitureMesh::default();
    m.loft(&[
        ([0.0, -0.45, 0.0], [0.045, 0.045]),
        ([0.0, -0.20, 0.0], [0.030, 0.028]),
        ([0.0, -0.17, 0.0], [0.030, 0.020]),
        ([0.0, -0.08, 0.0], [0.042, 0.015]),
        ([0.0, 0.0, 0.0], [0.030, 0.008]),
    ]);
    for k in 0..4 {
        let x = -0.03 + 0.02 * k as f32;
        m.loft(&[
            ([x, -0.08, 0.0], [0.009, 0.009]),
            ([x * 1.2, 0.0, 0.0], [0.007, 0.007]),
        ]);
    }
    m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_stand_on_the_floor_within_their_radius() {
        for piece in Piece::ALL {
            let mesh = piece.surface();
            let n = mesh.vertices.len() as u32;
            assert!(mesh.faces.iter().flatten().all(|v| *v < n), "{piece:?}");
            let low = mesh.vertices.iter().map(|v| v.y).fold(9.0, f32::min);
            assert!((-0.005..0.03).contains(&low), "{piece:?}: {low}");
            let used = mesh.faces.iter().flatten();
            let reach = used
                .map(|v| mesh.vertices[*v as usize])
                .map(|v| v.x.hypot(v.z))
                .fold(0.0, f32::max);
            assert!(reach < piece.radius() + 0.35, "{piece:?}: {reach}");
        }
    }

    #[test]
    fn a_mannequin_has_no_head_and_a_coat_stand_a_persons_height() {
        let top = |piece: Piece| {
            let m = piece.surface();
            let used = m.faces.iter().flatten().map(|v| m.vertices[*v as usize].y);
            used.fold(0.0, f32::max)
        };
        assert!((1.2..1.65).contains(&top(Piece::Mannequin)));
        assert!((1.7..1.9).contains(&top(Piece::CoatStand)));
    }

    #[test]
    fn a_quarter_turn_takes_the_front_to_the_left() {
        let mut m = FurnitureMesh::default();
        m.block([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]);
        let turned = m.placed([1.0, 0.5, 0.0], 0.5 * PI);
        assert!((turned.vertices[0] - P3::new(2.0, 0.5, 0.0)).norm() < 1e-6);
    }
}
