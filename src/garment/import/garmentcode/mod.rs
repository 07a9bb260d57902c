//! Patterns from GarmentCode: panels placed by where they are drawn around the figure and by their seams.

mod chart;
mod figure;
mod finished;
mod landmarks;
mod region;
mod ring;
mod shoulders;

use super::settings::ImportSettings;
use crate::{
    GarmentError, GarmentKind, Material, Panel, PanelEdge, Pattern, Placement, Seam, Size,
};
use chart::FlatChart;
use figure::{DrawnPanel, curve, edge_points};
use region::CoveredPart;
use tryon_formats::garmentcode::RawPattern;

/// Distance below the end of a side seam at which a chest is measured, metres.
const UNDER_SEAM: f64 = 0.01;

/// Name of each raw edge of each panel; `None` if the edge is left out.
type EdgeNames = Vec<Vec<Option<String>>>;

/// Converts a pattern. `size` is that of the figure it was drafted for.
///
/// # Errors
/// A panel whose place cannot be told, with what was found of it, or faults of the converted pattern (panel, edge, seam).
pub fn from_garmentcode(
    raw: &RawPattern,
    name: &str,
    size: Size,
    material: Material,
) -> Result<Pattern, GarmentError> {
    let settings = ImportSettings::default();
    let drawn = figure::draw(raw, &settings);
    let regions = region::regions(&drawn, &settings)?;
    let parts = ring::rings(&drawn, &regions, &settings)?;
    let mut charts = chart::charts(&drawn, &regions, &parts, &settings)?;
    turn_collars(&drawn, &regions, &mut charts);

    let dropped = short_edges(raw, settings.shortest_edge);
    let landmarks = landmarks::names(&drawn, &regions);
    let mut panels = Vec::new();
    let mut edge_names: EdgeNames = Vec::new();
    for (k, p) in drawn.iter().enumerate() {
        let name_of = |e: usize| {
            let landmark = landmarks.get(&(k, e)).cloned();
            landmark.unwrap_or_else(|| format!("edge_{e}"))
        };
        let names = (0..p.raw.edges.len()).map(|e| (!dropped[k][e]).then(|| name_of(e)));
        let names: Vec<Option<String>> = names.collect();
        panels.push(convert(p, &charts[k], &names, settings.shortest_edge)?);
        edge_names.push(names);
    }
    let kind = kind(&panels);
    let levels = girth_levels(&drawn, &regions, &settings);
    let pattern = Pattern {
        name: name.to_owned(),
        kind,
        size,
        seams: seams(raw, &panels, &edge_names),
        darts: vec![],
        trims: vec![],
        anchors: vec![landmarks::anchor(raw, &drawn, &panels, &edge_names)],
        finished: finished::girths(&panels, &parts, levels),
        material,
        layer: u8::from(matches!(kind, GarmentKind::Top | GarmentKind::Dress)),
        panels,
    };
    pattern.check()?;
    Ok(pattern)
}

