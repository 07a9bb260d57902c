//! Skirts to the knee: flared (waist and hem on arcs) and straight (shaped by darts).

use super::cuts::{SkirtCut, StraightSkirtCut};
use super::draft::{DraftEdge, flip, panel, sewn};
use crate::{
    Anchor, Curve, Dart, GarmentError, GarmentKind, Material, Panel, Pattern, Placement, SizeRow,
};

/// Shape of a skirt panel between two arcs about (0, radius).
pub(super) struct Sector<'a> {
    /// Length of the upper arc, metres.
    pub(super) waist: f64,
    /// Half of its angle, radians.
    pub(super) half_angle: f64,
    /// Waist to hem, metres.
    pub(super) length: f64,
    /// Divisions of the upper arc, as shares of it from paper right to paper left.
    pub(super) cuts: &'a [f64],
}

impl Sector<'_> {
    fn radius(&self) -> f64 {
        self.waist / (2.0 * self.half_angle)
    }
    /// Girth of two panels `depth` metres below the waist.
    pub(super) fn girth(&self, depth: f64) -> f64 {
        (self.radius() + depth) * self.half_angle * 4.0
    }
    /// The panel. The pieces of its upper arc are `waist`, or `waist_0`, `waist_1` … from paper right to paper left.
    pub(super) fn panel(&self, name: &str, placement: Placement) -> Panel {
        let (radius, half_angle) = (self.radius(), self.half_angle);
        // Cubic approximation of an arc: control length 4/3·tan(θ/4).
        let at = |r: f64, a: f64| [r * a.sin(), radius - r * a.cos()];
        let arc = |r: f64, from: f64, to: f64| {
            let k = 4.0 / 3.0 * ((to - from) / 4.0).tan() * r;
            let (p, q) = (at(r, from), at(r, to));
            Curve::Cubic(
                [p[0] + k * from.cos(), p[1] + k * from.sin()],
                [q[0] - k * to.cos(), q[1] - k * to.sin()],
            )
        };
        let low = radius + self.length;
        let hem = arc(low, -half_angle, half_angle);
        let mut edges = vec![
            ("hem".to_owned(), at(low, -half_angle), hem),
            ("side_right".to_owned(), at(low, half_angle), Curve::Line),
        ];
        let mut from = half_angle;
        for (k, share) in self.cuts.iter().copied().chain([1.0]).enumerate() {
            let to = half_angle * (1.0 - 2.0 * share);
            let edge = if self.cuts.is_empty() {
                "waist".to_owned()
            } else {
                format!("waist_{k}")
            };
            edges.push((edge, at(radius, from), arc(radius, from, to)));
            from = to;
        }
        edges.push(("side_left".to_owned(), at(radius, -half_angle), Curve::Line));
        let edges: Vec<DraftEdge<'_>> =
            edges.iter().map(|(n, p, c)| (n.as_str(), *p, *c)).collect();
        panel(name, placement, &edges)
    }
}

/// Half angle of a panel whose width at the hip line is at least `hip`; widths of one panel, metres.
pub(super) fn flare(waist: f64, hip: f64, cut: &SkirtCut) -> f64 {
    cut.flare.max((hip - waist) / cut.hip_depth / 2.0)
}

/// A flared skirt.
pub(super) fn flared(row: &SizeRow, cut: &SkirtCut) -> Result<Pattern, GarmentError> {
    let waist = (row.body.waist + cut.waist_ease) / 2.0;
    let sector = Sector {
        waist,
        half_angle: flare(waist, (row.body.hip + cut.hip_ease) / 2.0, cut),
        length: cut.length,
        cuts: &[],
    };
    let panels = vec![
        sector.panel("front", Placement::SkirtFront),
        sector.panel("back", Placement::SkirtBack),
    ];
    let finished = [0.0, waist * 2.0, sector.girth(cut.hip_depth)];
    finish(row, "skirt", panels, &["waist"], finished)
}

