//! Scratch of one patch of one garment during a step.

use super::outfit_model::Model;
use super::solver::explicit::{ContactPlane, PatchState, Pin, V4, VertexPlanes};
use super::state::State;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::par;

/// Motion, constraints and flags of a patch; vectors have one entry a vertex unless said otherwise.
#[derive(Debug, Default)]
pub(super) struct PatchWork {
    pub(super) motion: PatchState,
    pub(super) asleep: Vec<bool>,
    /// Taut: exempt from speed limits.
    pub(super) taut: Vec<bool>,
    /// Stretched beyond the ratio at which contact constraints are released.
    pub(super) overstretched: Vec<bool>,
    /// Position is prescribed, by an anchor or by sleep.
    pub(super) pinned: Vec<bool>,
    /// Anchors of the current interval.
    pub(super) pins: Vec<Pin>,
    /// Contact planes of cloth in the current block.
    pub(super) cloth_planes: Vec<ContactPlane>,
    /// Contact planes within reach for some substeps.
    pub(super) planes: VertexPlanes,
    /// Vertices in contact with the body.
    pub(super) contacts: usize,
}

impl AsMut<PatchState> for PatchWork {
    fn as_mut(&mut self) -> &mut PatchState {
        &mut self.motion
    }
}

impl PatchWork {
    /// Position of vertex `i` of the patch, metres.
    pub(super) fn position(&self, i: usize) -> P3 {
        self.motion.position(i).point()
    }
    /// Velocity of vertex `i` of the patch, m/s.
    pub(super) fn velocity(&self, i: usize) -> V3 {
        let v = self.motion.velocity[i].0;
        V3::new(v[0], v[1], v[2])
    }
    /// Position `to` for vertex `i`, moved back where it passes contact planes of cloth farther than the vertex does now,
    /// `t` seconds after their query; metres.
    pub(super) fn held_by_cloth(&self, i: usize, mut to: V4, t: f32) -> V4 {
        /// Passes over planes that meet at an angle.
        const PASSES: usize = 2;
        let at = self.motion.position(i);
        let first = self
            .cloth_planes
            .partition_point(|p| (p.vertex as usize) < i);
        let own = |p: &&ContactPlane| p.vertex as usize == i;
        for _ in 0..PASSES {
            for p in self.cloth_planes[first..].iter().take_while(own) {
                let lacking = p.gap(at, t).min(0.0) - p.gap(to, t);
                to = to + p.normal.scale(lacking.max(0.0));
            }
        }
        to
    }
}

/// Four-lane copy of a vector.
pub(super) fn v4(v: &V3) -> V4 {
    V4::new(v.x, v.y, v.z)
}

/// Calls `f(garment, patch, work)` for every patch, in parallel when allowed.
pub(super) fn for_patches(
    model: &Model,
    all: &mut [PatchWork],
    f: impl Fn(usize, usize, &mut PatchWork) + Sync,
) {
    let patches = |(g, m): (usize, &super::garment_model::GarmentModel)| {
        (0..m.patches.len()).map(move |k| (g, k))
    };
    let index: Vec<(usize, usize)> = model
        .garments
        .iter()
        .enumerate()
        .flat_map(patches)
        .collect();
    par::for_chunks(model.config.par, all, 1, |i, p| {
        f(index[i].0, index[i].1, &mut p[0])
    });
}

/// Copies positions, velocities and sleep of the state into the patches.
pub(super) fn begin(model: &Model, state: &State, all: &mut Vec<PatchWork>) {
    let count = model.garments.iter().map(|g| g.patches.len()).sum();
    all.resize_with(count, PatchWork::default);
    for_patches(model, all, |g, k, p| {
        let (from, patch) = (&state.garments[g], &model.garments[g].patches[k]);
        let local = || patch.vertices.iter().map(|v| *v as usize);
        p.motion.reset(
            local().map(|v| v4(&from.positions[v].coords)),
            local().map(|v| v4(&from.velocities[v])),
        );
        p.asleep.clear();
        let sleeps = |v: &u32| state.sleep.is_asleep(&model.garments[g].islands, g, *v);
        p.asleep.extend(patch.vertices.iter().map(sleeps));
        p.motion.set_sleeping(patch, &p.asleep);
    });
}
