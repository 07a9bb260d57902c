//! A synthetic user with known truth: trunk, an arm across it, a wall, a shirt in front of the trunk.

use crate::evidence::depth_sigma;
use crate::limbs::{Arm, Limbs};
use crate::{
    Appearance, BodyView, Framing, GarmentView, Input, Model, OutputFrame, RenderError,
    RenderReport, State, Workspace, render,
};
use rand::{Rng, SeedableRng};
use std::ops::Range;
use tryon_body::parts::{BodyPart, BodySegment};
use tryon_geometry::camera::{Calibration, ColorImage, DepthImage, Intrinsics, RgbdFrame};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::Face;
use tryon_geometry::raster::{View, VisibilityBuffer, rasterise};

/// Distance of the trunk's axis, metres.
const DISTANCE: f32 = 2.2;
/// Half axes of the trunk, metres.
const TRUNK: [f32; 2] = [0.17, 0.11];
/// Heights of the trunk's ends, metres.
const TRUNK_ENDS: [f32; 2] = [-0.45, 0.6];
/// Rings and vertices around of trunk and shirt.
const TRUNK_GRID: [u32; 2] = [30, 48];
const SHIRT_GRID: [u32; 2] = [40, 60];
/// Rings and vertices around of each bone of the resting arm.
const ARM_GRID: [u32; 2] = [8, 24];
/// Skin of every user, sRGB.
pub(crate) const SKIN: [u8; 3] = [205, 160, 135];
/// Own clothes, sRGB.
pub(crate) const RED: [u8; 3] = [150, 30, 40];

/// Tubes joined into one mesh.
#[derive(Clone, Default)]
pub(crate) struct TubeMesh {
    pub(crate) vertices: Vec<P3>,
    pub(crate) faces: Vec<Face>,
}

impl TubeMesh {
    /// Appends an open tube of elliptic rings with half axes `across` and `toward`; returns its vertices. Faces are
    /// counter-clockwise from outside when `across × (to − from)` points along `toward`.
    fn add(
        &mut self,
        [from, to]: [P3; 2],
        [across, toward]: [V3; 2],
        grid: [u32; 2],
    ) -> Range<u32> {
        let [rings, around] = grid;
        let base = self.vertices.len() as u32;
        for k in 0..=rings {
            let centre = from + (to - from) * (k as f32 / rings as f32);
            for j in 0..around {
                let t = std::f32::consts::TAU * j as f32 / around as f32;
                let p = centre + across * t.cos() + toward * t.sin();
                self.vertices.push(p);
            }
        }
        for k in 0..rings {
            for j in 0..around {
                let (a, b) = (base + k * around + j, base + k * around + (j + 1) % around);
                self.faces.push([a, a + around, b]);
                self.faces.push([b, a + around, b + around]);
            }
        }
        base..self.vertices.len() as u32
    }

    /// Appends an upright tube on the trunk's axis.
    fn add_upright(&mut self, ends: [f32; 2], axes: [f32; 2], grid: [u32; 2]) -> Range<u32> {
        let ends = ends.map(|y| P3::new(0.0, y, DISTANCE));
        let axes = [V3::new(-axes[0], 0.0, 0.0), V3::new(0.0, 0.0, -axes[1])];
        self.add(ends, axes, grid)
    }
}

