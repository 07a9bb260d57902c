//! Faces, edges and rings of one garment, for contact of cloth with cloth.

use crate::contact::SurfaceModel;
use tryon_geometry::math::order_statistics::percentile;
use tryon_geometry::mesh::{Csr, edge_faces};

/// Percentage of edges that are at most as long as the length of an edge counts.
const EDGE_PERCENTILE: usize = 95;

/// Topology of one garment.
#[derive(Debug)]
pub(in crate::live) struct ContactTopology {
    /// Faces and neighbours of the cloth.
    pub(in crate::live) surface: SurfaceModel,
    /// Vertices within two rings, which flat cloth does not meet.
    two_rings: Csr,
    /// Ends of each edge, the smaller first.
    pub(super) edges: Vec<[u32; 2]>,
    /// Edges of each face.
    pub(super) face_edges: Vec<[u32; 3]>,
    /// 95th percentile of the edge lengths, metres.
    edge: f32,
}

impl ContactTopology {
    /// Takes the sheet as a surface and the lengths of its edges, metres.
    pub(in crate::live) fn new(surface: SurfaceModel, lengths: impl Iterator<Item = f32>) -> Self {
        let mut lengths: Vec<f32> = lengths.collect();
        let (mut edges, mut face_edges) = (Vec::new(), vec![[0; 3]; surface.faces().len()]);
        for of_edge in edge_faces(surface.faces()).chunk_by(|a, b| a.0 == b.0) {
            for (ends, face) in of_edge {
                let corners = surface.faces()[*face as usize];
                // The edge opposite to the corner that is no end.
                let k = (0..3).find(|k| !ends.contains(&corners[*k])).unwrap_or(0);
                face_edges[*face as usize][k] = edges.len() as u32;
            }
            edges.push(of_edge[0].0);
        }
        Self {
            two_rings: surface.second_neighbours(),
            edges,
            face_edges,
            surface,
            edge: percentile(&mut lengths, EDGE_PERCENTILE).unwrap_or(0.0),
        }
    }
    /// Length that 95 % of the edges do not exceed, metres.
    pub(in crate::live) fn edge(&self) -> f32 {
        self.edge
    }
    /// Vertices within two rings of a vertex, itself included.
    pub(super) fn within_two_rings(&self, v: u32) -> &[u32] {
        self.two_rings.row(v as usize)
    }
}
