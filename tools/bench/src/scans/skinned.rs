//! Garments that follow the bones of the body below them, without a simulation: for straps, bibs and scarves that cloth
//! held at the shoulders or the waist alone would drop.

use super::settings::ScanSettings;
use nalgebra::Matrix4;
use std::path::Path;
use tryon_body::{BoneTransforms, RestBody, Template};
use tryon_formats::morph_target::MAKEHUMAN_UNIT;
use tryon_formats::obj::{ObjMesh, read_obj};
use tryon_formats::sewn_obj::SewnObj;
use tryon_garment::import::{from_mesh, read_mesh, split};
use tryon_garment::{GarmentKind, GarmentMesh, Material};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::smoothing::smoothed;
use tryon_geometry::mesh::{Csr, Face, TriMesh, remesh};
use tryon_geometry::par::Par;
use tryon_geometry::spatial::Bvh;

/// Vertices of the body in the base mesh hm08; shells that clothes are bound to follow.
const BODY_VERTICES: u32 = 13_380;
/// Rounds of smoothing of displacements and weights over a garment: closest skin jumps, cloth does not.
const SMOOTHING: usize = 12;

/// Parts of a file that are one garment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GarmentParts {
    /// Each connected one: a suit.
    Each,
    /// All together: a pair of shoes.
    All,
}

/// Garment on the body that it was made on, which has the topology of the subject's.
#[derive(Clone, Debug)]
pub struct SkinnedGarment {
    /// Mesh.
    mesh: GarmentMesh,
    /// Its vertices, rest frame of the source body (m).
    positions: Vec<P3>,
    neighbours: Csr,
    /// Vertices of the source body (m).
    source: Vec<P3>,
}

/// Garment bound to the rest body of a subject.
#[derive(Clone, Debug)]
pub(super) struct BoundGarment {
    mesh: GarmentMesh,
    /// Vertices at rest (m).
    rest: Vec<P3>,
    /// Weights of all joints, shape `[vertices, joints]`.
    weights: Vec<Vec<f64>>,
    posed: Vec<P3>,
}

impl SkinnedGarment {
    /// Reads MakeHuman clothes bound to the base mesh in `base`, with triangles of `edge` metres. All are of kind
    /// [`GarmentKind::Top`]: kinds are not told apart. Garments are in the order of their mean distance from the base.
    ///
    /// # Errors
    /// A fault of one of the files, or a base mesh without the vertices that the clothes name.
    pub fn read(
        clothes: &Path,
        base: &Path,
        parts: GarmentParts,
        edge: f64,
        settings: &ScanSettings,
    ) -> Result<Vec<Self>, String> {
        let base = read_obj(base).map_err(|e| e.to_string())?.mesh;
        let file = read_mesh(clothes, Some(base.vertices())).map_err(|e| e.to_string())?;
        if !file.bound {
            return Err(format!("{}: not bound to the base", clothes.display()));
        }
        let metres = |x: &[P3]| -> Vec<P3> { x.iter().map(|p| p * MAKEHUMAN_UNIT).collect() };
        let source = metres(base.vertices());
        let pieces = match parts {
            GarmentParts::Each => split(&file.sewn),
            GarmentParts::All => vec![file.sewn],
        };
        let meshes = pieces.into_iter().filter_map(|piece| {
            let mesh = piece.obj.mesh;
            let x = metres(mesh.vertices());
            mesh.with_vertices(x).ok()
        });
        let is_large = |m: &TriMesh| {
            m.bounds()
                .is_some_and(|(lo, hi)| (hi - lo).amax() > settings.smallest)
        };
        let made = meshes.filter(is_large);
        let made = made.map(|mesh| Self::new(&file.name, &remesh(&mesh, edge), &source));
        let mut made: Vec<Self> = made.collect::<Result<_, _>>()?;
        let is_body = |f: &&Face| f.iter().all(|v| *v < BODY_VERTICES);
        let body: Vec<Face> = base.faces().iter().filter(is_body).copied().collect();
        let bvh = Bvh::new(&body, &source);
        made.sort_by(|a, b| a.height(&bvh).total_cmp(&b.height(&bvh)));
        Ok(made)
    }

    /// Mean distance from the source body (m).
    fn height(&self, body: &Bvh) -> f32 {
        let above = |p: &P3| body.closest(&self.source, p).map_or(0.0, |c| c.distance);
        self.positions.iter().map(above).sum::<f32>() / self.positions.len().max(1) as f32
    }