/// A straight skirt.
pub(super) fn straight(row: &SizeRow, cut: &StraightSkirtCut) -> Result<Pattern, GarmentError> {
    let waist = (row.body.waist + cut.waist_ease) / 4.0; // half width of a panel
    let hip = (row.body.hip + cut.hip_ease) / 4.0;
    // The hip exceeds the waist by a dart on each side, and by as much at the side seam.
    let more = (hip - waist).max(cut.least_shaping);
    let (dart, top) = (0.5 * more, waist + 0.5 * more);
    let (hem, rise, hip_depth) = (hip - cut.hem_taper, cut.waist_rise, cut.hip_depth);
    let build = |name: &str, placement, depth: f64| {
        let at = top * cut.dart_at;
        let line = |x: f64| rise * x / top;
        let (out, apex, inn) = (
            [at + dart / 2.0, line(at + dart / 2.0)],
            [at, -depth],
            [at - dart / 2.0, line(at - dart / 2.0)],
        );
        let (corner, hips, low) = ([top, rise], [hip, -hip_depth], [hem, -cut.length]);
        // The hip curve leaves the hip line upright.
        let curve = Curve::Cubic(
            [hip, -hip_depth * 0.55],
            [top + (hip - top) * 0.55, -hip_depth * 0.18],
        );
        let back = Curve::Cubic(
            [-top - (hip - top) * 0.55, -hip_depth * 0.18],
            [-hip, -hip_depth * 0.55],
        );
        panel(
            name,
            placement,
            &[
                ("hem", flip(low), Curve::Line),
                ("side_right", low, Curve::Line),
                ("hip_right", hips, curve),
                ("waist_0", corner, Curve::Line),
                ("dart_right_a", out, Curve::Line),
                ("dart_right_b", apex, Curve::Line),
                ("waist_1", inn, Curve::Line),
                ("dart_left_a", flip(inn), Curve::Line),
                ("dart_left_b", flip(apex), Curve::Line),
                ("waist_2", flip(out), Curve::Line),
                ("hip_left", flip(corner), back),
                ("side_left", flip(hips), Curve::Line),
            ],
        )
    };
    let panels = vec![
        build("front", Placement::SkirtFront, cut.dart_depth[0]),
        build("back", Placement::SkirtBack, cut.dart_depth[1]),
    ];
    let pattern = finish(
        row,
        "straight_skirt",
        panels,
        &["waist_0", "waist_1", "waist_2"],
        [0.0, waist * 4.0, hip * 4.0],
    )?;
    Ok(Pattern {
        darts: darts(&["front", "back"]),
        trims: vec![],
        ..pattern
    })
}

/// Two darts of each of these panels.
pub(super) fn darts(panels: &[&str]) -> Vec<Dart> {
    panels
        .iter()
        .flat_map(|p| {
            ["right", "left"].map(|s| Dart {
                panel: (*p).to_owned(),
                edges: [format!("dart_{s}_a"), format!("dart_{s}_b")],
            })
        })
        .collect()
}

/// Sews a front and a back; `waist` are the edges attached to the body.
fn finish(
    row: &SizeRow,
    name: &str,
    panels: Vec<Panel>,
    waist: &[&str],
    finished: [f64; 3],
) -> Result<Pattern, GarmentError> {
    let mut seams = vec![
        sewn(["front", "side_right"], ["back", "side_left"]),
        sewn(["front", "side_left"], ["back", "side_right"]),
    ];
    if panels[0].edge("hip_right").is_some() {
        seams.push(sewn(["front", "hip_right"], ["back", "hip_left"]));
        seams.push(sewn(["front", "hip_left"], ["back", "hip_right"]));
    }
    let edges = ["front", "back"]
        .iter()
        .flat_map(|p| {
            waist
                .iter()
                .map(move |e| [(*p).to_owned(), (*e).to_owned()])
        })
        .collect();
    Ok(Pattern {
        name: name.into(),
        kind: GarmentKind::Skirt,
        size: row.size,
        panels,
        seams,
        darts: vec![],
        trims: vec![],
        anchors: vec![Anchor {
            name: "waist".into(),
            edges,
            strength: 1.0,
        }],
        material: Material::preset("twill")?,
        layer: 0,
        finished,
    })
}
