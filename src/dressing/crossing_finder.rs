//! Edges that pass through triangles of an outfit, of one garment or of two.

use tryon_cloth::{Model, State};
use tryon_garment::joined_faces;
use tryon_geometry::math::V3d;
use tryon_geometry::par::Par;
use tryon_geometry::spatial::SelfIntersections;

/// Crossings of an outfit's cloth, vertices of all garments numbered through.
pub(super) struct CrossingFinder {
    outfit: SelfIntersections,
    x: Vec<V3d>,
}

impl CrossingFinder {
    pub(super) fn new(model: &Model, state: &State) -> Self {
        let faces = joined_faces(&model.outfit.garments);
        let x: Vec<V3d> = positions(state).collect();
        Self {
            outfit: SelfIntersections::new(&faces, &x),
            x,
        }
    }
    /// Number of crossings.
    pub(super) fn count(&mut self, state: &State) -> usize {
        self.x.clear();
        self.x.extend(positions(state));
        self.outfit.find(Par::Rayon, &self.x).len()
    }
}

fn positions(state: &State) -> impl Iterator<Item = V3d> {
    let garments = state.garments.iter();
    garments.flat_map(|g| g.positions.iter().map(|p| p.coords.cast()))
}
