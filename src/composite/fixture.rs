//! A made-up shopper with known truth: trunk, an arm across it, a wall, a shirt a centimetre off the trunk.

use super::input::{BodyView, GarmentView, Input};
use super::limbs::{Arm, Limbs};
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
    tube(
        P3::new(0.0, -0.45, DISTANCE),
        P3::new(0.0, 0.6, DISTANCE),
        a,
        b,
        30,
        48,
        &mut m,
    );
    m
}

/// Skin of all these shoppers, sRGB.
pub(crate) const SKIN: [u8; 3] = [205, 160, 135];

/// What the camera makes of a scene, and which pixels are the arm; `look` says by face: arm, colour.
fn capture(
    seen: &VisibilityBuffer,
    camera: Intrinsics,
    seed: u64,
    light: f32,
    look: impl Fn(usize) -> (bool, [u8; 3]),
) -> (RgbdFrame, Vec<bool>) {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let (mut depth, mut color, mut arm) = (Vec::new(), Vec::new(), Vec::new());
    for (z, f) in seen.depth.iter().zip(&seen.face) {
        let (front, base) = if *f == VisibilityBuffer::NONE {
            (false, [110, 115, 120])
        } else {
            look(*f as usize)
        };
        arm.push(front);
        let z = if z.is_finite() { *z } else { 3.0 };
        // Sum of uniforms: near enough to a normal distribution.
        let unit: f32 = (0..6).map(|_| rng.random_range(-1.0f32..1.0)).sum::<f32>() / 2f32.sqrt();
        let hole = rng.random_range(0.0..1.0) < 0.01;
        depth.push(if hole {
            0
        } else {
            ((z + noise(z) * unit) * 1e3) as u16
        });
        color.extend(
            base.map(|c: u8| ((f32::from(c) * light) as u8).saturating_add(rng.random_range(0..9))),
        );
    }
    let frame = RgbdFrame {
        sequence: 0,
        time_ns: 0,
        depth: DepthImage::new(camera.width, camera.height, depth).expect("size"),
        color: Some(ColorImage::new(camera.width, camera.height, color).expect("size")),
    };
    (frame, arm)
}

