//! Seams between the front and the back of a trunk: shoulder seams, and side seams under the arms.

use super::figure::DrawnPanel;
use super::region::CoveredPart;

/// Panels and edges of the shoulder seams: nearly level seams between front and back, above the middle of the trunk.
pub(super) fn shoulder_seams(
    panels: &[DrawnPanel<'_>],
    regions: &[CoveredPart],
) -> Vec<(usize, usize)> {
    let mut out = Vec::new();
    for (k, p) in panels.iter().enumerate() {
        if regions[k] != CoveredPart::Trunk {
            continue;
        }
        for n in &p.neighbours {
            let q = &panels[n.panel];
            let across =
                regions[n.panel] == CoveredPart::Trunk && q.is_in_front() != p.is_in_front();
            let [a, b] = p.raw.edges[n.edge].ends.map(|v| p.flat(p.raw.vertices[v]));
            let level = (a[0] - b[0]).abs() > (a[1] - b[1]).abs();
            if across && level && a[1].max(b[1]) > 0.5 * (p.low + p.high) {
                out.push((k, n.edge));
            }
        }
    }
    out
}

/// Height of the upper end of the side seams of each trunk panel that has one, metres over the figure's floor.
pub(super) fn side_seam_tops(panels: &[DrawnPanel<'_>], regions: &[CoveredPart]) -> Vec<f64> {
    let shoulders = shoulder_seams(panels, regions);
    let mut out = Vec::new();
    for (k, p) in panels.iter().enumerate() {
        let side = p.neighbours.iter().filter(|n| {
            let q = &panels[n.panel];
            let both = regions[k] == CoveredPart::Trunk && regions[n.panel] == CoveredPart::Trunk;
            both && q.is_in_front() != p.is_in_front() && !shoulders.contains(&(k, n.edge))
        });
        let corners = side.flat_map(|n| p.raw.edges[n.edge].ends);
        let heights = corners.map(|v| p.in_space(p.raw.vertices[v]).y);
        out.extend(heights.reduce(f64::max));
    }
    out
}
