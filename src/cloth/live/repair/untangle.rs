//! Untangles worn garments now and then, and smooths cloth that stays intersected.
//!
//! Contact keeps cloth on its side, also where that is the wrong one. So each garment is queried as a whole from time to
//! time, and in every step while it intersects itself; intersecting cloth moves apart a little. Where that does not help for
//! some queries, it is smoothed locally.

use super::untangler::Untangler;
use crate::contact::SurfaceFrame;
use crate::live::outfit_model::Model;
use crate::live::state::{GarmentState, State};
use crate::settings::{ClothRepairSettings, Config};
use tryon_garment::Region;
use tryon_geometry::math::{P3, V3d};

/// Iterations of a query.
const ITERATIONS: usize = 8;
/// Intersection counter from which on a vertex is smoothed, and its largest value: four more queries after it is free.
const STUCK: u8 = 3;
const MAX_COUNT: u8 = 6;
/// Rings around a stuck vertex that are smoothed.
const SMOOTHED_RINGS: usize = 2;

/// Scratch of untangling.
#[derive(Debug, Default)]
pub(in crate::live) struct UntangleWork {
    /// Of each garment.
    sheets: Vec<Untangler>,
    /// Positions of one garment before a query and after, metres.
    from: Vec<V3d>,
    x: Vec<V3d>,
    /// Vertices that must not move.
    fixed: Vec<bool>,
}

impl UntangleWork {
    /// Untangles the garments due in a step of `dt` seconds that do not all sleep, outside `body`.
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
        // In turn, so that the cost is spread over steps.
        let is_due = |k: usize| (state.frames + k as u64).is_multiple_of(every);
        let mut found = 0;
        for k in 0..model.garments.len() {
            // Intersecting cloth has no contact: it moves apart in every step, or more of it would follow.
            let intersects = !state.garments[k].intersecting.is_empty();
            if (is_due(k) || intersects) && self.load(model, state, k) {
                found += self.untangle(model, &mut state.garments[k], k, body);
                self.smooth_stuck(model, &mut state.garments[k], k, body);
            }
        }
        found
    }

    /// Loads a garment; `false` if none of it may move.
    fn load(&mut self, model: &Model, state: &State, k: usize) -> bool {
        let g = &state.garments[k];
        let islands = &model.garments[k].islands;
        let sleeps = |v: u32| state.sleep.is_asleep(islands, k, v);
        self.fixed.clear();
        self.fixed.extend((0..g.positions.len() as u32).map(sleeps));
        if self.fixed.iter().all(|f| *f) {
            return false;
        }
        let anchors = model.outfit.anchors[k].iter();
        anchors
            .filter(|a| a.strength >= 1.0)
            .for_each(|a| self.fixed[a.vertex as usize] = true);
        for k in self.sheets.len()..=k {
            let at = doubled(&state.garments[k].positions);
            let (faces, settings) = (
                &model.outfit.garments[k].faces,
                model.config.repair.untangler,
            );
            self.sheets.push(Untangler::new(faces, &at, settings));
        }
        self.x.clear();
        self.x.extend(doubled(&g.positions));
        self.from.clone_from(&self.x);
        true
    }

    /// Moves what intersects apart; returns the intersections found at first.
    fn untangle(
        &mut self,
        model: &Model,
        g: &mut GarmentState,
        k: usize,
        body: &SurfaceFrame,
    ) -> usize {
        let (mass, fixed) = (&model.garments[k].sheet.mass, &self.fixed);
        let weight = |v: usize| if fixed[v] { 0.0 } else { 1.0 / mass[v] };
        let sheet = &mut self.sheets[k];
        sheet.invalidate();
        g.intersection_count.resize(self.x.len(), 0);
        let mut found = 0;
        for r in 0..ITERATIONS {
            let report = sheet.iterate(model.config.par, &mut self.x, weight);
            if r == 0 {
                found = report.intersections;
                for (n, is_found) in g.intersection_count.iter_mut().zip(sheet.intersecting()) {
                    *n = if is_found {
                        (*n + 1).min(MAX_COUNT)
                    } else {
                        n.saturating_sub(1)
                    };
                }
            }
            if report.intersections == 0 {
                break;
            }
        }
        g.intersecting.clear();
        let limits = &model.config.repair;
        for (v, (from, to)) in moved(&self.from, &self.x) {
            let displacement = (to - from).cap_magnitude(limits.max_displacement);
            g.displace(v, from, displacement, body, limits);
            // A capped displacement leaves the vertex on the wrong side.
            if sheet.displacements[v].1 > 0.0 || displacement != to - from {
                g.intersecting.push(v as u32);
            }
        }
        found
    }

    /// Smooths around vertices that intersected in many queries.
    fn smooth_stuck(&mut self, model: &Model, g: &mut GarmentState, k: usize, body: &SurfaceFrame) {
        let stuck: Vec<bool> = g.intersection_count.iter().map(|n| *n >= STUCK).collect();
        if !stuck.contains(&true) {
            return;
        }
        self.from.clear();
        self.from.extend(doubled(&g.positions));
        self.x.clone_from(&self.from);
        // A smoothed sleeve leaves its cuff behind and turns inside out.
        let (own, fixed) = (&model.garments[k].own, &self.fixed);
        let movable = |v: usize| !fixed[v] && !Region(own[v]).meets(Region::ARMS);
        self.sheets[k].smooth_locally(&mut self.x, stuck, movable, SMOOTHED_RINGS);
        let limits = &model.config.repair;
        for (v, (from, to)) in moved(&self.from, &self.x) {
            let displacement = (to - from).cap_magnitude(limits.max_smoothing);
            g.displace(v, from, displacement, body, limits);
        }
    }
}

fn doubled(positions: &[P3]) -> Vec<V3d> {
    positions.iter().map(|p| p.coords.cast()).collect()
}

/// Vertices with different positions.
fn moved<'a>(from: &'a [V3d], to: &'a [V3d]) -> impl Iterator<Item = (usize, (&'a V3d, &'a V3d))> {
    let all = from.iter().zip(to).enumerate();
    all.filter(|(_, (from, to))| from != to)
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
