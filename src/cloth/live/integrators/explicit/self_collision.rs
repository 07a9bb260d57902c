//! Contact of a sheet with itself in the explicit solver.

use crate::contact::SurfaceModel;
use crate::live::ClothError;
use crate::live::contact::self_contact::{Search, SelfContactFrame, SelfContactModel};
use crate::live::integrators::{RunConfig, SheetStart};
use crate::live::solver::explicit::ContactPlane;
use crate::live::solver::explicit::PatchModel;
use crate::live::solver::explicit::V4;
use nalgebra::Matrix3;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Topology, TriMesh};
use tryon_geometry::par::Par;

/// Planes between the vertices of one patch and other folds.
#[derive(Debug, Default)]
pub(super) struct FoldContacts {
    pub(super) planes: Vec<ContactPlane>,
    /// Distance that other folds may approach each vertex before the next query (m).
    clearance: Vec<f32>,
    neighbour_of: Vec<u32>,
    /// Owned vertices within the thickness of another fold.
    pub(super) touching: usize,
    /// Queries skipped since the start.
    pub(super) skipped: usize,
}

/// SubstepSchedule and model of self-contact queries.
pub(super) struct SelfCollision {
    model: SelfContactModel,
    frame: SelfContactFrame,
    search: Search,
    thickness: f32,
    /// Speed of each vertex relative to the rigid motion of the sheet (m/s), and a bound for its neighbours'.
    speeds: Vec<f32>,
    max_speed: f32,
    span: f32,
    /// Planes of the last query.
    pub(super) planes: usize,
    /// Substeps between two contact queries, their length (s), and most contact queries between two fold queries.
    interval: usize,
    h: f32,
    max_intervals: usize,
}

impl SelfCollision {
    /// Self-collision that queries folds at multiples of `interval` substeps of `h` seconds.
    pub(super) fn new(
        start: SheetStart<'_>,
        config: &RunConfig,
        interval: usize,
        h: f64,
    ) -> Result<Self, ClothError> {
        let mesh = TriMesh::new(start.positions.to_vec(), start.faces.to_vec())?;
        let parts = vec![1; start.positions.len()];
        let surface = SurfaceModel::new(start.faces.to_vec(), Topology::new(&mesh)?, parts);
        let model = SelfContactModel::new(surface, start.sheet.edges.iter().map(|e| e.1 as f32));
        let thickness = config.thickness as f32;
        Ok(Self {
            search: model.search_all(thickness, 0.0),
            model,
            frame: SelfContactFrame::default(),
            thickness,
            speeds: Vec::new(),
            max_speed: 0.0,
            span: 0.0,
            planes: 0,
            interval,
            h: h as f32,
            max_intervals: ((config.fold_search / (interval as f64 * h)) as usize).max(1),
        })
    }
    /// Updates the sheet. Returns the substeps until the next query: none approach by more than their thickness before, if
    /// that can be.
    pub(super) fn update(&mut self, par: Par, x: &[V4], velocity: &[V4]) -> usize {
        let frame = &mut self.frame;
        frame.surface.vertices.clear();
        frame.surface.vertices.extend(x.iter().map(|p| p.point()));
        frame.velocities.clear();
        frame
            .velocities
            .extend(velocity.iter().map(|v| v.point().coords));
        let turn = relative_speeds(&frame.surface.vertices, &frame.velocities, &mut self.speeds);
        self.max_speed = self.speeds.iter().copied().fold(0.0, f32::max);
        let interval = self.interval as f32 * self.h;
        let intervals = (self.thickness / (2.0 * self.max_speed * interval)) as usize;
        let intervals = intervals.clamp(1, self.max_intervals);
        self.span = intervals as f32 * interval;
        self.search = self
            .model
            .search_all(self.thickness, 2.0 * self.max_speed * self.span);
        self.max_speed += turn * self.search.corner;
        self.model
            .begin(par, frame, Some(&self.search), self.planes);
        intervals * self.interval
    }
    /// Finds planes between the vertices of a patch and other folds; pinned vertices (local number, position) have none.
    pub(super) fn find(
        &self,
        f: &PatchModel,
        pinned: &[(u32, tryon_geometry::math::V3d)],
        out: &mut FoldContacts,
    ) {
        out.planes.clear();
        out.touching = 0;
        out.clearance.resize(f.vertices.len(), 0.0);
        out.neighbour_of
            .resize(self.frame.surface.vertices.len(), u32::MAX);
        for (i, _) in pinned {
            out.clearance[*i as usize] = f32::INFINITY;
        }
        for (i, &v) in f.vertices.iter().enumerate() {
            let approach = (self.speeds[v as usize] + self.max_speed) * self.span;
            if out.clearance[i] > approach {
                out.clearance[i] -= approach;
                out.skipped += 1;
                continue;
            }
            let x: P3 = self.frame.surface.vertices[v as usize];
            let corner =
                self.model
                    .candidate(&self.frame, v, &x, &self.search, &mut out.neighbour_of);
            out.clearance[i] = SelfContactModel::clearance(&self.search, corner);
            let Some((corner, _)) = corner.filter(|_| out.clearance[i] < 0.0) else {
                continue;
            };
            let hit = self.model.other_fold(&self.frame, v, &x, corner);
            let plane = hit.and_then(|hit| self.model.plane(&self.frame, i, v, &hit, &self.search));
            if let Some((plane, distance)) = plane {
                out.planes.push(plane);
                out.touching += usize::from(i < f.owned && distance <= self.search.thickness);
            }
        }
    }
}

/// Fills `speeds` with the vertices' speeds relative to the nearest rigid motion of the sheet (m/s); returns the angular
/// speed of that (rad/s). Rigid motion brings no folds together.
fn relative_speeds(x: &[P3], v: &[V3], speeds: &mut Vec<f32>) -> f32 {
    let n = x.len().max(1) as f32;
    let centre = x.iter().fold(V3::zeros(), |a, p| a + p.coords) / n;
    let mean = v.iter().fold(V3::zeros(), |a, v| a + v) / n;
    let (mut inertia, mut momentum) = (Matrix3::zeros(), V3::zeros());
    for (x, v) in x.iter().zip(v) {
        let r = x.coords - centre;
        inertia += Matrix3::identity() * r.norm_squared() - r * r.transpose();
        momentum += r.cross(&(v - mean));
    }
    let turn = inertia.try_inverse().map_or(V3::zeros(), |i| i * momentum);
    let turn = if turn.iter().all(|c| c.is_finite()) {
        turn
    } else {
        V3::zeros()
    };
    let relative = |(x, v): (&P3, &V3)| (v - mean - turn.cross(&(x.coords - centre))).norm();
    speeds.clear();
    speeds.extend(x.iter().zip(v).map(relative));
    turn.norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rigid_motion_has_no_relative_speed() {
        let x = [
            [0.1, 0.0, 0.3],
            [0.5, 0.2, 0.0],
            [0.0, 0.7, 0.1],
            [0.2, 0.1, 0.9],
        ]
        .map(P3::from);
        let (turn, shift) = (V3::new(0.3, -2.0, 1.0), V3::new(4.0, 0.0, -1.0));
        let v = x.map(|p| shift + turn.cross(&p.coords));
        let mut speeds = Vec::new();
        let rate = relative_speeds(&x, &v, &mut speeds);
        assert!((rate - turn.norm()).abs() < 1e-4, "{rate}");
        assert!(speeds.iter().all(|s| *s < 1e-5), "{speeds:?}");
        let rate = relative_speeds(&x[..1], &v[..1], &mut speeds);
        assert_eq!((rate, speeds[0]), (0.0, 0.0), "one point does not turn");
    }
}