/// Levels of the girths (metres from the shoulder and from the waist). A chest is measured where its side seams are closed: deep
/// armholes and slanting rims end lower.
fn girth_levels(
    drawn: &[DrawnPanel<'_>],
    regions: &[CoveredPart],
    settings: &ImportSettings,
) -> [f64; 3] {
    let shoulder = chart::shoulder_height(drawn, regions, settings);
    let closed = shoulders::side_seam_tops(drawn, regions).into_iter();
    let [chest, waist, hip] = settings.girth_levels;
    let below = closed.map(|y| y - shoulder - UNDER_SEAM);
    [below.fold(chest, f64::min), waist, hip]
}

fn seams(raw: &RawPattern, panels: &[Panel], names: &EdgeNames) -> Vec<Seam> {
    let of = |(p, e): (usize, usize)| Some([panels[p].name.clone(), names[p][e].clone()?]);
    let seam = |[a, b]: [(usize, usize); 2]| {
        Some(Seam {
            a: of(a)?,
            b: of(b)?,
            reversed: true,
        })
    };
    raw.stitches.iter().filter_map(|s| seam(s.sides)).collect()
}

fn kind(panels: &[Panel]) -> GarmentKind {
    let has = |wanted: &dyn Fn(Placement) -> bool| panels.iter().any(|p| wanted(p.placement));
    let leg = has(&|p| matches!(p, Placement::LegFront(_) | Placement::LegBack(_)));
    let skirt = has(&|p| matches!(p, Placement::SkirtFront | Placement::SkirtBack));
    if has(&|p| matches!(p, Placement::TrunkFront | Placement::TrunkBack)) {
        if leg || skirt {
            GarmentKind::Dress
        } else {
            GarmentKind::Top
        }
    } else if leg {
        GarmentKind::Trousers
    } else {
        GarmentKind::Skirt
    }
}

/// True for edges to remove: shorter than `shortest` (metres), and sewn to a short one or to none. Shape `[panels][edges]`.
fn short_edges(raw: &RawPattern, shortest: f64) -> Vec<Vec<bool>> {
    let short = |p: usize, e: usize| {
        let panel = &raw.panels[p];
        let [a, b] = panel.edges[e].ends.map(|v| panel.vertices[v]);
        (a[0] - b[0]).hypot(a[1] - b[1]) < shortest
    };
    let panels = raw.panels.iter().enumerate();
    let mut out: Vec<Vec<bool>> = panels
        .map(|(p, q)| (0..q.edges.len()).map(|e| short(p, e)).collect())
        .collect();
    for s in &raw.stitches {
        let [a, b] = s.sides;
        if !(short(a.0, a.1) && short(b.0, b.1)) {
            out[a.0][a.1] = false;
            out[b.0][b.1] = false;
        }
    }
    out
}

/// Mirrors the charts of collars that are sewn right side to wrong side, so that all panels form one oriented surface: a
/// lapel is turned over.
fn turn_collars(drawn: &[DrawnPanel<'_>], regions: &[CoveredPart], charts: &mut [FlatChart]) {
    // True where the outline in the file runs counter-clockwise on the surface.
    let runs: Vec<bool> = drawn
        .iter()
        .zip(charts.iter())
        .map(|(p, c)| area(p, c) > 0.0)
        .collect();
    let mut wanted: Vec<Option<bool>> = runs
        .iter()
        .zip(regions)
        .map(|(run, r)| (*r != CoveredPart::Neck).then_some(*run))
        .collect();
    let mut changed = true;
    while changed {
        changed = false;
        for (k, p) in drawn.iter().enumerate() {
            let sewn = p
                .neighbours
                .iter()
                .find_map(|n| Some(wanted[n.panel]? != n.wrong_side));
            if let (None, Some(run)) = (wanted[k], sewn) {
                wanted[k] = Some(run);
                if run != runs[k] {
                    charts[k] = charts[k].mirrored();
                }
                changed = true;
            }
        }
    }
}

/// Signed area of a panel in its chart, m².
fn area(p: &DrawnPanel<'_>, chart: &FlatChart) -> f64 {
    let edges = 0..p.raw.edges.len();
    let outline: Vec<[f64; 2]> = edges
        .flat_map(|e| edge_points(p.raw, e))
        .map(|q| chart.point(p, q))
        .collect();
    let next = outline.iter().cycle().skip(1);
    let double: f64 = outline
        .iter()
        .zip(next)
        .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
        .sum();
    0.5 * double
}

/// Converts a panel; its outline ends counter-clockwise. Edges without a name are those shorter than `shortest` metres.
fn convert(
    p: &DrawnPanel<'_>,
    chart: &FlatChart,
    names: &[Option<String>],
    shortest: f64,
) -> Result<Panel, GarmentError> {
    let to = |q: [f64; 2]| chart.point(p, q);
    let mut edges = Vec::new();
    for (e, name) in p.raw.edges.iter().zip(names) {
        let Some(name) = name else { continue };
        let [a, b] = e.ends.map(|v| p.raw.vertices[v]);
        edges.push(PanelEdge {
            name: name.clone(),
            from: to(a),
            curve: curve(e, a, b).mapped(to),
        });
    }
    if edges.len() < 3 {
        return Err(GarmentError::Panel {
            panel: p.raw.name.clone(),
            why: format!(
                "{} edges, expected at least three longer than {:.0} mm or sewn to such a one",
                edges.len(),
                1e3 * shortest
            ),
        });
    }
    let mut panel = Panel {
        name: p.raw.name.clone(),
        placement: chart.placement,
        sector: chart.sector,
        edges,
    };
    if area(p, chart) < 0.0 {
        let reversed = (0..panel.edges.len()).rev().map(|i| PanelEdge {
            name: panel.edges[i].name.clone(),
            from: panel.end(i),
            curve: panel.edges[i].curve.reversed(),
        });
        panel.edges = reversed.collect();
    }
    Ok(panel)
}
