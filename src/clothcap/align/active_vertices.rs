//! Vertices that an iteration solves: those that moved in the last one, their neighbours, and of both what points show.

use super::quadratic::QuadraticEnergy;
use crate::CaptureError;
use crate::settings::SurfaceFitSettings;
use serde::{Deserialize, Serialize};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Csr;

/// Counts of vertices over the iterations of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct VertexCounts {
    /// Solved.
    pub solved: usize,
    /// Held: neither they nor their neighbours moved in the iteration before.
    pub settled: usize,
    /// Held until the last iteration: no scan point is near.
    pub unseen: usize,
}

impl std::ops::AddAssign for VertexCounts {
    fn add_assign(&mut self, other: Self) {
        self.solved += other.solved;
        self.settled += other.settled;
        self.unseen += other.unseen;
    }
}

/// State of each vertex of a fit.
#[derive(Debug)]
pub(crate) struct ActiveVertices<'a> {
    neighbours: &'a Csr,
    settings: &'a SurfaceFitSettings,
    is_active: Vec<bool>,
    /// Scan points pull at it.
    is_seen: Vec<bool>,
    /// Active, but unseen and held.
    is_waiting: Vec<bool>,
    counts: VertexCounts,
}

impl<'a> ActiveVertices<'a> {
    /// All vertices active; `neighbours` are those along the edges.
    pub(crate) fn new(neighbours: &'a Csr, settings: &'a SurfaceFitSettings) -> Self {
        let n = neighbours.rows();
        Self {
            neighbours,
            settings,
            is_active: vec![true; n],
            is_seen: vec![false; n],
            is_waiting: vec![false; n],
            counts: VertexCounts::default(),
        }
    }

    /// Takes the vertices that are pulled at in this iteration.
    pub(crate) fn see(&mut self, pulled: impl Iterator<Item = u32>) {
        self.is_seen.fill(false);
        pulled.for_each(|v| self.is_seen[v as usize] = true);
    }

    /// Moves the active vertices to the positions of least energy, metres; the mean motion of all.
    pub(crate) fn solve(
        &mut self,
        energy: &mut QuadraticEnergy,
        x: &mut Vec<P3>,
        stage: &'static str,
    ) -> Result<f32, CaptureError> {
        let n = self.is_active.len();
        let some: Vec<u32> = (0..n as u32).filter(|v| self.is_solved(*v)).collect();
        let before = x.clone();
        if self.solves_all(some.len()) {
            *x = energy.minimise(stage)?;
            self.is_waiting.fill(false);
            self.counts.solved += n;
        } else {
            energy.minimise_some(x, &some, self.settings.stop(), stage)?;
            self.count(&some);
        }
        let motions: Vec<f32> = x.iter().zip(&before).map(|(a, b)| (a - b).norm()).collect();
        let moves = |v: usize| motions[v] > self.settings.still;
        let rows =
            (0..n).map(|v| moves(v) || self.neighbours.row(v).iter().any(|w| moves(*w as usize)));
        self.is_active = rows.collect();
        Ok(motions.iter().sum::<f32>() / n.max(1) as f32)
    }

    /// Solves the unseen vertices that were held, after the last iteration.
    pub(crate) fn finish(
        &mut self,
        energy: &mut QuadraticEnergy,
        x: &mut Vec<P3>,
        stage: &'static str,
    ) -> Result<(), CaptureError> {
        let n = self.is_waiting.len();
        let some = (0..n as u32).filter(|v| self.is_waiting[*v as usize]);
        let some: Vec<u32> = some.collect();
        if some.is_empty() {
            return Ok(());
        }
        self.is_waiting.fill(false);
        if self.solves_all(some.len()) {
            self.counts.solved += n;
            *x = energy.minimise(stage)?;
            return Ok(());
        }
        self.counts.solved += some.len();
        energy.minimise_some(x, &some, self.settings.stop(), stage)
    }

    pub(crate) fn counts(&self) -> VertexCounts {
        self.counts
    }

    fn solves_all(&self, some: usize) -> bool {
        let most = self.settings.most_apart * self.is_active.len() as f64;
        self.settings.still <= 0.0 || some as f64 > most
    }

    fn is_solved(&self, v: u32) -> bool {
        let near = self.neighbours.row(v as usize).iter().chain([&v]);
        self.is_active[v as usize] && near.into_iter().any(|w| self.is_seen[*w as usize])
    }

    fn count(&mut self, some: &[u32]) {
        self.counts.solved += some.len();
        for v in 0..self.is_active.len() {
            let is_waiting = self.is_active[v] && !self.is_solved(v as u32);
            self.counts.unseen += usize::from(is_waiting);
            self.counts.settled += usize::from(!self.is_active[v]);
            self.is_waiting[v] |= is_waiting;
        }
    }
}
