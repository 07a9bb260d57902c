//! Substeps of a drape.

use super::context::DrapeContext;
use super::state::Drape;
use tryon_cloth::solver::xpbd::{DistanceConstraint, project_hinge};
use tryon_geometry::math::V3d;

/// m/s².
const GRAVITY: f64 = 9.81;

impl Drape {
    /// Runs `steps` substeps of `h` seconds on a body and under garments that stand still. `weight` scales gravity: first
    /// gaps between panels close, then cloth falls.
    pub(crate) fn run(&mut self, context: &DrapeContext<'_>, steps: usize, h: f64, weight: f64) {
        let settings = self.settings;
        self.steps += steps;
        for s in 0..steps {
            let queries = s % settings.query_interval == 0;
            if queries {
                self.find_planes(context);
            }
            self.predict(h, weight);
            for sweep in 0..settings.sweeps {
                self.project_edges(h, (s + sweep) % 2 == 1);
            }
            self.project_hinges(h);
            self.resolve_hood(s % settings.hood_interval == 0, h);
            if self.fine && self.compressed {
                self.limit_displacement(settings.max_compressed_speed * h);
            }
            self.project_contacts(0.0);
            let follows = self.crossings > 0 && s % settings.untangle_interval == 0;
            if (weight >= 1.0 || self.hood.is_some()) && (queries || follows) {
                self.untangle(queries);
            }
            self.update_velocities(h);
        }
    }
    /// Positions under inertia and gravity; pinned vertices go to their targets.
    fn predict(&mut self, h: f64, weight: f64) {
        let keep = (-self.settings.damping * h).exp();
        let fall = V3d::new(0.0, -GRAVITY * weight * h * h, 0.0);
        self.before.clone_from(&self.x);
        for i in 0..self.x.len() {
            match self.pinned[i] {
                Some(p) => self.x[i] = p,
                None => self.x[i] += self.velocity[i] * (h * keep) + fall,
            }
        }
    }
    /// Velocities of the substep, limited to the largest speed.
    fn update_velocities(&mut self, h: f64) {
        let most = self.settings.max_speed;
        for i in 0..self.x.len() {
            let v = (self.x[i] - self.before[i]) / h;
            let speed = v.norm();
            self.velocity[i] = if speed > most { v * (most / speed) } else { v };
        }
    }
    /// Projects edges to their lengths; alternating directions favour no side.
    pub(super) fn project_edges(&mut self, h: f64, backwards: bool) {
        let n = self.edges.len();
        for k in 0..n {
            let e = self.edges[if backwards { n - 1 - k } else { k }];
            let w = e.ends.map(|v| self.weight(v));
            let edge = DistanceConstraint {
                ends: e.ends,
                length: e.rest,
                least: 0.0,
                compliance: e.compliance / (h * h),
            };
            edge.project(&mut self.x, w);
        }
    }
    fn project_hinges(&mut self, h: f64) {
        for k in 0..self.hinges.len() {
            let hinge = self.hinges[k];
            let w = hinge.v.map(|i| self.weight(i));
            project_hinge(&mut self.x, &hinge, w, 1.0 / hinge.w / (h * h));
        }
    }
    /// Contact of a hood with itself; `queries` searches for new contacts.
    fn resolve_hood(&mut self, queries: bool, h: f64) {
        let Some(hood) = &mut self.hood else { return };
        if queries {
            let moved = self
                .untangler
                .as_ref()
                .map_or(&[][..], |u| &u.displacements[..]);
            let crossing = |v: u32| moved.get(v as usize).is_some_and(|p| p.1 > 0.0);
            hood.find_contacts(&self.x, crossing);
        }
        let (pinned, inverse) = (&self.pinned, &self.inverse_mass);
        let weight = |v: u32| match pinned[v as usize] {
            Some(_) => 0.0,
            None => inverse[v as usize],
        };
        hood.resolve(&mut self.x, &self.before, weight, h);
    }
    /// Limits the motion of each vertex in this substep (m).
    fn limit_displacement(&mut self, most: f64) {
        for (x, before) in self.x.iter_mut().zip(&self.before) {
            *x = before + (*x - before).cap_magnitude(most);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::state::EdgeConstraint;
    use super::*;

    /// A vertical chain of unit masses, 10 cm apart, whose first is pinned if asked for.
    fn chain(n: u32, pinned: bool) -> Drape {
        let x: Vec<V3d> = (0..n)
            .map(|i| V3d::new(0.0, -0.1 * f64::from(i), 0.0))
            .collect();
        let edge = |i: u32| EdgeConstraint {
            ends: [i, i + 1],
            rest: 0.1,
            compliance: 1e-4,
        };
        Drape {
            velocity: vec![V3d::zeros(); x.len()],
            inverse_mass: vec![1.0; x.len()],
            edges: (0..n.saturating_sub(1)).map(edge).collect(),
            pinned: x
                .iter()
                .enumerate()
                .map(|(i, p)| (pinned && i == 0).then_some(*p))
                .collect(),
            x,
            ..Drape::default()
        }
    }

    #[test]
    fn free_fall_has_its_closed_form() {
        const H: f64 = 2e-3;
        const STEPS: i32 = 50;
        let mut drape = chain(3, false);
        let start = drape.x.clone();
        for _ in 0..STEPS {
            drape.predict(H, 1.0);
            drape.project_edges(H, false);
            drape.update_velocities(H);
        }
        // vₖ = g h (1 + q + … + qᵏ⁻¹) with q = exp(−damping h).
        let q = (-drape.settings.damping * H).exp();
        let speed = |k: i32| GRAVITY * H * (1.0 - q.powi(k)) / (1.0 - q);
        let fall: f64 = (1..=STEPS).map(|k| H * speed(k)).sum();
        for (x, start) in drape.x.iter().zip(&start) {
            assert!((start.y - x.y - fall).abs() < 1e-9, "{x} {fall}");
        }
    }

    #[test]
    fn hanging_chain_stretches_by_its_compliance() {
        const H: f64 = 2e-3;
        let mut drape = chain(2, true);
        for s in 0..2000 {
            drape.predict(H, 1.0);
            for sweep in 0..drape.settings.sweeps {
                drape.project_edges(H, (s + sweep) % 2 == 1);
            }
            drape.update_velocities(H);
        }
        assert_eq!(drape.x[0], V3d::zeros(), "pinned");
        // m g c, the mass being one; each further sweep stiffens the edge.
        let stretch = -drape.x[1].y - 0.1;
        assert!(stretch > 0.0 && stretch < GRAVITY * 1e-4, "{stretch}");
    }

    #[test]
    fn velocities_and_displacements_are_limited() {
        let mut drape = chain(1, false);
        drape.before = vec![V3d::new(1.0, 0.0, 0.0)];
        drape.update_velocities(1e-3);
        assert!((drape.velocity[0].norm() - drape.settings.max_speed).abs() < 1e-12);
        drape.limit_displacement(0.25);
        assert_eq!(drape.x[0], V3d::new(0.75, 0.0, 0.0));
    }
}
