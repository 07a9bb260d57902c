//! A triangle surface whose vertices move while its topology and parts stay.

use crate::settings::SkinQuerySettings;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Csr, Face, Topology, vertex_normal, vertex_normals};
use tryon_geometry::par::{self, Par};
use tryon_geometry::spatial::PointTree;

/// Parts of a surface as bits.
pub type Part = u8;

/// Immutable connectivity of a surface and the parts of its vertices.
#[derive(Clone, Debug)]
pub struct SurfaceModel {
    pub(super) faces: Vec<Face>,
    pub(super) topology: Topology,
    pub(super) parts: Vec<Part>,
    /// Vertices at the border of an open surface.
    pub(super) border: Vec<bool>,
    /// Parts common to all corners of the faces around each vertex.
    pub(super) common: Vec<Part>,
    pub(super) settings: SkinQuerySettings,
}

/// Vertices and normals of a surface at one time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SurfaceFrame {
    /// Vertices, metres, shape `[vertices]`.
    pub vertices: Vec<P3>,
    /// Unit normals, shape `[vertices]`; empty: each is computed on demand.
    pub normals: Vec<V3>,
}

impl SurfaceFrame {
    /// Vertices without normals.
    pub fn without_normals(vertices: Vec<P3>) -> Self {
        Self {
            vertices,
            normals: Vec::new(),
        }
    }
}

impl SurfaceModel {
    /// Takes connectivity and the parts of each vertex.
    pub fn new(faces: Vec<Face>, topology: Topology, mut parts: Vec<Part>) -> Self {
        parts.resize(topology.vertex_neighbours().rows(), Part::MAX);
        let of = |f: &u32| {
            faces[*f as usize]
                .iter()
                .fold(Part::MAX, |all, c| all & parts[*c as usize])
        };
        let around = |v: usize| {
            let faces = topology.vertex_faces().row(v).iter();
            faces.map(of).fold(Part::MAX, |a, b| a & b)
        };
        Self {
            common: (0..parts.len()).map(around).collect(),
            border: topology.boundary_vertices(),
            faces,
            topology,
            parts,
            settings: SkinQuerySettings::default(),
        }
    }
    /// Number of vertices.
    pub fn vertices(&self) -> usize {
        self.parts.len()
    }
    /// Triangles.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }
    /// Parts of a vertex.
    pub fn part(&self, vertex: u32) -> Part {
        self.parts[vertex as usize]
    }
    /// Vertices one edge away.
    pub fn neighbours(&self, vertex: u32) -> &[u32] {
        self.topology.vertex_neighbours().row(vertex as usize)
    }
    /// Faces around a vertex.
    pub fn faces_around(&self, vertex: u32) -> &[u32] {
        self.topology.vertex_faces().row(vertex as usize)
    }
    /// Vertices within two edges of each vertex, itself included.
    pub fn second_neighbours(&self) -> Csr {
        let mut pairs = Vec::new();
        for v in 0..self.vertices() as u32 {
            let mut near = vec![v];
            for &w in self.neighbours(v) {
                near.push(w);
                near.extend_from_slice(self.neighbours(w));
            }
            near.sort_unstable();
            near.dedup();
            pairs.extend(near.into_iter().map(|w| (v, w)));
        }
        Csr::from_pairs(self.vertices(), &pairs)
    }
    /// Fills the normals of a frame from its vertices.
    pub fn update_normals(&self, par: Par, frame: &mut SurfaceFrame) {
        vertex_normals(
            par,
            &frame.vertices,
            &self.faces,
            self.topology.vertex_faces(),
            &mut frame.normals,
        );
    }
    /// Unit normal at a vertex.
    pub(super) fn normal(&self, frame: &SurfaceFrame, vertex: u32) -> V3 {
        let around = || self.topology.vertex_faces().row(vertex as usize);
        let known = frame.normals.get(vertex as usize).copied();
        known.unwrap_or_else(|| vertex_normal(&frame.vertices, &self.faces, around()))
    }
    /// Normal interpolated in a triangle, not of unit length.
    pub(super) fn interpolated_normal(&self, frame: &SurfaceFrame, face: u32, w: [f32; 3]) -> V3 {
        let corners = self.faces[face as usize];
        (0..3).fold(V3::zeros(), |s, k| {
            s + self.normal(frame, corners[k]) * w[k]
        })
    }
    /// Nearest vertex of the parts in `mask`, by exhaustive scan: the oracle of the walk.
    pub fn nearest_vertex(&self, frame: &SurfaceFrame, p: &P3, mask: Part) -> u32 {
        let mut best = (f32::INFINITY, 0u32);
        for (i, v) in frame.vertices.iter().enumerate() {
            let d = (v - p).norm_squared();
            if d < best.0 && self.parts[i] & mask != 0 {
                best = (d, i as u32);
            }
        }
        best.1
    }
    /// [`Self::nearest_vertex`] of many points at once, each with its own mask.
    pub fn nearest_vertices<'a>(
        &self,
        par: Par,
        frame: &SurfaceFrame,
        points: &'a [P3],
        masks: impl Iterator<Item = &'a Part>,
    ) -> Vec<u32> {
        self.nearest_of_every(1, par, frame, points, masks)
    }
    /// Vertices to start walks from: the nearest among every seventh of each mask.
    pub fn walk_starts<'a>(
        &self,
        par: Par,
        frame: &SurfaceFrame,
        points: &'a [P3],
        masks: impl Iterator<Item = &'a Part>,
    ) -> Vec<u32> {
        /// Larger: smaller trees and longer walks.
        const STRIDE: usize = 7;
        self.nearest_of_every(STRIDE, par, frame, points, masks)
    }
    fn nearest_of_every<'a>(
        &self,
        stride: usize,
        par: Par,
        frame: &SurfaceFrame,
        points: &'a [P3],
        masks: impl Iterator<Item = &'a Part>,
    ) -> Vec<u32> {
        let masks: Vec<Part> = masks.copied().collect();
        let trees: BTreeMap<Part, (Vec<u32>, PointTree)> = masks
            .iter()
            .copied()
            .collect::<BTreeSet<_>>()
            .into_iter()
            .map(|mask| {
                let of = (0..self.parts.len() as u32).filter(|v| self.part(*v) & mask != 0);
                let of: Vec<u32> = of.step_by(stride).collect();
                let places: Vec<P3> = of.iter().map(|v| frame.vertices[*v as usize]).collect();
                (mask, (of, PointTree::new(&places)))
            })
            .collect();
        let mut found = Vec::new();
        par::map_into(par, points.len().min(masks.len()), 256, &mut found, |i| {
            let near = trees
                .get(&masks[i])
                .and_then(|(of, tree)| Some(of[tree.nearest(&points[i], f32::MAX)?.0]));
            near.unwrap_or(0)
        });
        found
    }
}
