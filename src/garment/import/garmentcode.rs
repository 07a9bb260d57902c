//! Patterns from GarmentCode: panels in the frames of their places on the body, landmark edges by name.

use super::settings::ImportSettings;
use crate::{
    Anchor, Curve, GarmentError, GarmentKind, Material, Panel, PanelEdge, Pattern, Placement, Seam,
    Side, Size,
};
use tryon_formats::garmentcode::{RawCurve, RawEdge, RawPanel, RawPattern};

/// Converts a pattern. `size` is that of the figure it was drafted for.
///
/// # Errors
/// A panel whose name gives no place, or faults of the converted pattern (panel, edge, seam).
pub fn from_garmentcode(
    raw: &RawPattern,
    name: &str,
    size: Size,
    material: Material,
) -> Result<Pattern, GarmentError> {
    let settings = ImportSettings::default();
    let places = raw
        .panels
        .iter()
        .map(place)
        .collect::<Result<Vec<_>, _>>()?;
    let dropped = short_edges(raw, settings.shortest_edge);
    let heights = Heights::new(raw, &places);
    let mut panels = Vec::new();
    // Name of each raw edge; `None` if removed.
    let mut edge_names: Vec<Vec<Option<String>>> = Vec::new();
    for (k, p) in raw.panels.iter().enumerate() {
        let (panel, names) = convert(p, places[k], &heights, &dropped[k])?;
        panels.push(panel);
        edge_names.push(names);
    }
    name_landmarks(raw, &places, &mut panels, &mut edge_names);
    let mut seams = Vec::new();
    for [a, b] in &raw.stitches {
        let of = |s: &(usize, usize)| {
            edge_names[s.0][s.1]
                .clone()
                .map(|e| [panels[s.0].name.clone(), e])
        };
        if let (Some(a), Some(b)) = (of(a), of(b)) {
            seams.push(Seam {
                a,
                b,
                reversed: true,
            });
        }
    }
    let has = |f: &dyn Fn(&Placement) -> bool| places.iter().any(f);
    let trunk = has(&|p| matches!(p, Placement::TrunkFront | Placement::TrunkBack));
    let below = has(&|p| {
        !matches!(
            p,
            Placement::TrunkFront
                | Placement::TrunkBack
                | Placement::Sleeve(_)
                | Placement::Hood(_)
        )
    });
    let kind = match (trunk, below) {
        (true, true) => GarmentKind::Dress,
        (true, false) => GarmentKind::Top,
        _ if has(&|p| matches!(p, Placement::SkirtFront | Placement::SkirtBack)) => {
            GarmentKind::Skirt
        }
        _ => GarmentKind::Trousers,
    };
    let anchors = anchors(&panels, &seams, trunk, settings.near_top);
    let finished = girths(&panels, trunk, settings.girth_levels);
    let pattern = Pattern {
        name: name.to_owned(),
        kind,
        size,
        panels,
        seams,
        darts: vec![],
        anchors,
        material,
        layer: u8::from(trunk),
        finished,
    };
    pattern.check()?;
    Ok(pattern)
}

/// Place of a panel by its name and position.
fn place(p: &RawPanel) -> Result<Placement, GarmentError> {
    let n = p.name.to_lowercase();
    let has = |words: &[&str]| words.iter().any(|w| n.contains(w));
    let side =
        if n.contains("left") || n.ends_with("_l") || (n.contains("_l_") && !n.contains("right")) {
            Side::Left
        } else if n.contains("right") || n.ends_with("_r") || n.contains("_r_") {
            Side::Right
        } else if p.translation[0] >= 0.0 {
            Side::Left
        } else {
            Side::Right
        };
    let front = p.translation[2] >= 0.0;
    Ok(if has(&["hood"]) {
        Placement::Hood(side)
    } else if has(&["sleeve", "sl_cuff"]) {
        Placement::Sleeve(side)
    } else if has(&["pant", "leg"]) {
        if front {
            Placement::LegFront(side)
        } else {
            Placement::LegBack(side)
        }
    } else if has(&["skirt"]) {
        if front {
            Placement::SkirtFront
        } else {
            Placement::SkirtBack
        }
    } else if has(&["torso", "bodice"]) {
        if front {
            Placement::TrunkFront
        } else {
            Placement::TrunkBack
        }
    } else {
        return Err(GarmentError::Panel {
            panel: p.name.clone(),
            why: "its place cannot be told; names with torso, bodice, sleeve, skirt, pant or hood are known".into(),
        });
    })
}