/// Captured frame of what `visible` sees, and the pixels of the arm; `paint` is arm and colour by face.
fn capture(
    visible: &VisibilityBuffer,
    camera: Intrinsics,
    seed: u64,
    light: f32,
    paint: impl Fn(usize) -> (bool, [u8; 3]),
) -> CapturedArm {
    const WALL: (f32, [u8; 3]) = (3.0, [110, 115, 120]);
    const HOLES: f32 = 0.01;
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let (mut depth, mut color, mut arm) = (Vec::new(), Vec::new(), Vec::new());
    for (z, f) in visible.depth.iter().zip(&visible.face) {
        let (is_arm, base) = if *f == VisibilityBuffer::NONE {
            (false, WALL.1)
        } else {
            paint(*f as usize)
        };
        arm.push(is_arm);
        let z = if z.is_finite() { *z } else { WALL.0 };
        // Sum of uniforms: near enough to a normal distribution.
        let unit: f32 = (0..6).map(|_| rng.random_range(-1.0f32..1.0)).sum::<f32>() / 2f32.sqrt();
        let is_hole = rng.random_range(0.0..1.0) < HOLES;
        let mm = ((z + depth_sigma(z) * unit) * 1e3) as u16;
        depth.push(if is_hole { 0 } else { mm });
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
    CapturedArm { frame, arm }
}

/// Captured frame, and the pixels of the arm in it.
struct CapturedArm {
    frame: RgbdFrame,
    arm: Vec<bool>,
}

pub(crate) struct Scenery {
    pub(crate) calibration: Calibration,
    pub(crate) frame: RgbdFrame,
    pub(crate) body: TubeMesh,
    pub(crate) limbs: Limbs,
    pub(crate) shirt: TubeMesh,
    pub(crate) uv: Vec<[f32; 2]>,
    pub(crate) appearance: Appearance,
    /// The arm is in front, by pixel.
    pub(crate) arm: Vec<bool>,
    /// The shirt is visible but for the arm, by pixel.
    pub(crate) shirt_visible: Vec<bool>,
}

impl Scenery {
    /// A forearm across the belly, 6 cm in front of it, and a shirt a centimetre off the trunk.
    pub(crate) fn new(width: u32, height: u32, seed: u64) -> Self {
        let camera = Intrinsics::KINECT_V1.resized(width, height);
        let mut body = TubeMesh::default();
        let trunk = body.add_upright(TRUNK_ENDS, TRUNK, TRUNK_GRID);
        let trunk_faces = body.faces.len();
        let axis = V3::new(0.42, -0.12, -0.02);
        let s = axis.normalize().cross(&V3::z()).normalize() * 0.04;
        let t = s.cross(&axis.normalize());
        let start = P3::new(-0.24, 0.22, DISTANCE - 0.21);
        body.add([start, start + axis], [s, t], [16, 24]);

        // The trunk wears own clothes, 1 to 3 cm thick, in places in front of the shirt; the tracked body lacks them.
        let mut dressed = body.vertices.clone();
        for (i, p) in dressed[..trunk.len()].iter_mut().enumerate() {
            let (ring, around) = (i / TRUNK_GRID[1] as usize, i % TRUNK_GRID[1] as usize);
            let thick = 0.02 + 0.01 * (0.9 * ring as f32).sin() * (0.5 * around as f32).cos();
            p.x *= 1.0 + thick / TRUNK[0];
            p.z = DISTANCE + (p.z - DISTANCE) * (1.0 + thick / TRUNK[1]);
        }
        let visible = visibility(camera, &dressed, &body.faces);
        let paint = |f: usize| match f < trunk_faces {
            true => (false, RED),
            false => (true, SKIN),
        };
        let captured = capture(&visible, camera, seed, 1.0, paint);
        Self::assemble(camera, body, captured, [0.182, 0.122], [30, 90, 60])
    }

    /// A hand flat on the hip, two centimetres thick, and a loose shirt 3.5 cm in front of the trunk. `own` is the
    /// colour of the user's own shirt, `sleeve` that of the forearm, `light` the brightness of the room.
    pub(crate) fn resting(seed: u64, own: [u8; 3], sleeve: [u8; 3], light: f32) -> Self {
        let camera = Intrinsics::KINECT_V1;
        let mut body = TubeMesh::default();
        let trunk = body.add_upright(TRUNK_ENDS, TRUNK, TRUNK_GRID);
        let trunk_faces = body.faces.len();
        let face = body.add_upright([-0.72, -0.48], [0.08, 0.09], ARM_GRID);
        let face_faces = body.faces.len();
        let arm = add_resting_arm(&mut body);
        let forearm_faces = face_faces + 2 * (ARM_GRID[0] * ARM_GRID[1]) as usize;
        let limbs = Limbs {
            parts: (0..body.vertices.len() as u32)
                .map(|v| match v >= face.end {
                    true => BodyPart::LeftArm,
                    false => BodyPart::Trunk,
                })
                .collect(),
            arms: [arm, Arm::default()],
            face: face.collect(),
            trunk: trunk.collect(),
            segments: Vec::new(),
        };
        let visible = visibility(camera, &body.vertices, &body.faces);
        let captured = capture(&visible, camera, seed, light, |f| match f {
            f if f < trunk_faces => (false, own),
            f if f < face_faces => (false, SKIN),
            f if f < forearm_faces => (true, sleeve),
            _ => (true, SKIN),
        });
        Self {
            limbs,
            ..Self::assemble(camera, body, captured, [0.205, 0.145], [20, 220, 60])
        }
    }

    /// A shirt a centimetre off the trunk over own clothes of colour `own` that are 5 cm thick, with long sleeves on an arm
    /// that hangs beside the trunk. The picture before anybody came is the second.
    pub(crate) fn loose(seed: u64, own: [u8; 3]) -> (Self, RgbdFrame) {
        use BodySegment::{Chest, Forearm, Head};
        let camera = Intrinsics::KINECT_V1;
        let mut body = TubeMesh::default();
        let trunk = body.add_upright(TRUNK_ENDS, TRUNK, TRUNK_GRID);
        let face = body.add_upright([-0.72, -0.48], [0.08, 0.09], ARM_GRID);
        let own_faces = body.faces.len();
        let radii = [V3::new(-0.04, 0.0, 0.0), V3::new(0.0, 0.0, -0.04)];
        let ends = [-0.3, 0.3].map(|y| P3::new(0.32, y, DISTANCE));
        let arm = body.add(ends, radii, ARM_GRID);
        let mut dressed = body.vertices.clone();
        for p in &mut dressed[..trunk.len()] {
            p.x *= 1.0 + 0.05 / TRUNK[0];
        }
        let face_faces = own_faces - 2 * (ARM_GRID[0] * ARM_GRID[1]) as usize;
        let visible = visibility(camera, &dressed, &body.faces);
        let captured = capture(&visible, camera, seed, 1.0, |f| match f {
            f if (face_faces..own_faces).contains(&f) => (false, SKIN),
            _ => (false, own),
        });
        let mut nobody = VisibilityBuffer::default();
        nobody.face = vec![VisibilityBuffer::NONE; camera.pixels()];
        nobody.depth = vec![f32::INFINITY; camera.pixels()];
        let empty = capture(&nobody, camera, seed + 1, 1.0, |_| (false, own));
        let segment = |v: u32| match v {
            v if arm.contains(&v) => Forearm,
            v if face.contains(&v) => Head,
            _ => Chest,
        };
        let limbs = Limbs {
            parts: vec![BodyPart::Trunk; body.vertices.len()],
            segments: (0..body.vertices.len() as u32).map(segment).collect(),
            face: face.clone().collect(),
            ..Limbs::default()
        };
        let assembled = Self {
            limbs,
            ..Self::assemble(camera, body, captured, [0.182, 0.122], [30, 90, 60])
        };
        (assembled, empty.frame)
    }

    fn assemble(
        camera: Intrinsics,
        body: TubeMesh,
        captured: CapturedArm,
        shirt_axes: [f32; 2],
        base: [u8; 3],
    ) -> Self {
        let mut shirt = TubeMesh::default();
        shirt.add_upright([-0.35, 0.42], shirt_axes, SHIRT_GRID);
        let visible = visibility(camera, &shirt.vertices, &shirt.faces);
        Self {
            calibration: Calibration::registered(camera),
            frame: captured.frame,
            body,
            limbs: Limbs::default(),
            uv: shirt.vertices.iter().map(|p| [p.x + p.z, p.y]).collect(),
            shirt,
            appearance: Appearance {
                base,
                ..Appearance::default()
            },
            arm: captured.arm,
            shirt_visible: (visible.face.iter())
                .map(|f| *f != VisibilityBuffer::NONE)
                .collect(),
        }
    }

    /// Shares of arm pixels painted over and of shirt pixels with a hole, away from outlines by `border` pixels.
    pub(crate) fn mistakes(&self, image: &ColorImage, border: i32) -> [f32; 2] {
        const SAME: u8 = 40;
        let (w, h) = (image.width() as i32, image.height() as i32);
        let is_inside = |mask: &dyn Fn(usize) -> bool, x: i32, y: i32| {
            (-border..=border).all(|dy| {
                (-border..=border).all(|dx| {
                    let (u, v) = (x + dx, y + dy);
                    u >= 0 && v >= 0 && u < w && v < h && mask((v * w + u) as usize)
                })
            })
        };
        let captured = self.frame.color.as_ref().expect("colour");
        let (mut counts, mut wrong) = ([0f32; 2], [0f32; 2]);
        for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
            let [a, b] = [image, captured].map(|i| i.at(x as u32, y as u32));
            let is_captured = (0..3).all(|k| a[k].abs_diff(b[k]) < SAME);
            if is_inside(&|i| self.arm[i] && self.shirt_visible[i], x, y) {
                counts[0] += 1.0;
                wrong[0] += f32::from(u8::from(!is_captured));
            } else if is_inside(&|i| !self.arm[i] && self.shirt_visible[i], x, y) {
                counts[1] += 1.0;
                wrong[1] += f32::from(u8::from(is_captured));
            }
        }
        assert!(counts[0] > 150.0 && counts[1] > 2000.0, "{counts:?}");
        [wrong[0] / counts[0], wrong[1] / counts[1]]
    }

    pub(crate) fn garment(&self) -> GarmentView<'_> {
        GarmentView {
            vertices: &self.shirt.vertices,
            faces: &self.shirt.faces,
            uv: &self.uv,
            normals: &[],
            places: &[],
            appearance: &self.appearance,
        }
    }

    pub(crate) fn body_view(&self) -> BodyView<'_> {
        BodyView {
            vertices: &self.body.vertices,
            faces: &self.body.faces,
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
            output: output.map(|size| OutputFrame {
                size,
                framing: Framing::Cover,
            }),
        }
    }
}