    fn new(name: &str, mesh: &TriMesh, source: &[P3]) -> Result<Self, String> {
        let cotton = Material::preset("cotton").map_err(|e| e.to_string())?;
        let sewn = SewnObj {
            obj: ObjMesh::from(mesh.clone()),
            stitches: Vec::new(),
        };
        let made = from_mesh(&sewn, name, GarmentKind::Top, cotton).map_err(|e| e.to_string())?;
        let topology = made.garment.topology().map_err(|e| e.to_string())?;
        Ok(Self {
            mesh: made.garment,
            positions: made.positions,
            neighbours: topology.vertex_neighbours().clone(),
            source: source.to_vec(),
        })
    }

    /// The garment moved with the skin below it from the source body to a subject of the same topology, and off the skin by
    /// `gap` (m) at least.
    pub(super) fn bind(
        &self,
        template: &Template,
        rest: &RestBody,
        gap: f32,
    ) -> Result<BoundGarment, String> {
        let count = rest.vertices.len();
        let source = self
            .source
            .get(..count)
            .ok_or_else(|| format!("{}: made on {} vertices", self.mesh.name, self.source.len()))?;
        let faces = template.mesh().faces();
        let bvh = Bvh::new(faces, source);
        let joints = template.skeleton().len();
        let mut shifts = Vec::with_capacity(self.positions.len());
        let mut weights = Vec::with_capacity(self.positions.len());
        for p in &self.positions {
            let (mut shift, mut row) = (V3::zeros(), vec![0.0; joints]);
            if let Some(below) = bvh.closest(source, p) {
                for (v, w) in faces[below.face as usize].iter().zip(below.weights) {
                    let v = *v as usize;
                    shift += (rest.vertices[v] - source[v]) * w;
                    add_weights(template, v, f64::from(w), &mut row);
                }
            }
            shifts.push(shift);
            weights.push(row);
        }
        for _ in 0..SMOOTHING {
            shifts = smoothed(Par::Rayon, &self.neighbours, &shifts);
            weights = smoothed(Par::Rayon, &self.neighbours, &weights);
        }
        let skin = Bvh::new(faces, &rest.vertices);
        let lifted = |(p, shift): (&P3, &V3)| lift(&skin, &rest.vertices, p + shift, gap);
        let moved = self.positions.iter().zip(&shifts);
        Ok(BoundGarment {
            mesh: self.mesh.clone(),
            rest: moved.map(lifted).collect(),
            weights,
            posed: Vec::new(),
        })
    }
}

/// A point, or the one at `gap` (m) over the surface where it lies lower.
fn lift(surface: &Bvh, vertices: &[P3], p: P3, gap: f32) -> P3 {
    let Some(below) = surface.closest(vertices, &p) else {
        return p;
    };
    let [a, b, c] = surface.faces()[below.face as usize].map(|v| vertices[v as usize]);
    let normal = (b - a).cross(&(c - a)).try_normalize(0.0);
    let normal = normal.filter(|n| n.dot(&(p - below.point)) < gap);
    normal.map_or(p, |n| below.point + n * gap)
}

/// Adds `share` of the joint weights of a skin vertex.
fn add_weights(template: &Template, vertex: usize, share: f64, row: &mut [f64]) {
    let of = template.weights();
    for (joint, weight) in of.joints[vertex].iter().zip(of.weights[vertex]) {
        row[usize::from(*joint)] += share * f64::from(weight);
    }
}

impl BoundGarment {
    /// Moves the garment to a pose by linear blend skinning.
    pub(super) fn pose(&mut self, bones: &BoneTransforms) {
        let bones: Vec<Matrix4<f64>> = bones.bones.iter().map(|b| b.to_homogeneous()).collect();
        let posed = self.rest.iter().zip(&self.weights).map(|(p, row)| {
            let used = row.iter().zip(&bones).filter(|(w, _)| **w > 0.0);
            let blend: Matrix4<f64> = used.map(|(w, bone)| bone * *w).sum();
            blend.transform_point(&p.cast::<f64>()).cast()
        });
        self.posed = posed.collect();
    }

    /// Mesh and posed vertices (m).
    pub(super) fn surface(&self) -> (&GarmentMesh, &[P3]) {
        (&self.mesh, &self.posed)
    }
}
