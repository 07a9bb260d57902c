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
mod settings;
pub mod statistics;
mod torso;

use field::Field;
use figure::{Figure, Joints, STATURE};
pub use settings::BodySettings;
use tryon_body::{BodyError, Skeleton, Template};
use tryon_geometry::math::{P3, P3d};
use tryon_geometry::mesh::{Border, Face, RemeshSpec, Remesher, Topology, TriMesh};

/// Name of the template.
const NAME: &str = "embedded";
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
fn edge_length(edges: &[f64; 5], j: &Joints, p: &P3d) -> f64 {
    let ramp = |x: f64, a: f64, b: f64| ((x - a) / (b - a)).clamp(0.0, 1.0);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let head = mix(edges[0], edges[1], ramp(p.y, 1.40, 1.48));
    let face = mix(
        head,
        edges[2],
        ramp(p.z, 0.03, 0.07) * ramp(p.y, 1.44, 1.49) * (1.0 - ramp(p.y, 1.60, 1.64)),
    );
    let face = mix(
        face,
        edges[2],
        ramp(p.x, 0.066, 0.074) * ramp(p.y, 1.52, 1.54) * (1.0 - ramp(p.y, 1.61, 1.63)),
    );
    let along = (p - j.wrist).dot(&(j.hand_end - j.wrist).normalize());
    let hand = if p.x > 0.3 {
        mix(face, edges[3], ramp(along, -0.05, 0.03))
    } else {
        face
    };
    mix(hand, edges[4], 1.0 - ramp(p.y, 0.06, 0.14))
}

/// The left half with edges of the target lengths, its cut at x = 0 in the mirror plane.
fn remeshed(
    settings: &BodySettings,
    field: &Field,
    j: &Joints,
    points: Vec<P3d>,
    faces: Vec<Face>,
) -> (Vec<P3d>, Vec<Face>) {
    let spec = RemeshSpec {
        target: &|p| edge_length(&settings.edges, j, p),
        project: &|p| field.project(p, settings.projection_steps),
        border: Border::MirrorPlane,
        graded: true,
        keep_creases: false,
        relaxation: settings.relaxation,
    };
    let mut remesher = Remesher::new(points, faces, spec);
    for round in 0..settings.rounds {
        // The polygoniser's edges are short everywhere.
        if round > 0 {
            remesher.split();
        }
        remesher.collapse();
        remesher.flip();
        remesher.relax();
    }
    for _ in 0..settings.last_rounds {
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
    let settings = BodySettings::default();
    let fig = Figure::default();
    let j = fig.joints();
    let field = carve(&fig, &j);
    let (points, faces) = polygonise::polygonise(
        &settings,
        &field,
        P3d::new(0.0, -0.03, -0.25),
        P3d::new(0.75, STATURE + 0.05, 0.30),
    );
    let (half, half_faces) = remeshed(&settings, &field, &j, points, faces);
    let (points, faces, mirror) = whole(&half, &half_faces);
    let joints = rig::joints(&j);
    let skeleton = Skeleton::new(joints)?;
    let vertices = points
        .iter()
        .map(|p| P3::new(p.x as f32, p.y as f32, p.z as f32))
        .collect();
    let mesh = TriMesh::new(vertices, faces)?;
    let weights = rig::skin_weights(&settings, &j, &points, &Topology::new(&mesh)?, &skeleton)?;
    let plain = Template::new(NAME, mesh, skeleton, weights, None)?;
    let space = directions::shape_space(&directions::ShapeSource {
        template: &plain,
        points: &points,
        mirror: &mirror,
        settings: &settings,
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
