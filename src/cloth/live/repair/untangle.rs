//! Untangles worn garments now and then.
//!
//! Contact keeps cloth on its side, also where that is the wrong one. So an outfit is queried as a whole from time to time,
//! and in every step while it intersects itself; intersecting cloth moves apart a little.

use super::untangler::Untangler;
use crate::contact::SurfaceFrame;
use crate::live::outfit_model::Model;
use crate::live::state::{GarmentState, State};
use crate::settings::{ClothRepairSettings, Config};
use tryon_garment::joined_faces;
use tryon_geometry::math::{P3, V3d};

/// Iterations of a query.
const ITERATIONS: usize = 8;

/// Scratch of untangling; vertices of all garments are numbered through.
#[derive(Debug, Default)]
pub(in crate::live) struct UntangleWork {
    outfit: Option<Untangler>,
    /// Positions before a query and after, metres.
    from: Vec<V3d>,
    x: Vec<V3d>,
    /// Inverse masses, 1/kg; 0 of vertices that must not move.
    weights: Vec<f64>,
}

impl UntangleWork {
    /// Untangles an outfit that is due in a step of `dt` seconds and does not sleep as a whole, outside `body`.
    /// Returns the intersections found.
    pub(in crate::live) fn untangle_due(
        &mut self,
        model: &Model,
        state: &mut State,
        body: &SurfaceFrame,
        dt: f64,
    ) -> usize {
        let Config {
            untangle,
            sleep,
            repair,
            ..
        } = model.config;
        if untangle <= 0.0 || sleep && state.sleep.still_time > repair.max_still_time {
            return 0;
        }
        let every = (untangle / dt).round().max(1.0) as u64;
        // Intersecting cloth has no contact: it moves apart in every step, or more of it would follow.
        let intersects = state.garments.iter().any(|g| !g.intersecting.is_empty());
        let is_due = state.frames.is_multiple_of(every) || intersects;
        if !is_due || !self.load(model, state) {
            return 0;
        }
        self.untangle(model, state, body)
    }

    /// Loads an outfit; `false` if none of it may move.
    fn load(&mut self, model: &Model, state: &State) -> bool {
        self.weights.clear();
        self.x.clear();
        for (k, (g, m)) in state.garments.iter().zip(&model.garments).enumerate() {
            let first = self.weights.len();
            self.x
                .extend(g.positions.iter().map(|p| p.coords.cast::<f64>()));
            let weight = |(v, mass): (u32, &f64)| {
                let sleeps = state.sleep.is_asleep(&m.islands, k, v);
                if sleeps { 0.0 } else { 1.0 / mass }
            };
            self.weights.extend((0u32..).zip(&m.sheet.mass).map(weight));
            let anchors = model.outfit.anchors[k].iter();
            anchors
                .filter(|a| a.strength >= 1.0)
                .for_each(|a| self.weights[first + a.vertex as usize] = 0.0);
        }
        self.from.clone_from(&self.x);
        self.weights.iter().any(|w| *w > 0.0)
    }

    /// Moves what intersects apart; returns the intersections found at first.
    fn untangle(&mut self, model: &Model, state: &mut State, body: &SurfaceFrame) -> usize {
        let settings = model.config.repair.untangler;
        let x = &mut self.x;
        let faces = || joined_faces(&model.outfit.garments);
        let outfit = (self.outfit).get_or_insert_with(|| Untangler::new(&faces(), x, settings));
        outfit.invalidate();
        let mut found = 0;
        for r in 0..ITERATIONS {
            let report = outfit.iterate(model.config.par, x, |v| self.weights[v]);
            if r == 0 {
                found = report.intersections;
            }
            if report.intersections == 0 {
                break;
            }
        }
        let limits = &model.config.repair;
        let mut first = 0;
        for g in &mut state.garments {
            g.intersecting.clear();
            for v in 0..g.positions.len() {
                let (from, to) = (&self.from[first + v], &x[first + v]);
                if from == to {
                    continue;
                }
                let displacement = (to - from).cap_magnitude(limits.max_displacement);
                g.displace(v, from, displacement, body, limits);
                // A capped displacement leaves the vertex on the wrong side.
                if outfit.displacements[first + v].1 > 0.0 || displacement != to - from {
                    g.intersecting.push(v as u32);
                }
            }
            first += g.positions.len();
        }
        found
    }
}

impl GarmentState {
    /// Displaces a vertex from a position, metres, but not into the skin.
    fn displace(
        &mut self,
        v: usize,
        from: &V3d,
        displacement: V3d,
        body: &SurfaceFrame,
        limits: &ClothRepairSettings,
    ) {
        let outside = outside_skin(from, displacement, self.nearest[v], body, limits);
        self.positions[v] = P3::from((from + outside).cast::<f32>());
    }
}

/// Displacement of `x` without the part that leads into the skin at its two nearest body vertices.
fn outside_skin(
    x: &V3d,
    mut displacement: V3d,
    nearest: [u32; 2],
    body: &SurfaceFrame,
    limits: &ClothRepairSettings,
) -> V3d {
    for v in nearest {
        let (Some(at), Some(normal)) =
            (body.vertices.get(v as usize), body.normals.get(v as usize))
        else {
            continue;
        };
        let (normal, height) = (
            normal.cast::<f64>(),
            (x - at.coords.cast::<f64>()).dot(&normal.cast()),
        );
        let lowest = limits.min_height.min(height);
        let below = lowest - (height + displacement.dot(&normal));
        if height < limits.near_skin && below > 0.0 {
            displacement += normal * below;
        }
    }
    displacement
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_geometry::math::V3;

    #[test]
    fn displacement_stops_above_the_skin_and_distant_or_unknown_skin_leaves_it() {
        let body = SurfaceFrame {
            vertices: vec![P3::origin()],
            normals: vec![V3::y()],
        };
        let limits = &ClothRepairSettings::default();
        let down = V3d::new(0.002, -0.01, 0.0);
        let near = V3d::new(0.0, 0.003, 0.0);
        let left = near + outside_skin(&near, down, [0, 7], &body, limits);
        assert!((left - V3d::new(0.002, limits.min_height, 0.0)).norm() < 1e-12);
        assert_eq!(
            outside_skin(&(near * 10.0), down, [0, 7], &body, limits),
            down
        );
        assert_eq!(outside_skin(&near, down, [7, 8], &body, limits), down);
    }
}
