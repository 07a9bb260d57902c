//! The pieces that contact is looked for in. Patches are few, and one has more skin and folds around it than the other:
//! with a patch for each, threads wait for each other.

use super::model::{GarmentModel, Model};
use super::state::{GarmentState, State, StepReport};
use crate::cloth::solver::explicit::{ContactPlane, PatchModel, V4};
use std::ops::Range;

/// Vertices of a piece: few enough that threads end together, many enough that what is
/// around a piece stays less than the piece. 256 and 1024 take as long within 3 %.
const VERTICES: usize = 512;

/// Some vertices of a patch, what is around them, and what keeps them off that.
#[derive(Debug, Default)]
pub(super) struct Piece {
    pub(super) garment: usize,
    /// The patch, among those of the garment and among all.
    pub(super) patch: usize,
    pub(super) at: usize,
    /// Its vertices in the patch. What follows is of each of them, unless it says otherwise.
    pub(super) range: Range<usize>,
    /// Nearest vertices of the body, among the parts it belongs to and among the others.
    pub(super) nearest: Vec<[u32; 2]>,
    /// Room to the nearest skin of both kinds of parts that is left before it must be looked for again, metres.
    pub(super) clear: Vec<[f32; 2]>,
    /// Nearest vertices of the garments further out, first by garment.
    pub(super) layers: Vec<Vec<u32>>,
    /// It passes through other cloth: no fold may hold it where it is.
    pub(super) passing: Vec<bool>,
    /// It had no other fold near it in the last round.
    pub(super) alone: Vec<bool>,
    /// Nothing holds it: in skin that lies in other skin, or about to tear.
    pub(super) free: Vec<bool>,
    /// For each vertex of the garment the last one that it was a neighbour of.
    pub(super) neighbour_of: Vec<u32>,
    /// Planes of the body and of cloth.
    pub(super) body: Vec<ContactPlane>,
    pub(super) cloth: Vec<ContactPlane>,
    /// Vertices that were lifted out of the skin, and how far they have moved since the call began, metres.
    pub(super) lifted: Vec<(u32, V4)>,
    pub(super) report: StepReport,
}

impl Piece {
    pub(super) fn model<'a>(&self, model: &'a Model) -> (&'a GarmentModel, &'a PatchModel) {
        let g = &model.garments[self.garment];
        (g, &g.patches[self.patch])
    }
    /// Its vertices that the patch owns, which are the first ones of a patch: their numbers here and in the patch.
    pub(super) fn owned(&self, f: &PatchModel) -> impl Iterator<Item = (usize, usize)> + use<> {
        (self.range.start..self.range.end.min(f.owned)).enumerate()
    }
    fn begin(&mut self, vertices: &[u32], from: &GarmentState) {
        let all = || vertices.iter().map(|v| *v as usize);
        self.nearest.clear();
        self.nearest.extend(all().map(|v| from.nearest[v]));
        self.layers.resize_with(from.layers.len(), Vec::new);
        for (to, from) in self.layers.iter_mut().zip(&from.layers) {
            to.clear();
            to.extend(all().filter_map(|v| from.get(v)));
        }
        self.passing.clear();
        self.passing.extend(
            vertices
                .iter()
                .map(|v| from.passing.binary_search(v).is_ok()),
        );
        for flags in [&mut self.alone, &mut self.free] {
            flags.clear();
            flags.resize(vertices.len(), false);
        }
        self.clear.clear();
        self.clear.resize(vertices.len(), [0.0; 2]);
        self.neighbour_of.clear();
        self.neighbour_of.resize(from.positions.len(), u32::MAX);
        self.report = StepReport::default();
    }
}

/// So many vertices in pieces.
fn ranges(n: usize) -> impl Iterator<Item = Range<usize>> {
    (0..n)
        .step_by(VERTICES)
        .map(move |first| first..(first + VERTICES).min(n))
}

/// Cuts the patches of all garments into pieces, where they are at the beginning of a call.
pub(super) fn cut(model: &Model, state: &State, pieces: &mut Vec<Piece>) {
    let (mut count, mut at) = (0, 0);
    for (garment, g) in model.garments.iter().enumerate() {
        for (patch, f) in g.patches.iter().enumerate() {
            for range in ranges(f.vertices.len()) {
                if pieces.len() == count {
                    pieces.push(Piece::default());
                }
                let q = &mut pieces[count];
                (q.garment, q.patch, q.at, q.range) = (garment, patch, at, range);
                count += 1;
            }
            at += 1;
        }
    }
    pieces.truncate(count);
    crate::par::for_chunks(model.config.par, pieces, 1, |_, q| {
        let q = &mut q[0];
        let (_, f) = q.model(model);
        q.begin(&f.vertices[q.range.clone()], &state.garments[q.garment]);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_hold_every_vertex_once_and_in_order() {
        for n in [
            0,
            1,
            VERTICES - 1,
            VERTICES,
            VERTICES + 1,
            10 * VERTICES + 7,
        ] {
            assert!(ranges(n).flatten().eq(0..n), "{n}");
            assert!(ranges(n).all(|r| r.len() <= VERTICES));
        }
    }
}
