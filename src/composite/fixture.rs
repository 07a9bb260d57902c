//! A made-up shopper with known truth: trunk, an arm across it, a wall, a shirt a centimetre off the trunk.

use super::input::{BodyView, GarmentView, Input};
use super::look::Look;
use super::occlusion::noise;
use crate::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};
use crate::math::{P3, V3};
use crate::mesh::Face;
use crate::raster::{View, VisibilityBuffer, rasterise};
use rand::{Rng, SeedableRng};

type Mesh = (Vec<P3>, Vec<Face>);

/// Distance of the trunk's axis, metres.
const DISTANCE: f32 = 2.2;

/// An open tube of elliptic rings; faces counter-clockwise from outside when `across × (to − from)` points along `toward`.
fn tube(from: P3, to: P3, across: V3, toward: V3, rings: u32, around: u32, out: &mut Mesh) {
    let base = out.0.len() as u32;
    for k in 0..=rings {
        let centre = from + (to - from) * (k as f32 / rings as f32);
        for j in 0..around {
            let t = std::f32::consts::TAU * j as f32 / around as f32;
            out.0.push(centre + across * t.cos() + toward * t.sin());
        }
    }
    for k in 0..rings {
        for j in 0..around {
            let (a, b) = (base + k * around + j, base + k * around + (j + 1) % around);
            out.1.push([a, a + around, b]);
            out.1.push([b, a + around, b + around]);
        }
    }
}

fn trunk() -> Mesh {
    let mut m = Mesh::default();
    let (a, b) = (V3::new(-0.17, 0.0, 0.0), V3::new(0.0, 0.0, -0.11));
    tube(P3::new(0.0, -0.45, DISTANCE), P3::new(0.0, 0.6, DISTANCE), a, b, 30, 48, &mut m);
    m
}

pub(crate) struct Scenery {
    pub(crate) calibration: Calibration,
    pub(crate) frame: RgbdFrame,
    pub(crate) body: Mesh,
    pub(crate) shirt: Mesh,
    pub(crate) uv: Vec<[f32; 2]>,
    pub(crate) look: Look,
    /// The arm is in front, by pixel.
    pub(crate) arm: Vec<bool>,
    /// The shirt would be seen were it not for the arm, by pixel.
    pub(crate) shirt_seen: Vec<bool>,
}

impl Scenery {
    pub(crate) fn new(width: u32, height: u32, seed: u64) -> Self {
        let camera = Intrinsics::KINECT_V1.resized(width, height);
        let view = View::Perspective { camera, near: 0.1 };
        let mut body = trunk();
        let trunk_faces = body.1.len();
        // A forearm across the belly, 6 cm in front of it.
        let axis = V3::new(0.42, -0.12, -0.02);
        let s = axis.normalize().cross(&V3::z()).normalize() * 0.04;
        let t = s.cross(&axis.normalize());
        let start = P3::new(-0.24, 0.22, DISTANCE - 0.21);
        tube(start, start + axis, s, t, 16, 24, &mut body);
        let mut shirt = Mesh::default();
        let (a, b) = (V3::new(-0.182, 0.0, 0.0), V3::new(0.0, 0.0, -0.122));
        tube(P3::new(0.0, -0.35, DISTANCE), P3::new(0.0, 0.42, DISTANCE), a, b, 40, 60, &mut shirt);
        let uv = shirt.0.iter().map(|p| [p.x + p.z, p.y]).collect();

        // What the camera sees of the trunk: own clothes, 1 to 3 cm thick, so that in places they are in front of the
        // shirt; the tracked body knows nothing of them.
        let mut dressed = body.0.clone();
        for (i, p) in dressed.iter_mut().take(31 * 48).enumerate() {
            let thick = 0.02 + 0.01 * (0.9 * (i / 48) as f32).sin() * (0.5 * (i % 48) as f32).cos();
            p.x *= 1.0 + thick / 0.17;
            p.z = DISTANCE + (p.z - DISTANCE) * (1.0 + thick / 0.11);
        }
        let mut seen = VisibilityBuffer::default();
        rasterise(&view, &dressed, &body.1, &mut seen);
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let (mut depth, mut color, mut arm) = (Vec::new(), Vec::new(), Vec::new());
        for (z, f) in seen.depth.iter().zip(&seen.face) {
            let front = *f != VisibilityBuffer::NONE && *f as usize >= trunk_faces;
            arm.push(front);
            let z = if z.is_finite() { *z } else { 3.0 };
            // Sum of uniforms: near enough to a normal distribution.
            let unit: f32 = (0..6).map(|_| rng.random_range(-1.0f32..1.0)).sum::<f32>() / 2f32.sqrt();
            let hole = rng.random_range(0.0..1.0) < 0.01;
            depth.push(if hole { 0 } else { ((z + noise(z) * unit) * 1e3) as u16 });
            let base = match (*f == VisibilityBuffer::NONE, front) {
                (true, _) => [110, 115, 120],
                (false, true) => [205, 160, 135],
                (false, false) => [150, 30, 40],
            };
            color.extend(base.map(|c: u8| c.saturating_add(rng.random_range(0..9))));
        }
        rasterise(&view, &shirt.0, &shirt.1, &mut seen);
        let shirt_seen = seen.face.iter().map(|f| *f != VisibilityBuffer::NONE).collect();
        Self {
            calibration: Calibration::registered(camera),
            frame: RgbdFrame {
                sequence: 0,
                time_ns: 0,
                depth: DepthImage::new(width, height, depth).expect("size"),
                color: Some(ColorImage::new(width, height, color).expect("size")),
            },
            body,
            shirt,
            uv,
            look: Look { base: [30, 90, 60], ..Look::default() },
            arm,
            shirt_seen,
        }
    }
    pub(crate) fn garment(&self) -> GarmentView<'_> {
        GarmentView { vertices: &self.shirt.0, faces: &self.shirt.1, uv: &self.uv, normals: &[], look: &self.look }
    }
    pub(crate) fn body_view(&self) -> BodyView<'_> {
        BodyView { vertices: &self.body.0, faces: &self.body.1 }
    }
    pub(crate) fn input<'a>(&'a self, garments: &'a [GarmentView<'a>], output: Option<[u32; 2]>) -> Input<'a> {
        Input { frame: &self.frame, calibration: &self.calibration, garments, body: Some(self.body_view()), output }
    }
}
