//! Dressed scans for unit tests: the embedded body in a pose, thickened and coloured where it wears something.

use super::scan::{BodyScan, ScanFrame};
use super::segment::BodyRegion;
use nalgebra::{UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use tryon_body::{BodyShape, BoneTransforms, Pose, embedded, skin};
use tryon_formats::scan::ScanMesh;
use tryon_geometry::math::{P3, Rigid, V3, World};
use tryon_geometry::mesh::{Face, face_normal};
use tryon_geometry::par::Par;

const POINTS: usize = 20_000;
/// Thickness of shirt and trousers, metres.
const SHIRT: f32 = 0.010;
const TROUSERS: f32 = 0.014;

pub(super) struct TestScan {
    pub(super) file: ScanMesh,
    /// 0 skin, 1 shirt, 2 trousers, 3 shoes; shape `[points]`.
    pub(super) labels: Vec<u8>,
    /// Body without cloth, shape `[vertices]`.
    pub(super) body: Vec<P3>,
}

impl TestScan {
    /// Somebody who stands with one arm bent, turned by `yaw` radians, in a shirt of `shirt` and trousers of `trousers`.
    pub(super) fn new(yaw: f64, shirt: [u8; 3], trousers: [u8; 3]) -> Self {
        let template = embedded::template();
        let shape = BodyShape {
            coefficients: vec![0.7, -0.4, 0.6],
            ..BodyShape::default()
        };
        let rest = template.personalise(&shape);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), yaw);
        let root = Rigid::from_parts(Vector3::new(0.2, 0.0, -0.1), turn);
        let mut pose = Pose::<World>::rest(template.skeleton(), root);
        pose.set(template.skeleton(), "left_shoulder", &[0.0, -0.3, -0.3]);
        pose.set(template.skeleton(), "left_elbow", &[0.9]);
        pose.set(template.skeleton(), "right_hip", &[-0.25]);
        let mut bones = BoneTransforms::default();
        pose.bones(template.skeleton(), &rest, &mut bones);
        let mut body = Vec::new();
        let weights = template.weights();
        skin(Par::Seq, &rest.vertices, weights, &bones, &mut body);
        let normals = template.normals(&body);
        let label = |r: &BodyRegion| match r {
            BodyRegion::Chest | BodyRegion::Abdomen | BodyRegion::UpperArm => 1,
            BodyRegion::Pelvis | BodyRegion::Thigh | BodyRegion::Shin => 2,
            BodyRegion::Foot => 3,
            _ => 0,
        };
        let regions = BodyRegion::of_vertices(&template);
        let labels: Vec<u8> = regions.iter().map(label).collect();
        let thickness = [0.0, SHIRT, TROUSERS, 0.004];
        let surface: Vec<P3> = (0..body.len())
            .map(|v| body[v] + normals[v] * thickness[usize::from(labels[v])])
            .collect();
        let painted = PaintedSurface {
            vertices: &surface,
            normals: &normals,
            labels: &labels,
            colors: [[205, 160, 130], shirt, trousers, [60, 45, 40]],
        };
        let (file, labels) = painted.sample(template.mesh().faces());
        Self { file, labels, body }
    }

    /// The scan as it is read, metres and y up.
    pub(super) fn scan(&self) -> BodyScan {
        BodyScan::new(&self.file, &ScanFrame::default()).expect("a scan")
    }
}

/// Surface with a label a vertex and a colour a label.
struct PaintedSurface<'a> {
    vertices: &'a [P3],
    normals: &'a [V3],
    labels: &'a [u8],
    colors: [[u8; 3]; 4],
}

impl PaintedSurface<'_> {
    /// Points of even density, and their labels.
    fn sample(&self, faces: &[Face]) -> (ScanMesh, Vec<u8>) {
        let mut rng = rand_pcg::Pcg32::seed_from_u64(9);
        let (mut areas, mut total) = (Vec::new(), 0.0);
        for f in faces {
            total += f64::from(face_normal(self.vertices, f).norm());
            areas.push(total);
        }
        let mut file = ScanMesh::default();
        let mut point_labels = Vec::new();
        for _ in 0..POINTS {
            let at = rng.random::<f64>() * total;
            let face = faces[areas.partition_point(|a| *a < at).min(faces.len() - 1)];
            let (mut u, mut v): (f32, f32) = (rng.random(), rng.random());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let w = [1.0 - u - v, u, v];
            let sum = |x: &dyn Fn(usize) -> V3| -> V3 {
                (0..3).map(|k| x(face[k] as usize) * w[k]).sum()
            };
            let most = (0..3).max_by(|a, b| w[*a].total_cmp(&w[*b]));
            let label = self.labels[face[most.expect("three")] as usize];
            let point = sum(&|i| self.vertices[i].coords);
            file.points.push(P3::from(point));
            file.normals.push(sum(&|i| self.normals[i]).normalize());
            let shade = 0.85 + 0.3 * rng.random::<f32>();
            let color = self.colors[usize::from(label)];
            let shaded = color.map(|c| (f32::from(c) * shade).min(255.0) as u8);
            file.colors.push(shaded);
            point_labels.push(label);
        }
        (file, point_labels)
    }
}

pub(super) fn f1(truth: &[u8], found: &[u8], label: u8) -> f64 {
    let count = |f: &dyn Fn(u8, u8) -> bool| {
        truth.iter().zip(found).filter(|(t, g)| f(**t, **g)).count() as f64
    };
    let both = count(&|t, g| t == label && g == label);
    let either = count(&|t, _| t == label) + count(&|_, g| g == label);
    2.0 * both / either.max(1.0)
}