/// Appends the arm with the hand on the hip: elbow, wrist, and knuckles along the trunk.
fn add_resting_arm(body: &mut TubeMesh) -> Arm {
    let on_trunk = |x: f32, y: f32| {
        let depth = TRUNK[1] * (1.0 - (x / TRUNK[0]).powi(2)).max(0.0).sqrt();
        P3::new(x, y, DISTANCE - depth - 0.01)
    };
    let joints = [
        P3::new(-0.38, 0.0, DISTANCE - 0.01),
        on_trunk(-0.16, 0.16),
        on_trunk(-0.125, 0.18),
        on_trunk(-0.08, 0.2),
        on_trunk(-0.01, 0.22),
    ];
    let bones: Vec<Range<u32>> = (joints.windows(2).enumerate())
        .map(|(k, ends)| {
            let axis = (ends[1] - ends[0]).normalize();
            let s = axis.cross(&V3::z()).normalize();
            let (wide, thick) = if k == 0 { (0.035, 0.03) } else { (0.04, 0.01) };
            let axes = [s * wide, s.cross(&axis) * thick];
            body.add([ends[0], ends[1]], axes, ARM_GRID)
        })
        .collect();
    let (elbow, wrist, end) = (bones[0].start, bones[1].start, bones[3].end);
    let ring = ARM_GRID[1];
    Arm {
        forearm: (elbow..wrist).collect(),
        hand: (wrist..end).collect(),
        rings: [elbow..elbow + ring, wrist..wrist + ring, end - ring..end].map(|r| r.collect()),
    }
}

fn visibility(camera: Intrinsics, vertices: &[P3], faces: &[Face]) -> VisibilityBuffer {
    let view = View::Perspective { camera, near: 0.1 };
    let mut out = VisibilityBuffer::default();
    rasterise(&view, vertices, faces, &mut out);
    out
}

/// The picture of `input` from fresh state and workspace.
pub(crate) fn draw(
    model: &Model,
    input: &Input<'_>,
) -> Result<(ColorImage, RenderReport), RenderError> {
    render(
        model,
        &mut State::default(),
        input,
        &mut Workspace::default(),
    )
}
