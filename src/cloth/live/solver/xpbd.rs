//! Projections of compliant constraints (Macklin et al. 2016, eq. 18). λ starts at zero in each substep.

use crate::live::Hinge;
use tryon_geometry::math::V3d;

/// Distance constraint of an edge.
#[derive(Clone, Copy, Debug)]
pub struct DistanceConstraint {
    /// Vertices.
    pub ends: [u32; 2],
    /// Wanted length (m).
    pub length: f64,
    /// Length up to which the edge is slack (m).
    pub least: f64,
    /// Compliance over the square of the step (1/kg).
    pub compliance: f64,
}

impl DistanceConstraint {
    /// Brings the edge towards its length, if it is longer than the least; `w`: inverse masses of its ends.
    #[inline]
    pub fn project(&self, x: &mut [V3d], w: [f64; 2]) {
        let [a, b] = self.ends.map(|v| v as usize);
        let d = x[a] - x[b];
        let now = d.norm();
        let both = w[0] + w[1];
        if both > 0.0 && now > self.least {
            let push = d * ((now - self.length) / (now * (both + self.compliance)));
            x[a] -= push * w[0];
            x[b] += push * w[1];
        }
    }
}

/// Flattens a hinge: the constraint is the vector Σ cₖ xₖ = 0 of quadratic bending; `w`: inverse masses.
#[inline]
pub fn project_hinge(x: &mut [V3d], hinge: &Hinge, w: [f64; 4], compliance: f64) {
    let q = hinge.bow(|v| x[v as usize]);
    let sum: f64 = (0..4).map(|k| w[k] * hinge.c[k] * hinge.c[k]).sum();
    if sum == 0.0 {
        return;
    }
    let push = q / (sum + compliance);
    for k in 0..4 {
        x[hinge.v[k] as usize] -= push * (w[k] * hinge.c[k]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(length: f64, least: f64, compliance: f64) -> DistanceConstraint {
        DistanceConstraint {
            ends: [0, 1],
            length,
            least,
            compliance,
        }
    }

    #[test]
    fn stiff_distance_reaches_its_length_and_keeps_the_centre_of_mass() {
        let mut x = [V3d::zeros(), V3d::new(3.0, 0.0, 0.0)];
        edge(1.0, 0.0, 0.0).project(&mut x, [1.0, 3.0]);
        assert!((x[1] - x[0]).norm() - 1.0 < 1e-12);
        // Masses 1 and ⅓.
        assert!((x[0] * 3.0 + x[1] - V3d::new(3.0, 0.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn compliant_distance_has_its_closed_form_and_slack_edges_stay() {
        let start = [V3d::zeros(), V3d::new(3.0, 0.0, 0.0)];
        let mut x = start;
        edge(1.0, 0.0, 2.0).project(&mut x, [1.0, 1.0]);
        // Each end moves by (3 − 1) / (1 + 1 + 2).
        assert!((x[0].x - 0.5).abs() < 1e-12 && (x[1].x - 2.5).abs() < 1e-12);
        let mut x = start;
        edge(3.5, 3.5, 0.0).project(&mut x, [1.0, 1.0]);
        edge(1.0, 0.0, 0.0).project(&mut x, [0.0, 0.0]);
        assert_eq!(x, start);
    }

    #[test]
    fn stiff_hinge_becomes_flat_and_fixed_vertices_stay() {
        let hinge = Hinge {
            v: [0, 1, 2, 3],
            c: [1.0, 1.0, -1.0, -1.0],
            w: 1.0,
            rest: 0.0,
        };
        let start = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.5, 1.0, 0.4],
            [0.5, -1.0, 0.2],
        ];
        let mut x = start.map(V3d::from);
        project_hinge(&mut x, &hinge, [0.0, 0.0, 1.0, 2.0], 0.0);
        assert!(hinge.bow(|v| x[v as usize]).norm() < 1e-12);
        assert_eq!([x[0], x[1]], [start[0], start[1]].map(V3d::from));
        let before = x;
        project_hinge(&mut x, &hinge, [0.0; 4], 0.0);
        assert_eq!(x, before);
    }
}