/// Point of a panel in the frame of the figure, metres.
fn in_space(p: &RawPanel, q: [f64; 2]) -> [f64; 3] {
    let r = nalgebra::Rotation3::from_euler_angles(
        p.rotation[0].to_radians(),
        p.rotation[1].to_radians(),
        p.rotation[2].to_radians(),
    );
    let v = r * nalgebra::Vector3::new(q[0], q[1], 0.0);
    std::array::from_fn(|k| v[k] + p.translation[k])
}

/// Heights of the panel origins, metres: shoulder points of the trunk, waists of skirt and trousers.
struct Heights {
    shoulder: f64,
    skirt: f64,
    leg: f64,
}

impl Heights {
    fn new(raw: &RawPattern, places: &[Placement]) -> Self {
        let top = |wanted: &dyn Fn(&Placement) -> bool| {
            let panels = raw.panels.iter().zip(places).filter(|(_, p)| wanted(p));
            panels
                .flat_map(|(p, _)| p.vertices.iter().map(|v| in_space(p, *v)[1]))
                .fold(f64::MIN, f64::max)
        };
        Self {
            shoulder: top(&|p| matches!(p, Placement::TrunkFront | Placement::TrunkBack)),
            skirt: top(&|p| matches!(p, Placement::SkirtFront | Placement::SkirtBack)),
            leg: top(&|p| matches!(p, Placement::LegFront(_) | Placement::LegBack(_))),
        }
    }
}

/// True for edges to remove: shorter than `shortest` (metres), and sewn to a short one or to none. Shape `[panels][edges]`.
fn short_edges(raw: &RawPattern, shortest: f64) -> Vec<Vec<bool>> {
    let short = |p: usize, e: usize| {
        let panel = &raw.panels[p];
        let [a, b] = panel.edges[e].ends.map(|v| panel.vertices[v]);
        (a[0] - b[0]).hypot(a[1] - b[1]) < shortest
    };
    let mut out: Vec<Vec<bool>> = raw
        .panels
        .iter()
        .enumerate()
        .map(|(p, q)| (0..q.edges.len()).map(|e| short(p, e)).collect())
        .collect();
    for [a, b] in &raw.stitches {
        if !(short(a.0, a.1) && short(b.0, b.1)) {
            out[a.0][a.1] = false;
            out[b.0][b.1] = false;
        }
    }
    out
}

/// Chart coordinates of a point of a panel (see [`Placement`]).
fn chart(p: &RawPanel, place: Placement, heights: &Heights, q: [f64; 2]) -> [f64; 2] {
    let s = in_space(p, q);
    match place {
        Placement::TrunkFront => [s[0], s[1] - heights.shoulder],
        Placement::TrunkBack => [-s[0], s[1] - heights.shoulder],
        Placement::SkirtFront => [s[0], s[1] - heights.skirt],
        Placement::SkirtBack => [-s[0], s[1] - heights.skirt],
        Placement::LegFront(_) => [s[0], s[1] - heights.leg],
        Placement::LegBack(_) => [-s[0], s[1] - heights.leg],
        Placement::Hood(side) => {
            // Hood panels are rotated about y: their x runs forward or back.
            let forward = s[2] - p.translation[2];
            [
                if side == Side::Left {
                    -forward
                } else {
                    forward
                },
                s[1] - heights.shoulder,
            ]
        }
        Placement::Sleeve(side) => {
            // In the panel's own frame the arm lies along x and the overarm seam is the upper edge.
            let out = if side == Side::Left { 1.0 } else { -1.0 };
            let along = p
                .vertices
                .iter()
                .map(|v| out * v[0])
                .fold(f64::MAX, f64::min);
            let top = p.vertices.iter().map(|v| v[1]).fold(f64::MIN, f64::max);
            let across = top - q[1];
            let back = p.translation[2] < 0.0;
            [
                if back == (side == Side::Left) {
                    across
                } else {
                    -across
                },
                along - out * q[0],
            ]
        }
    }
}

