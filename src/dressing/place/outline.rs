//! The sampled outline of a panel, queried by rows.

use tryon_garment::Panel;

/// Chords of one edge of the outline; fewer cut the corners off necklines.
const CHORDS: usize = 12;
/// Rows this near to the nearest corner, metres, belong to it.
const SAME_ROW: f32 = 1e-4;

/// Closed polyline in panel coordinates, metres.
pub(super) struct PanelOutline(Vec<[f32; 2]>);

impl PanelOutline {
    pub(super) fn of(panel: &Panel) -> Self {
        let edge = |i: usize| panel.edges[i].sample(panel.end(i), CHORDS).into_iter();
        Self(
            (0..panel.edges.len())
                .flat_map(|i| edge(i).take(CHORDS))
                .map(|p| [p[0] as f32, p[1] as f32])
                .collect(),
        )
    }
    pub(super) fn points(&self) -> &[[f32; 2]] {
        &self.0
    }
    /// Largest |x|.
    pub(super) fn half_width(&self) -> f32 {
        self.0.iter().map(|p| p[0].abs()).fold(0.0, f32::max)
    }
    /// Leftmost and rightmost x at height `y`; above and below the panel those of its nearest corners.
    pub(super) fn span(&self, y: f32) -> [f32; 2] {
        let n = self.0.len();
        let mut span = [f32::MAX, f32::MIN];
        for i in 0..n {
            let (a, b) = (self.0[i], self.0[(i + 1) % n]);
            if (a[1] <= y) != (b[1] <= y) {
                let x = a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]);
                span = [span[0].min(x), span[1].max(x)];
            }
        }
        if span[0] > span[1] {
            let distance = |p: &[f32; 2]| (p[1] - y).abs();
            let nearest = self.0.iter().map(distance).fold(f32::MAX, f32::min);
            for p in self.0.iter().filter(|p| distance(p) <= nearest + SAME_ROW) {
                span = [span[0].min(p[0]), span[1].max(p[0])];
            }
        }
        span
    }
    /// Larger |x| of the outline at height `y`, at least `least` metres.
    pub(super) fn half_width_at(&self, y: f32, least: f32) -> f32 {
        self.span(y).map(f32::abs).into_iter().fold(least, f32::max)
    }
}

/// Points at equal arc length along the edges whose names start with `prefix`, `chords` an edge.
pub(super) fn sample_edges(panel: &Panel, prefix: &str, chords: usize) -> Vec<[f64; 2]> {
    (0..panel.edges.len())
        .filter(|i| panel.edges[*i].name.starts_with(prefix))
        .flat_map(|i| panel.edges[i].sample(panel.end(i), chords))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_a_triangle_span_its_width_and_rows_beyond_it_its_corners() {
        let o = PanelOutline(vec![[-1.0, 0.0], [1.0, 0.0], [0.0, 2.0]]);
        assert_eq!(o.span(1.0), [-0.5, 0.5]);
        assert_eq!(o.span(3.0), [0.0, 0.0]);
        assert_eq!(o.span(-1.0), [-1.0, 1.0]);
        assert_eq!(o.half_width_at(3.0, 0.02), 0.02);
        assert_eq!(o.half_width(), 1.0);
    }
}
