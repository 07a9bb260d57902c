//! The outline of a panel: named edges, straight or curved.

use serde::{Deserialize, Serialize};

/// Shape of an edge between its two corners.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Curve {
    /// Straight.
    Line,
    /// Cubic Bézier with these two inner control points, panel coordinates, metres.
    Cubic([f64; 2], [f64; 2]),
}

/// One edge of a panel; it ends where the next one starts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PanelEdge {
    /// Name, unique in the panel.
    pub name: String,
    /// Start corner, panel coordinates, metres.
    pub from: [f64; 2],
    /// Shape.
    pub curve: Curve,
}

impl PanelEdge {
    /// Point at parameter `t` in 0..=1 of the edge that ends in `to`.
    pub fn at(&self, to: [f64; 2], t: f64) -> [f64; 2] {
        match self.curve {
            Curve::Line => std::array::from_fn(|d| self.from[d] + (to[d] - self.from[d]) * t),
            Curve::Cubic(a, b) => {
                let s = 1.0 - t;
                std::array::from_fn(|d| {
                    s * s * s * self.from[d]
                        + 3.0 * s * s * t * a[d]
                        + 3.0 * s * t * t * b[d]
                        + t * t * t * to[d]
                })
            }
        }
    }
    /// Arc length, metres, by fine sampling.
    pub fn length(&self, to: [f64; 2]) -> f64 {
        arc_lengths(&self.dense(to)).last().copied().unwrap_or(0.0)
    }
    /// `pieces + 1` points at equal arc length, both ends included.
    pub fn sample(&self, to: [f64; 2], pieces: usize) -> Vec<[f64; 2]> {
        let points = self.dense(to);
        let along = arc_lengths(&points);
        let total = along.last().copied().unwrap_or(0.0);
        let mut k = 0;
        let mut out: Vec<[f64; 2]> = (0..pieces)
            .map(|i| {
                let s = total * i as f64 / pieces as f64;
                while k + 2 < along.len() && along[k + 1] <= s {
                    k += 1;
                }
                let f = (s - along[k]) / (along[k + 1] - along[k]).max(f64::MIN_POSITIVE);
                std::array::from_fn(|d| points[k][d] + (points[k + 1][d] - points[k][d]) * f)
            })
            .collect();
        out.push(to);
        out
    }
    fn dense(&self, to: [f64; 2]) -> Vec<[f64; 2]> {
        /// Chords of a curve: relative length error about 1e-5 for a quarter circle.
        const CHORDS: usize = 96;
        let n = if self.curve == Curve::Line { 1 } else { CHORDS };
        (0..=n).map(|i| self.at(to, i as f64 / n as f64)).collect()
    }
}

/// Arc length up to each point, metres.
fn arc_lengths(points: &[[f64; 2]]) -> Vec<f64> {
    let mut along = vec![0.0];
    for w in points.windows(2) {
        along.push(along[along.len() - 1] + (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]));
    }
    along
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bezier_quarter_circles_have_their_length() {
        const K: f64 = 0.552_284_749_8; // control length of a quarter circle
        let e = PanelEdge {
            name: "q".into(),
            from: [1.0, 0.0],
            curve: Curve::Cubic([1.0, K], [K, 1.0]),
        };
        assert!((e.length([0.0, 1.0]) - std::f64::consts::FRAC_PI_2).abs() < 1e-3);
        let p = e.sample([0.0, 1.0], 8);
        let gaps: Vec<f64> = p
            .windows(2)
            .map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1]))
            .collect();
        assert_eq!(p.len(), 9);
        assert!(gaps.iter().all(|g| (g - gaps[0]).abs() < 1e-3));
    }
}
