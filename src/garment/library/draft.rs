//! Drafting: panels from corners, mirror images and seams.

use crate::{Curve, Panel, PanelEdge, Placement, Seam};

/// Name, start corner and shape of an edge.
pub(super) type DraftEdge<'a> = (&'a str, [f64; 2], Curve);

/// Mirror image of a point at x = 0.
pub(super) fn flip(p: [f64; 2]) -> [f64; 2] {
    [-p[0], p[1]]
}

/// Panel of these edges.
pub(super) fn panel(name: &str, placement: Placement, edges: &[DraftEdge<'_>]) -> Panel {
    Panel {
        name: name.to_owned(),
        placement,
        sector: None,
        edges: edges
            .iter()
            .map(|(n, from, curve)| PanelEdge {
                name: (*n).to_owned(),
                from: *from,
                curve: *curve,
            })
            .collect(),
    }
}

/// Mirror image of a panel at x = 0, counter-clockwise; edges keep their names.
pub(super) fn mirrored(p: &Panel, name: &str, placement: Placement) -> Panel {
    let n = p.edges.len();
    let edges = (0..n)
        .rev()
        .map(|i| PanelEdge {
            name: p.edges[i].name.clone(),
            from: flip(p.end(i)),
            curve: p.edges[i].curve.mapped(flip).reversed(),
        })
        .collect();
    Panel {
        name: name.to_owned(),
        placement,
        sector: None,
        edges,
    }
}

/// Seam of two `[panel, edge]` references that run against each other.
pub(super) fn sewn(a: [&str; 2], b: [&str; 2]) -> Seam {
    Seam {
        a: a.map(str::to_owned),
        b: b.map(str::to_owned),
        reversed: true,
    }
}
