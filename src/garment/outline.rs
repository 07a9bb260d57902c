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
    /// Circular arc through this point halfway along it, panel coordinates, metres.
    Arc([f64; 2]),
}

impl Curve {
    /// The curve run the other way.
    pub fn reversed(self) -> Self {
        match self {
            Self::Cubic(a, b) => Self::Cubic(b, a),
            Self::Line | Self::Arc(_) => self,
        }
    }
    /// The curve with its points mapped by a similarity.
    pub fn mapped(self, map: impl Fn([f64; 2]) -> [f64; 2]) -> Self {
        match self {
            Self::Line => self,
            Self::Cubic(a, b) => Self::Cubic(map(a), map(b)),
            Self::Arc(m) => Self::Arc(map(m)),
        }
    }
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
            Curve::Arc(middle) => arc_point(self.from, middle, to, t),
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

/// Point at share `t` of the circular arc from `a` over `m`, halfway along it, to `b`.
fn arc_point(a: [f64; 2], m: [f64; 2], b: [f64; 2], t: f64) -> [f64; 2] {
    let chord = [b[0] - a[0], b[1] - a[1]];
    let half = 0.5 * chord[0].hypot(chord[1]);
    let rise = [m[0] - 0.5 * (a[0] + b[0]), m[1] - 0.5 * (a[1] + b[1])];
    let sagitta = rise[0].hypot(rise[1]);
    // A quarter of the arc's angle at the centre is the angle between the chord and the line to its middle.
    let quarter = sagitta.atan2(half);
    let turn = 4.0 * quarter;
    let radius = (half * half + sagitta * sagitta) / (2.0 * sagitta);
    if !(radius.is_finite() && radius < STRAIGHT_ARC * half) {
        return std::array::from_fn(|d| a[d] + chord[d] * t);
    }
    // Unit vectors from the centre to the middle of the arc, and along the chord.
    let (out, along) = (
        rise.map(|c| c / sagitta),
        chord.map(|c| 0.5 * c / half.max(f64::MIN_POSITIVE)),
    );
    let (sin, cos) = ((t - 0.5) * turn).sin_cos();
    std::array::from_fn(|d| m[d] + radius * ((cos - 1.0) * out[d] + sin * along[d]))
}

/// Radius over half the chord from which an arc is straight: its sagitta is below rounding.
const STRAIGHT_ARC: f64 = 1e9;

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
    fn arcs_of_all_angles_keep_their_radius_and_length() {
        for turn in [0.1, 1.0, std::f64::consts::PI, 5.0, 6.1] {
            let on = |angle: f64| [3.0 + 2.0 * f64::cos(angle), 1.0 + 2.0 * f64::sin(angle)];
            let e = PanelEdge {
                name: "a".into(),
                from: on(0.4),
                curve: Curve::Arc(on(0.4 + 0.5 * turn)),
            };
            let to = on(0.4 + turn);
            for t in [0.0, 0.2, 0.5, 0.9, 1.0] {
                let (p, q) = (e.at(to, t), on(0.4 + t * turn));
                assert!(
                    (p[0] - q[0]).hypot(p[1] - q[1]) < 1e-9,
                    "{turn} {t}: {p:?} {q:?}"
                );
            }
            assert!((e.length(to) - 2.0 * turn).abs() < 2e-3 * turn);
        }
    }

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