/// Control points of an edge in panel coordinates; `None` for a line.
fn control_points(e: &RawEdge, a: [f64; 2], b: [f64; 2]) -> Option<[[f64; 2]; 2]> {
    let d = [b[0] - a[0], b[1] - a[1]];
    let absolute = |r: [f64; 2]| {
        [
            a[0] + r[0] * d[0] - r[1] * d[1],
            a[1] + r[0] * d[1] + r[1] * d[0],
        ]
    };
    match e.curve {
        RawCurve::Line => None,
        RawCurve::Quadratic(c) => {
            let c = absolute(c);
            let third = |p: [f64; 2]| {
                [
                    p[0] + (c[0] - p[0]) * 2.0 / 3.0,
                    p[1] + (c[1] - p[1]) * 2.0 / 3.0,
                ]
            };
            Some([third(a), third(b)])
        }
        RawCurve::Cubic(c, f) => Some([absolute(c), absolute(f)]),
        RawCurve::Circle(radius, large, right) => {
            // Half the angle of the arc; a chord longer than the diameter is a half circle.
            let chord = d[0].hypot(d[1]);
            let half = (chord / (2.0 * radius)).min(1.0).asin();
            let half = if large {
                std::f64::consts::PI - half
            } else {
                half
            };
            // Cubic with ends at the angle `half` to the chord: control length 4/3·tan(θ/4) of the radius.
            let k = 4.0 / 3.0 * (half / 2.0).tan() * radius / chord;
            let angle = if right { -half } else { half };
            let (c, s) = (k * angle.cos(), k * angle.sin());
            Some([absolute([c, s]), absolute([1.0 - c, s])])
        }
    }
}

/// Converts a panel; also the name of each raw edge.
fn convert(
    p: &RawPanel,
    place: Placement,
    heights: &Heights,
    dropped: &[bool],
) -> Result<(Panel, Vec<Option<String>>), GarmentError> {
    let n = p.edges.len();
    let to = |q: [f64; 2]| chart(p, place, heights, q);
    let kept: Vec<usize> = (0..n).filter(|e| !dropped[*e]).collect();
    if kept.len() < 3 {
        return Err(GarmentError::Panel {
            panel: p.name.clone(),
            why: "fewer than three edges longer than 9 mm".into(),
        });
    }
    let mut names = vec![None; n];
    let mut edges = Vec::new();
    for &e in &kept {
        let [a, b] = p.edges[e].ends.map(|v| p.vertices[v]);
        let curve = control_points(&p.edges[e], a, b)
            .map_or(Curve::Line, |c| Curve::Cubic(to(c[0]), to(c[1])));
        names[e] = Some(format!("edge_{e}"));
        edges.push(PanelEdge {
            name: format!("edge_{e}"),
            from: to(a),
            curve,
        });
    }
    let mut panel = Panel {
        name: p.name.clone(),
        placement: place,
        edges,
    };
    // Counter-clockwise seen from outside: some places mirror their panels.
    let corners: Vec<[f64; 2]> = panel.edges.iter().map(|e| e.from).collect();
    let m = corners.len();
    let area: f64 = (0..m)
        .map(|i| corners[i][0] * corners[(i + 1) % m][1] - corners[i][1] * corners[(i + 1) % m][0])
        .sum();
    if area < 0.0 {
        let reversed = (0..m)
            .rev()
            .map(|i| PanelEdge {
                name: panel.edges[i].name.clone(),
                from: panel.end(i),
                curve: match panel.edges[i].curve {
                    Curve::Line => Curve::Line,
                    Curve::Cubic(a, b) => Curve::Cubic(b, a),
                },
            })
            .collect();
        panel.edges = reversed;
    }
    Ok((panel, names))
}

