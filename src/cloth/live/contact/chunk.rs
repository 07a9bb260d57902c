//! Chunks of patches in which contacts are generated, one thread each.
//!
//! Patches are few, and one meets more skin and folds than another: with one thread a patch, threads would idle.

use crate::live::garment_model::GarmentModel;
use crate::live::outfit_model::Model;
use crate::live::report::StepReport;
use crate::live::solver::explicit::{ContactPlane, PatchModel, V4};
use crate::live::state::{GarmentState, State};
use std::ops::Range;

/// Vertices of a chunk. Larger: threads end less evenly; smaller: a chunk reads more around it. 256 to 1024 are within 3 %.
const VERTICES: usize = 512;

/// Counts of one chunk in a step.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::live) struct ContactCounts {
    pub(super) pinched: usize,
    pub(super) searches_skipped: usize,
    /// Deepest vertex below the skin before and after projection, metres.
    pub(super) penetration: f64,
    pub(super) penetration_left: f64,
}

impl ContactCounts {
    pub(in crate::live) fn add_to(&self, r: &mut StepReport) {
        r.pinched += self.pinched;
        r.searches_skipped += self.searches_skipped;
        r.penetration = r.penetration.max(self.penetration);
        r.penetration_left = r.penetration_left.max(self.penetration_left);
    }
}

/// Vertices of a patch and their contacts; vectors have one entry a vertex unless said otherwise.
#[derive(Debug, Default)]
pub(in crate::live) struct ContactChunk {
    pub(in crate::live) garment: usize,
    /// Patch among those of the garment.
    pub(in crate::live) patch: usize,
    /// Patch among all.
    pub(in crate::live) at: usize,
    /// Vertices in the patch.
    pub(in crate::live) range: Range<usize>,
    /// Nearest body vertices, among its own parts and among the others.
    pub(in crate::live) nearest: Vec<[u32; 2]>,
    /// Motion left until the next query of both kinds of parts, metres.
    pub(super) clearance: Vec<[f32; 2]>,
    /// Contact planes of the body.
    pub(in crate::live) body_planes: Vec<ContactPlane>,
    /// Vertices projected out of the skin, and their displacements since the step began, metres.
    pub(in crate::live) projected: Vec<(u32, V4)>,
    pub(in crate::live) report: ContactCounts,
}

impl ContactChunk {
    pub(super) fn model<'a>(&self, model: &'a Model) -> (&'a GarmentModel, &'a PatchModel) {
        let g = &model.garments[self.garment];
        (g, &g.patches[self.patch])
    }
    /// Vertices that the patch owns, its first ones: indices in the chunk and in the patch.
    pub(in crate::live) fn owned(
        &self,
        f: &PatchModel,
    ) -> impl Iterator<Item = (usize, usize)> + use<> {
        (self.range.start..self.range.end.min(f.owned)).enumerate()
    }
    fn begin(&mut self, vertices: &[u32], from: &GarmentState) {
        let all = || vertices.iter().map(|v| *v as usize);
        self.nearest.clear();
        self.nearest.extend(all().map(|v| from.nearest[v]));
        self.clearance.clear();
        self.clearance.resize(vertices.len(), [0.0; 2]);
        self.report = ContactCounts::default();
    }
}

/// Ranges of `n` vertices in chunks.
fn ranges(n: usize) -> impl Iterator<Item = Range<usize>> {
    (0..n)
        .step_by(VERTICES)
        .map(move |first| first..(first + VERTICES).min(n))
}

/// Splits the patches of all garments into chunks at the beginning of a step.
pub(in crate::live) fn split(model: &Model, state: &State, chunks: &mut Vec<ContactChunk>) {
    let (mut count, mut at) = (0, 0);
    for (garment, g) in model.garments.iter().enumerate() {
        for (patch, f) in g.patches.iter().enumerate() {
            for range in ranges(f.vertices.len()) {
                if chunks.len() == count {
                    chunks.push(ContactChunk::default());
                }
                let c = &mut chunks[count];
                (c.garment, c.patch, c.at, c.range) = (garment, patch, at, range);
                count += 1;
            }
            at += 1;
        }
    }
    chunks.truncate(count);
    tryon_geometry::par::for_chunks(model.config.par, chunks, 1, |_, c| {
        let c = &mut c[0];
        let (_, f) = c.model(model);
        c.begin(&f.vertices[c.range.clone()], &state.garments[c.garment]);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_hold_every_vertex_once_and_in_order() {
        let around = [VERTICES - 1, VERTICES, VERTICES + 1];
        for n in [0, 1, 10 * VERTICES + 7].into_iter().chain(around) {
            assert!(ranges(n).flatten().eq(0..n), "{n}");
            assert!(ranges(n).all(|r| r.len() <= VERTICES));
        }
    }
}
