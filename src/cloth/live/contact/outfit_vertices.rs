//! Vertices of all garments of an outfit, numbered through.

use crate::contact::SurfaceModel;
use crate::live::outfit_model::Model;
use crate::live::patch::PatchWork;
use tryon_geometry::math::{P3, V3};

/// Positions and velocities of all vertices.
#[derive(Debug, Default)]
pub(super) struct OutfitVertices {
    /// First vertex of each garment, and the end.
    first: Vec<u32>,
    /// Garment of each vertex.
    owner: Vec<u32>,
    /// Metres, m/s.
    pub(super) x: Vec<P3>,
    pub(super) velocity: Vec<V3>,
}

impl OutfitVertices {
    /// Numbers the vertices.
    pub(super) fn number(&mut self, model: &Model) {
        self.first.clear();
        self.owner.clear();
        self.first.push(0);
        for (k, g) in (0u32..).zip(&model.garments) {
            self.owner.resize(self.owner.len() + g.sheet.mass.len(), k);
            self.first.push(self.owner.len() as u32);
        }
        self.x.resize(self.owner.len(), P3::origin());
        self.velocity.resize(self.owner.len(), V3::zeros());
    }

    pub(super) fn len(&self) -> usize {
        self.owner.len()
    }

    /// First number of a garment.
    pub(super) fn first(&self, garment: u32) -> u32 {
        self.first[garment as usize]
    }

    /// Number of a vertex of a garment.
    pub(super) fn number_of(&self, garment: usize, v: u32) -> usize {
        (self.first[garment] + v) as usize
    }

    /// Garment of a vertex.
    pub(super) fn garment_of(&self, v: u32) -> u32 {
        self.owner[v as usize]
    }

    /// Numbers of the neighbours of a vertex.
    pub(super) fn neighbours<'a>(
        &self,
        model: &'a Model,
        v: u32,
    ) -> impl Iterator<Item = u32> + use<'a> {
        let garment = self.garment_of(v);
        let first = self.first(garment);
        let around = surface(model, garment).neighbours(v - first);
        around.iter().map(move |w| w + first)
    }

    /// Numbers of the corners of a face.
    pub(super) fn corners(&self, model: &Model, garment: u32, face: u32) -> [u32; 3] {
        let first = self.first(garment);
        surface(model, garment).faces()[face as usize].map(|c| c + first)
    }

    /// Numbers of the ends of an edge.
    pub(super) fn ends(&self, model: &Model, garment: u32, edge: u32) -> [u32; 2] {
        let first = self.first(garment);
        model.garments[garment as usize].topology.edges[edge as usize].map(|v| v + first)
    }

    /// Takes positions and velocities over.
    pub(super) fn gather(&mut self, model: &Model, patches: &[PatchWork]) {
        let mut rest = patches.iter();
        for (k, g) in model.garments.iter().enumerate() {
            for (f, p) in g.patches.iter().zip(&mut rest) {
                for (i, v) in f.vertices[..f.owned].iter().enumerate() {
                    let v = (self.first[k] + v) as usize;
                    self.velocity[v] = p.velocity(i);
                    self.x[v] = p.position(i);
                }
            }
        }
    }
}

/// Surface of a garment.
pub(super) fn surface(model: &Model, garment: u32) -> &SurfaceModel {
    &model.garments[garment as usize].topology.surface
}