/// Names the landmark edges of placement: shoulders, crotch, inseam and crown.
fn name_landmarks(
    raw: &RawPattern,
    places: &[Placement],
    panels: &mut [Panel],
    names: &mut [Vec<Option<String>>],
) {
    let mut rename = |panel: &mut Panel, k: usize, edge: usize, new: &str| {
        let old = panel.edges[edge].name.clone();
        if panel.edges.iter().any(|e| e.name == new) || old.starts_with("shoulder") {
            return;
        }
        names[k]
            .iter_mut()
            .filter(|n| n.as_deref() == Some(&old))
            .for_each(|n| *n = Some(new.to_owned()));
        panel.edges[edge].name = new.to_owned();
    };
    for (k, panel) in panels.iter_mut().enumerate() {
        let n = panel.edges.len();
        match places[k] {
            Placement::TrunkFront | Placement::TrunkBack => {
                // The shoulder seam starts or ends in the highest corner and runs outwards.
                let top = (0..n)
                    .max_by(|a, b| panel.edges[*a].from[1].total_cmp(&panel.edges[*b].from[1]))
                    .unwrap_or(0);
                let before = (top + n - 1) % n;
                let far = |q: [f64; 2]| q[0].abs();
                let shoulder = if far(panel.edges[before].from) > far(panel.end(top)) {
                    before
                } else {
                    top
                };
                rename(panel, k, shoulder, "shoulder");
            }
            Placement::LegFront(side) | Placement::LegBack(side) => {
                // The crotch is the innermost corner.
                let front = matches!(places[k], Placement::LegFront(_));
                let inner = if (side == Side::Left) == front {
                    -1.0
                } else {
                    1.0
                };
                let at = (0..n)
                    .max_by(|a, b| {
                        (inner * panel.edges[*a].from[0])
                            .total_cmp(&(inner * panel.edges[*b].from[0]))
                    })
                    .unwrap_or(0);
                let before = (at + n - 1) % n;
                let (up, down) = if panel.end(at)[1] > panel.edges[before].from[1] {
                    (at, before)
                } else {
                    (before, at)
                };
                rename(panel, k, up, "crotch");
                rename(panel, k, down, "inseam");
            }
            Placement::Hood(_) => {
                let mut crown = 0;
                for [a, b] in &raw.stitches {
                    let other = if a.0 == k {
                        b
                    } else if b.0 == k {
                        a
                    } else {
                        continue;
                    };
                    let own = if a.0 == k { a } else { b };
                    let hood = matches!(places[other.0], Placement::Hood(_));
                    if let Some(e) = unnamed_edge(panel, own.1).filter(|_| hood) {
                        rename(panel, k, e, &format!("crown_{crown}"));
                        crown += 1;
                    }
                }
            }
            _ => {}
        }
    }
}

/// Edge of a panel that still has its raw name.
fn unnamed_edge(panel: &Panel, raw_edge: usize) -> Option<usize> {
    panel.edge(&format!("edge_{raw_edge}"))
}

/// Anchors: the front shoulder seams of tops, the free upper edges of other garments, within `near_top` metres of their panels' tops.
fn anchors(panels: &[Panel], seams: &[Seam], trunk: bool, near_top: f64) -> Vec<Anchor> {
    if trunk {
        let edges = panels
            .iter()
            .filter(|p| p.placement == Placement::TrunkFront && p.edge("shoulder").is_some())
            .map(|p| [p.name.clone(), "shoulder".to_owned()])
            .collect();
        return vec![Anchor {
            name: "shoulders".into(),
            edges,
            strength: 0.5,
        }];
    }
    let mut edges = Vec::new();
    for p in panels {
        let top = p.edges.iter().map(|e| e.from[1]).fold(f64::MIN, f64::max);
        for (i, e) in p.edges.iter().enumerate() {
            let here = [p.name.clone(), e.name.clone()];
            let sewn = seams.iter().any(|s| s.a == here || s.b == here);
            if !sewn && e.from[1] > top - near_top && p.end(i)[1] > top - near_top {
                edges.push(here);
            }
        }
    }
    vec![Anchor {
        name: "waist".into(),
        edges,
        strength: 1.0,
    }]
}

/// Girths at chest, waist and hip, the sums of panel widths at these heights, metres; 0 without cloth.
fn girths(panels: &[Panel], trunk: bool, levels: [f64; 3]) -> [f64; 3] {
    let width = |p: &Panel, y: f64| {
        let points: Vec<[f64; 2]> = (0..p.edges.len())
            .flat_map(|i| p.edges[i].sample(p.end(i), 8).into_iter().take(8))
            .collect();
        let mut cuts: Vec<f64> = (0..points.len())
            .filter_map(|i| {
                let (a, b) = (points[i], points[(i + 1) % points.len()]);
                ((a[1] <= y) != (b[1] <= y))
                    .then(|| a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]))
            })
            .collect();
        cuts.sort_by(f64::total_cmp);
        cuts.chunks_exact(2).map(|c| c[1] - c[0]).sum::<f64>()
    };
    let around = |wanted: &dyn Fn(Placement) -> bool, y: f64| {
        panels
            .iter()
            .filter(|p| wanted(p.placement))
            .map(|p| width(p, y))
            .sum::<f64>()
    };
    let is_trunk = |p: Placement| matches!(p, Placement::TrunkFront | Placement::TrunkBack);
    let is_skirt = |p: Placement| matches!(p, Placement::SkirtFront | Placement::SkirtBack);
    let is_leg = |p: Placement| matches!(p, Placement::LegFront(_) | Placement::LegBack(_));
    let chest = if trunk {
        around(&is_trunk, levels[0])
    } else {
        0.0
    };
    let lower = |y: f64| around(&is_skirt, y).max(around(&is_leg, y));
    [chest, lower(levels[1]), lower(levels[2])]
}
