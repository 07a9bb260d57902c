//! Surfaces of one scan in one mesh: skin and garments.

use super::cloth_run::ClothRun;
use super::points::SKIN_LABEL;
use super::settings::ScanSettings;
use tryon_body::{RestBody, Template};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Csr, Face, vertex_normals};
use tryon_geometry::par::Par;
use tryon_geometry::spatial::PointTree;

/// Mesh of everything that a scanner can see. Vertex arrays have the shape `[vertices]`.
#[derive(Clone, Debug, Default)]
pub(super) struct SceneSurface {
    pub(super) settings: ScanSettings,
    /// True positions, world (m).
    pub(super) vertices: Vec<P3>,
    /// Positions as they hide each other.
    pub(super) drawn: Vec<P3>,
    /// Triangles; their corners have one label.
    pub(super) faces: Vec<Face>,
    /// Unit normals, outward.
    pub(super) normals: Vec<V3>,
    /// Garment number from 1, or [`SKIN_LABEL`].
    pub(super) labels: Vec<u8>,
    /// Place on the material (m): rest position on skin, texture coordinates on cloth.
    pub(super) material: Vec<V3>,
}

/// Part of a [`SceneSurface`] with one label.
struct SurfacePart<'a> {
    label: u8,
    vertices: &'a [P3],
    normals: &'a [V3],
    faces: &'a [Face],
}

impl SceneSurface {
    /// Surface of a dressed subject in its pose of now.
    pub(super) fn new(
        run: &ClothRun<'_>,
        template: &Template,
        rest: &RestBody,
        settings: ScanSettings,
    ) -> Self {
        let mut out = Self {
            settings,
            ..Self::default()
        };
        let faces = template.mesh().faces();
        out.add(
            &SurfacePart {
                label: SKIN_LABEL,
                vertices: run.body(),
                normals: &normals(run.body(), faces),
                faces,
            },
            rest.vertices.iter().map(|p| p.coords),
        );
        for (k, (mesh, positions)) in run.garments().enumerate() {
            // Normals of the sewn mesh are smooth across seams.
            let sewn = normals(positions, &mesh.faces);
            let at = |v: &u32| *v as usize;
            let vertices: Vec<P3> = (mesh.render.vertex.iter())
                .map(|v| positions[at(v)])
                .collect();
            let normals: Vec<V3> = mesh.render.vertex.iter().map(|v| sewn[at(v)]).collect();
            let part = SurfacePart {
                label: (k + 1) as u8,
                vertices: &vertices,
                normals: &normals,
                faces: &mesh.render.faces,
            };
            let uv = mesh.render.uv.iter();
            out.add(&part, uv.map(|uv| V3::new(uv[0], uv[1], 0.0)));
        }
        out.inset_covered();
        out
    }

    /// Corners of a face in one of the vertex arrays, weighted.
    pub(super) fn blend(values: &[V3], face: &Face, weights: [f32; 3]) -> V3 {
        let [a, b, c] = face.map(|v| values[v as usize]);
        a * weights[0] + b * weights[1] + c * weights[2]
    }

    /// Position in a face.
    pub(super) fn place(positions: &[P3], face: &Face, weights: [f32; 3]) -> P3 {
        let [a, b, c] = face.map(|v| positions[v as usize].coords);
        P3::from(a * weights[0] + b * weights[1] + c * weights[2])
    }

    /// Place of the subject on the floor.
    pub(super) fn center(&self) -> P3 {
        let first = self.vertices.first().copied().unwrap_or_default();
        let skin = self.vertices.iter().zip(&self.labels);
        let skin = skin.filter(|(_, label)| **label == SKIN_LABEL);
        let (lo, hi) = skin.fold((first, first), |(lo, hi), (p, _)| (lo.inf(p), hi.sup(p)));
        let middle = nalgebra::center(&lo, &hi);
        P3::new(middle.x, 0.0, middle.z)
    }

    /// Draws covered vertices below their cover, from the outermost garment inwards.
    fn inset_covered(&mut self) {
        let garments = self.labels.last().copied().unwrap_or(SKIN_LABEL);
        let range = |label: u8| {
            let first = self.labels.partition_point(|l| *l < label);
            first..self.labels.partition_point(|l| *l <= label)
        };
        let ranges: Vec<_> = (0..=garments).map(range).collect();
        let vertices = |label: usize| &self.vertices[ranges[label].clone()];
        let trees: Vec<PointTree> = (0..ranges.len())
            .map(|label| PointTree::new(vertices(label)))
            .collect();
        let mut depth = vec![0.0f32; self.vertices.len()];
        for label in (0..ranges.len()).rev() {
            for i in ranges[label].clone() {
                let (p, n) = (&self.vertices[i], &self.normals[i]);
                for cover in label + 1..ranges.len() {
                    let Some((near, _)) = trees[cover].nearest(p, self.settings.cover_radius)
                    else {
                        continue;
                    };
                    let near = ranges[cover].start + near;
                    if n.dot(&(self.vertices[near] - p)) > -self.settings.poke {
                        depth[i] = depth[i].max(depth[near] + self.settings.layer_inset);
                    }
                }
            }
        }
        for (i, depth) in depth.iter().enumerate() {
            self.drawn[i] -= self.normals[i] * *depth;
        }
    }

    fn add(&mut self, part: &SurfacePart<'_>, material: impl Iterator<Item = V3>) {
        let first = self.vertices.len() as u32;
        self.vertices.extend_from_slice(part.vertices);
        self.drawn.extend_from_slice(part.vertices);
        self.normals.extend_from_slice(part.normals);
        self.labels.resize(self.vertices.len(), part.label);
        self.material.extend(material);
        let faces = part.faces.iter().map(|f| f.map(|v| v + first));
        self.faces.extend(faces);
    }
}

/// Unit vertex normals.
fn normals(vertices: &[P3], faces: &[Face]) -> Vec<V3> {
    let around = Csr::of_faces(vertices.len(), faces);
    let mut out = Vec::new();
    vertex_normals(Par::Rayon, vertices, faces, &around, &mut out);
    out
}
