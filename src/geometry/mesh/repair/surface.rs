//! Surface under repair: positions and faces with their sources.

use super::{MeshRepairReport, RepairedMesh};
use crate::math::P3;
use crate::mesh::edges::edge_faces;
use crate::mesh::{Face, MeshError, TriMesh};

/// Face and the given corners of its corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct SourcedFace {
    /// Vertices.
    pub(super) corners: Face,
    /// Given face.
    pub(super) face: u32,
    /// Given corners: three times their face and their place there.
    pub(super) source: Face,
}

impl SourcedFace {
    /// The same face from its other side.
    pub(super) fn turn(&mut self) {
        self.corners.swap(1, 2);
        self.source.swap(1, 2);
    }
}

/// Positions and faces under repair. Faces change vertices; vertices are only added, until [`WorkingSurface::drop_unused`].
pub(super) struct WorkingSurface {
    pub(super) points: Vec<P3>,
    /// Given vertex of each vertex.
    vertex_source: Vec<u32>,
    pub(super) faces: Vec<SourcedFace>,
}

impl WorkingSurface {
    pub(super) fn new(mesh: &TriMesh) -> Self {
        let sourced = |(i, corners): (u32, &Face)| SourcedFace {
            corners: *corners,
            face: i,
            source: [3 * i, 3 * i + 1, 3 * i + 2],
        };
        Self {
            points: mesh.vertices().to_vec(),
            vertex_source: (0..mesh.vertices().len() as u32).collect(),
            faces: (0..).zip(mesh.faces()).map(sourced).collect(),
        }
    }
    /// Longest side of the bounding box.
    pub(super) fn size(&self) -> f32 {
        let Some(first) = self.points.first() else {
            return 0.0;
        };
        let bounds = (*first, *first);
        let points = self.points.iter();
        let (lo, hi) = points.fold(bounds, |(lo, hi), p| (lo.inf(p), hi.sup(p)));
        (hi - lo).amax()
    }
    /// Positions of a face's corners.
    pub(super) fn positions(&self, face: usize) -> [P3; 3] {
        self.faces[face].corners.map(|v| self.points[v as usize])
    }
    /// Edge and face of each side, ascending.
    pub(super) fn edge_faces(&self) -> Vec<([u32; 2], u32)> {
        edge_faces(&self.faces.iter().map(|f| f.corners).collect::<Vec<_>>())
    }
    /// Face across each side of each face, in the order of [`sides`](crate::mesh::sides); `None` unless the edge has two faces.
    pub(super) fn neighbours(&self) -> Vec<[Option<u32>; 3]> {
        let mut out = vec![[None; 3]; self.faces.len()];
        for on_edge in self.edge_faces().chunk_by(|a, b| a.0 == b.0) {
            if let &[(edge, f), (_, g)] = on_edge {
                for (own, other) in [(f, g), (g, f)] {
                    let corners = self.faces[own as usize].corners;
                    let side = (0..3).find(|k| !edge.contains(&corners[(k + 2) % 3]));
                    if let Some(k) = side {
                        out[own as usize][k] = Some(other);
                    }
                }
            }
        }
        out
    }
    /// Adds a copy of a vertex and returns its number.
    pub(super) fn copy(&mut self, vertex: u32) -> u32 {
        self.points.push(self.points[vertex as usize]);
        self.vertex_source.push(self.vertex_source[vertex as usize]);
        self.points.len() as u32 - 1
    }
    /// Removes vertices without a face and returns their count.
    pub(super) fn drop_unused(&mut self) -> usize {
        let mut number = vec![u32::MAX; self.points.len()];
        for v in self.faces.iter().flat_map(|f| f.corners) {
            number[v as usize] = 0;
        }
        let mut kept = 0;
        for (v, n) in number.iter_mut().enumerate() {
            if *n == 0 {
                *n = kept;
                self.points[kept as usize] = self.points[v];
                self.vertex_source[kept as usize] = self.vertex_source[v];
                kept += 1;
            }
        }
        let dropped = self.points.len() - kept as usize;
        self.points.truncate(kept as usize);
        self.vertex_source.truncate(kept as usize);
        for f in &mut self.faces {
            f.corners = f.corners.map(|v| number[v as usize]);
        }
        dropped
    }
    /// The repaired mesh.
    pub(super) fn finish(
        self,
        thickness: Option<f32>,
        report: MeshRepairReport,
    ) -> Result<RepairedMesh, MeshError> {
        let corners = self.faces.iter().map(|f| f.corners).collect();
        Ok(RepairedMesh {
            mesh: TriMesh::new(self.points, corners)?,
            vertex_source: self.vertex_source,
            face_source: self.faces.iter().map(|f| f.face).collect(),
            corner_source: self.faces.iter().map(|f| f.source).collect(),
            thickness,
            report,
        })
    }
}
