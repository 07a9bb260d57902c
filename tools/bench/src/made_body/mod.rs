//! Maker of the embedded body: a parametric human figure by deterministic code, written by `tryon-bench make-body`.
//!
//! Anatomy tables describe an implicit surface; its left half is polygonised, remeshed with finer triangles in
//! face, hands and feet, mirrored, rigged and given directions of shape.

pub(crate) mod directions;
mod extremities;
pub(crate) mod field;
pub(crate) mod figure;
mod head;
mod limbs;
mod polygonise;
pub(crate) mod rig;
pub mod statistics;
mod torso;

use field::Field;
use figure::{Figure, Joints, STATURE};
use tryon_body::{BodyError, Skeleton, Template};
use tryon_geometry::math::{P3, P3d};
use tryon_geometry::mesh::{Border, Face, RemeshSpec, Remesher, Topology, TriMesh};

/// Name of the template.
const NAME: &str = "embedded";
/// Rounds of remeshing; more change no angle by a degree.
const ROUNDS: usize = 5;
/// Rounds of flips and relaxation after them.
const LAST_ROUNDS: usize = 2;
/// Share of the way to the neighbours' centroid per relaxation.
const RELAXATION: f64 = 0.6;
/// Newton steps that bring a relaxed vertex back to the surface.
const PROJECTION_STEPS: usize = 3;
/// Target edge lengths, metres: trunk and limbs, head, face, hand, foot. Together they give 12,000 to 14,000 vertices.
const EDGES: [f64; 5] = [0.0153, 0.0098, 0.0052, 0.0060, 0.0085];

/// The implicit surface of a figure.
fn carve(fig: &Figure, j: &Joints) -> Field {
    let mut f = Field::default();
    torso::trunk(&mut f, fig, j);
    head::head(&mut f, fig);
    limbs::arm(&mut f, fig, j);
    extremities::hand(&mut f, fig, j);
    limbs::leg(&mut f, fig, j);
    extremities::foot(&mut f, fig, j);
    f
}

/// Target edge length at a point: blends between the regions over a few centimetres.
fn edge_length(j: &Joints, p: &P3d) -> f64 {
    let ramp = |x: f64, a: f64, b: f64| ((x - a) / (b - a)).clamp(0.0, 1.0);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let head = mix(EDGES[0], EDGES[1], ramp(p.y, 1.40, 1.48));
    let face = mix(
        head,
        EDGES[2],
        ramp(p.z, 0.03, 0.07) * ramp(p.y, 1.44, 1.49) * (1.0 - ramp(p.y, 1.60, 1.64)),
    );
    let face = mix(
        face,
        EDGES[2],
        ramp(p.x, 0.066, 0.074) * ramp(p.y, 1.52, 1.54) * (1.0 - ramp(p.y, 1.61, 1.63)),
    );
    let along = (p - j.wrist).dot(&(j.hand_end - j.wrist).normalize());
    let hand = if p.x > 0.3 {
        mix(face, EDGES[3], ramp(along, -0.05, 0.03))
    } else {
        face
    };
    mix(hand, EDGES[4], 1.0 - ramp(p.y, 0.06, 0.14))
}

/// The left half with edges of the target lengths, its cut at x = 0 in the mirror plane.
fn remeshed(
    field: &Field,
    j: &Joints,
    points: Vec<P3d>,
    faces: Vec<Face>,
) -> (Vec<P3d>, Vec<Face>) {
    let spec = RemeshSpec {
        target: &|p| edge_length(j, p),
        project: &|p| field.project(p, PROJECTION_STEPS),
        border: Border::MirrorPlane,
        graded: true,
        keep_creases: false,
        relaxation: RELAXATION,
    };
    let mut remesher = Remesher::new(points, faces, spec);
    for round in 0..ROUNDS {
        // The polygoniser's edges are short everywhere.
        if round > 0 {
            remesher.split();
        }
        remesher.collapse();
        remesher.flip();
        remesher.relax();
    }
    for _ in 0..LAST_ROUNDS {
        remesher.flip();
        remesher.relax();
    }
    remesher.finish()
}

/// Left half of the surface, mirrored to the whole: vertices, faces and for each vertex its mirror image.
fn whole(half: &[P3d], faces: &[Face]) -> (Vec<P3d>, Vec<Face>, Vec<u32>) {
    let mut points = half.to_vec();
    let mut twin: Vec<u32> = (0..half.len() as u32).collect();
    for (i, p) in half.iter().enumerate() {
        if p.x != 0.0 {
            twin[i] = points.len() as u32;
            points.push(P3d::new(-p.x, p.y, p.z));
        }
    }
    let mut all = faces.to_vec();
    all.extend(faces.iter().map(|f| {
        [
            twin[f[0] as usize],
            twin[f[2] as usize],
            twin[f[1] as usize],
        ]
    }));
    let mut mirror = twin.clone();
    mirror.resize(points.len(), 0);
    for (i, &t) in twin.iter().enumerate() {
        mirror[t as usize] = i as u32;
    }
    (points, all, mirror)
}

/// Builds the template. The same bits every time, on any number of threads.
///
/// # Errors
/// None in a correct build.
pub fn generate() -> Result<Template, BodyError> {
    let fig = Figure::default();
    let j = fig.joints();
    let field = carve(&fig, &j);
    let (points, faces) = polygonise::polygonise(
        &field,
        P3d::new(0.0, -0.03, -0.25),
        P3d::new(0.75, STATURE + 0.05, 0.30),
    );
    let (half, half_faces) = remeshed(&field, &j, points, faces);
    let (points, faces, mirror) = whole(&half, &half_faces);
    let joints = rig::joints(&j);
    let skeleton = Skeleton::new(joints)?;
    let vertices = points
        .iter()
        .map(|p| P3::new(p.x as f32, p.y as f32, p.z as f32))
        .collect();
    let mesh = TriMesh::new(vertices, faces)?;
    let weights = rig::skin_weights(&j, &points, &Topology::new(&mesh)?, &skeleton)?;
    let plain = Template::new(NAME, mesh, skeleton, weights, None)?;
    let space = directions::shape_space(&directions::ShapeSource {
        template: &plain,
        points: &points,
        mirror: &mirror,
    })?;
    Template::new(
        NAME,
        plain.mesh().clone(),
        plain.skeleton().clone(),
        plain.weights().clone(),
        Some(space),
    )
}

#[cfg(test)]
mod tests;