pub(crate) struct Scenery {
    pub(crate) calibration: Calibration,
    pub(crate) frame: RgbdFrame,
    pub(crate) body: Mesh,
    pub(crate) limbs: Limbs,
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
        tube(
            P3::new(0.0, -0.35, DISTANCE),
            P3::new(0.0, 0.42, DISTANCE),
            a,
            b,
            40,
            60,
            &mut shirt,
        );
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
        let (frame, arm) = capture(&seen, camera, seed, 1.0, |f| {
            if f < trunk_faces {
                (false, [150, 30, 40])
            } else {
                (true, SKIN)
            }
        });
        rasterise(&view, &shirt.0, &shirt.1, &mut seen);
        let shirt_seen = seen
            .face
            .iter()
            .map(|f| *f != VisibilityBuffer::NONE)
            .collect();
        Self {
            calibration: Calibration::registered(camera),
            frame,
            body,
            limbs: Limbs::default(),
            shirt,
            uv,
            look: Look {
                base: [30, 90, 60],
                ..Look::default()
            },
            arm,
            shirt_seen,
        }
    }
    /// A hand flat on the hip, two centimetres thick, and a loose shirt 3.5 cm in front of the trunk. `own` is the
    /// colour of the shopper's own shirt, `sleeve` that of the forearm, `light` how bright the room is.
    pub(crate) fn resting(seed: u64, own: [u8; 3], sleeve: [u8; 3], light: f32) -> Self {
        let camera = Intrinsics::KINECT_V1;
        let view = View::Perspective { camera, near: 0.1 };
        let mut body = trunk();
        let trunk_vertices = body.0.len() as u32;
        let trunk_faces = body.1.len();
        let (a, b) = (V3::new(-0.08, 0.0, 0.0), V3::new(0.0, 0.0, -0.09));
        tube(
            P3::new(0.0, -0.72, DISTANCE),
            P3::new(0.0, -0.48, DISTANCE),
            a,
            b,
            8,
            24,
            &mut body,
        );
        let (face_vertices, face_faces) = (body.0.len() as u32, body.1.len());
        // Elbow, wrist, and knuckles along the trunk.
        let on = |x: f32, y: f32| {
            P3::new(
                x,
                y,
                DISTANCE - 0.11 * (1.0 - (x / 0.17).powi(2)).max(0.0).sqrt() - 0.01,
            )
        };
        let bones = [
            P3::new(-0.38, 0.0, DISTANCE - 0.01),
            on(-0.16, 0.16),
            on(-0.125, 0.18),
            on(-0.08, 0.2),
            on(-0.01, 0.22),
        ];
        let mut starts = Vec::new();
        for (k, pair) in bones.windows(2).enumerate() {
            let axis = (pair[1] - pair[0]).normalize();
            let s = axis.cross(&V3::z()).normalize();
            let (wide, thick) = if k == 0 { (0.035, 0.03) } else { (0.04, 0.01) };
            starts.push(body.0.len() as u32);
            tube(
                pair[0],
                pair[1],
                s * wide,
                s.cross(&axis) * thick,
                8,
                24,
                &mut body,
            );
        }
        let end = body.0.len() as u32;
        let forearm_faces = 2 * 8 * 24;
        let arm = Arm::new(
            (starts[0]..starts[1]).collect(),
            (starts[1]..end).collect(),
            [
                (starts[0]..starts[0] + 24).collect(),
                (starts[1]..starts[1] + 24).collect(),
                (end - 24..end).collect(),
            ],
        );
        let limbs = Limbs::new(
            [arm, Arm::default()],
            (trunk_vertices..face_vertices).collect(),
            (0..trunk_vertices).collect(),
            (0..end).map(|v| v >= starts[0]).collect(),
        );
        let mut shirt = Mesh::default();
        let (a, b) = (V3::new(-0.205, 0.0, 0.0), V3::new(0.0, 0.0, -0.145));
        tube(
            P3::new(0.0, -0.35, DISTANCE),
            P3::new(0.0, 0.42, DISTANCE),
            a,
            b,
            40,
            60,
            &mut shirt,
        );
        let uv = shirt.0.iter().map(|p| [p.x + p.z, p.y]).collect();
        let mut seen = VisibilityBuffer::default();
        rasterise(&view, &body.0, &body.1, &mut seen);
        let (frame, arm) = capture(&seen, camera, seed, light, |f| match f {
            f if f < trunk_faces => (false, own),
            f if f < face_faces => (false, SKIN),
            f if f < face_faces + forearm_faces => (true, sleeve),
            _ => (true, SKIN),
        });
        rasterise(&view, &shirt.0, &shirt.1, &mut seen);
        let shirt_seen = seen
            .face
            .iter()
            .map(|f| *f != VisibilityBuffer::NONE)
            .collect();
        let calibration = Calibration::registered(camera);
        let look = Look {
            base: [20, 220, 60],
            ..Look::default()
        };
        Self {
            calibration,
            frame,
            body,
            limbs,
            shirt,
            uv,
            look,
            arm,
            shirt_seen,
        }
    }
    /// Shares of arm pixels painted over and of shirt pixels with a hole, away from outlines by `border` pixels.
    pub(crate) fn mistakes(&self, image: &ColorImage, border: i32) -> [f32; 2] {
        let (w, h) = (image.width() as i32, image.height() as i32);
        let inside = |mask: &dyn Fn(usize) -> bool, x: i32, y: i32| {
            (-border..=border).all(|dy| {
                (-border..=border).all(|dx| {
                    let (u, v) = (x + dx, y + dy);
                    u >= 0 && v >= 0 && u < w && v < h && mask((v * w + u) as usize)
                })
            })
        };
        let captured = self.frame.color.as_ref().expect("colour");
        let (mut counts, mut wrong) = ([0f32; 2], [0f32; 2]);
        for y in 0..h {
            for x in 0..w {
                let (a, b) = (
                    image.at(x as u32, y as u32),
                    captured.at(x as u32, y as u32),
                );
                let like_captured = (0..3).all(|k| a[k].abs_diff(b[k]) < 40);
                if inside(&|i| self.arm[i] && self.shirt_seen[i], x, y) {
                    counts[0] += 1.0;
                    wrong[0] += f32::from(u8::from(!like_captured));
                } else if inside(&|i| !self.arm[i] && self.shirt_seen[i], x, y) {
                    counts[1] += 1.0;
                    wrong[1] += f32::from(u8::from(like_captured));
                }
            }
        }
        assert!(counts[0] > 150.0 && counts[1] > 2000.0, "{counts:?}");
        [wrong[0] / counts[0], wrong[1] / counts[1]]
    }
    pub(crate) fn garment(&self) -> GarmentView<'_> {
        GarmentView {
            vertices: &self.shirt.0,
            faces: &self.shirt.1,
            uv: &self.uv,
            normals: &[],
            look: &self.look,
        }
    }
    pub(crate) fn body_view(&self) -> BodyView<'_> {
        BodyView {
            vertices: &self.body.0,
            faces: &self.body.1,
            limbs: &self.limbs,
        }
    }
    pub(crate) fn input<'a>(
        &'a self,
        garments: &'a [GarmentView<'a>],
        output: Option<[u32; 2]>,
    ) -> Input<'a> {
        Input {
            frame: &self.frame,
            calibration: &self.calibration,
            garments,
            body: Some(self.body_view()),
            output,
        }
    }
}
