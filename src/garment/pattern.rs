//! A sewing pattern: flat panels, seams, darts and anchors.

use super::{Curve, GarmentError, MAX_TRIMS, Material, PanelEdge, Size, Trim};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Kind of garment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GarmentKind {
    /// Covers the trunk, supported by the shoulders.
    Top,
    /// Supported by the waist, one tube.
    Skirt,
    /// Supported by the waist, two tubes.
    Trousers,
    /// Covers trunk and hips, supported by the shoulders.
    Dress,
}

/// Side of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The body's left, +x.
    Left,
    /// The body's right, −x.
    Right,
}

/// Place of a panel on the body. Panels are drawn as seen from outside the garment, y up along the grain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Placement {
    /// Front of the trunk: panel x is the body's left, y = 0 at the high point of the shoulder.
    TrunkFront,
    /// Back of the trunk: panel x is the body's right, y = 0 at the high point of the shoulder.
    TrunkBack,
    /// Around an arm: x = 0 on top of the arm and positive to the back on the left arm (to the front on the
    /// right), y = 0 at the shoulder, falling towards the hand.
    Sleeve(Side),
    /// Front of a skirt: panel x is the body's left, y = 0 at the waist.
    SkirtFront,
    /// Back of a skirt: panel x is the body's right, y = 0 at the waist.
    SkirtBack,
    /// Front of a trouser leg: y = 0 at the waist. For the left leg the outer side is +x; for the right, −x.
    LegFront(Side),
    /// Back of a trouser leg: y = 0 at the waist, mirrored against the front.
    LegBack(Side),
    /// Half of a hood: y = 0 at the high point of the shoulder; x = 0 at the nape, running to the face on the right
    /// half and away from it on the left.
    Hood(Side),
    /// Stands on the neckline that it is sewn to. Any coordinates.
    Collar,
}

/// Flat piece of cloth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Name, unique in the pattern.
    pub name: String,
    /// Place on the body.
    pub placement: Placement,
    /// Part of the turn around its body part that its rows cover, from their lowest to their highest x, radians. Around the
    /// hips 0 is in front and π/2 on the left; around an arm 0 is on top, as in the placement. Without it the placement says
    /// it; a panel around the hips beside others that have one is an insert between them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sector: Option<[f64; 2]>,
    /// Closed outline, counter-clockwise seen from outside.
    pub edges: Vec<PanelEdge>,
}

impl Panel {
    /// End corner of edge `i`.
    pub fn end(&self, i: usize) -> [f64; 2] {
        self.edges[(i + 1) % self.edges.len()].from
    }
    /// Index of an edge by name.
    pub fn edge(&self, name: &str) -> Option<usize> {
        self.edges.iter().position(|e| e.name == name)
    }
}

/// Two edges sewn together from end to end.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Seam {
    /// Panel and edge of one side.
    pub a: [String; 2],
    /// Panel and edge of the other side.
    pub b: [String; 2],
    /// The start of `a` meets the end of `b`, as between two outlines of the same orientation.
    #[serde(default = "yes")]
    pub reversed: bool,
}

/// A wedge taken out of a panel: two neighbouring edges from its mouth to its tip and back, sewn together.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dart {
    /// Panel name.
    pub panel: String,
    /// Edges; the first ends and the second starts at the tip.
    pub edges: [String; 2],
}

fn yes() -> bool {
    true
}

/// Edges attached to the body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Anchor {
    /// Name: `shoulders`, `waist`.
    pub name: String,
    /// Panel and edge names.
    pub edges: Vec<[String; 2]>,
    /// Strength, 0 to 1; 1 fixes a vertex to its place on the body.
    pub strength: f64,
}

/// Panel and edge of one side, of the other, and true if they run against each other.
pub(super) type EdgePair = ((usize, usize), (usize, usize), bool);

/// Sewing pattern of a garment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pattern {
    /// Garment name, as in the library.
    pub name: String,
    /// Kind of garment.
    pub kind: GarmentKind,
    /// Letter size.
    pub size: Size,
    /// Pieces.
    pub panels: Vec<Panel>,
    /// Seams.
    pub seams: Vec<Seam>,
    /// Darts.
    #[serde(default)]
    pub darts: Vec<Dart>,
    /// Pockets, buttons and other pieces of the look, at most [`MAX_TRIMS`](super::MAX_TRIMS).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub trims: Vec<Trim>,
    /// Anchors.
    pub anchors: Vec<Anchor>,
    /// Fabric.
    pub material: Material,
    /// Order on the body, 0 innermost.
    pub layer: u8,
    /// Girth of the finished garment at chest, waist and hip, metres; 0 if it has none. For size advice.
    pub finished: [f64; 3],
}

impl Pattern {
    /// Parses a pattern as JSON and checks it.
    ///
    /// # Errors
    /// Syntax errors name line and column; faults name panel, edge or seam.
    pub fn from_json(text: &str) -> Result<Self, GarmentError> {
        let p: Self = serde_json::from_str(text).map_err(|e| GarmentError::Field {
            field: "pattern".into(),
            why: e.to_string(),
        })?;
        p.check()?;
        Ok(p)
    }
    /// The pattern as JSON.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }
    /// Pairs of edges that are sewn: seams, then darts.
    pub(super) fn sewn(&self) -> Vec<EdgePair> {
        let seams = self
            .seams
            .iter()
            .filter_map(|s| Some((self.find(&s.a)?, self.find(&s.b)?, s.reversed)));
        let dart = |d: &Dart, k: usize| self.find(&[d.panel.clone(), d.edges[k].clone()]);
        seams
            .chain(
                self.darts
                    .iter()
                    .filter_map(|d| Some((dart(d, 0)?, dart(d, 1)?, true))),
            )
            .collect()
    }
    /// Panel and edge numbers of a `[panel, edge]` reference.
    pub(super) fn find(&self, reference: &[String; 2]) -> Option<(usize, usize)> {
        let p = self.panels.iter().position(|p| p.name == reference[0])?;
        Some((p, self.panels[p].edge(&reference[1])?))
    }
    /// Checks names, outlines, seams and anchors.
    ///
    /// # Errors
    /// Names the panel, edge or seam at fault.
    pub fn check(&self) -> Result<(), GarmentError> {
        self.material.check()?;
        if self.trims.len() > MAX_TRIMS {
            return Err(GarmentError::Field {
                field: "trims".into(),
                why: format!("{}, at most {MAX_TRIMS}", self.trims.len()),
            });
        }
        let has_panel = |name: &str| self.panels.iter().any(|p| p.name == name);
        (self.trims.iter()).try_for_each(|t| t.check(has_panel))?;
        if self.panels.is_empty() {
            return Err(GarmentError::Field {
                field: "panels".into(),
                why: "a garment needs at least one".into(),
            });
        }
        for (i, p) in self.panels.iter().enumerate() {
            if let Some(s) = p
                .sector
                .filter(|[a, b]| !(b - a > 0.0 && b - a <= WHOLE_TURN))
            {
                return Err(GarmentError::Panel {
                    panel: p.name.clone(),
                    why: format!("its sector {s:?} is no part of a turn (radians)"),
                });
            }
            if self.panels[..i].iter().any(|o| o.name == p.name) {
                return Err(GarmentError::Panel {
                    panel: p.name.clone(),
                    why: "the name is used twice".into(),
                });
            }
            check_outline(p)?;
        }
        let mut sewn = BTreeSet::new();
        for (seam, s) in self.seams.iter().enumerate() {
            self.check_seam(seam, s, &mut sewn)?;
        }
        for d in &self.darts {
            self.check_dart(d, &mut sewn)?;
        }
        self.anchors.iter().try_for_each(|a| self.check_anchor(a))
    }

    fn check_seam(
        &self,
        seam: usize,
        s: &Seam,
        sewn: &mut BTreeSet<(usize, usize)>,
    ) -> Result<(), GarmentError> {
        for r in [&s.a, &s.b] {
            let fault = |why: String| GarmentError::Seam { seam, why };
            let at = self.find(r).ok_or_else(|| fault(missing(r)))?;
            if !sewn.insert(at) {
                let why = format!("edge `{}` of panel `{}` is sewn twice", r[1], r[0]);
                return Err(fault(why));
            }
        }
        Ok(())
    }

    fn check_dart(
        &self,
        d: &Dart,
        sewn: &mut BTreeSet<(usize, usize)>,
    ) -> Result<(), GarmentError> {
        let fault = |edge: &str, why: &str| GarmentError::Edge {
            panel: d.panel.clone(),
            edge: edge.to_owned(),
            why: why.to_owned(),
        };
        let mut at = [(0, 0); 2];
        for (k, e) in d.edges.iter().enumerate() {
            at[k] = self
                .find(&[d.panel.clone(), e.clone()])
                .ok_or_else(|| fault(e, "a dart names it, but it does not exist"))?;
            if !sewn.insert(at[k]) {
                return Err(fault(e, "it is sewn twice"));
            }
        }
        let p = &self.panels[at[0].0];
        let [first, second] = &d.edges;
        if (at[0].1 + 1) % p.edges.len() != at[1].1 {
            let why = format!("a dart's second edge must follow its first, `{first}`");
            return Err(fault(second, &why));
        }
        let [a, b] = [at[0].1, at[1].1].map(|i| p.edges[i].length(p.end(i)));
        if (a - b).abs() > DART_MISMATCH * a.max(b) {
            let why = format!("the dart's sides are {a:.3} and {b:.3} m long");
            return Err(fault(second, &why));
        }
        Ok(())
    }

    fn check_anchor(&self, a: &Anchor) -> Result<(), GarmentError> {
        let fault = |part: &str, why: String| {
            let field = format!("anchor `{}`{part}", a.name);
            Err(GarmentError::Field { field, why })
        };
        if let Some(r) = a.edges.iter().find(|r| self.find(r).is_none()) {
            return fault("", missing(r));
        }
        if !(0.0..=1.0).contains(&a.strength) {
            return fault(
                ".strength",
                format!("{} is not between 0 and 1", a.strength),
            );
        }
        Ok(())
    }
}

fn missing(reference: &[String; 2]) -> String {
    let [panel, edge] = reference;
    format!("there is no edge `{edge}` in a panel `{panel}`")
}

/// Largest relative difference between the two sides of a dart: more puckers.
const DART_MISMATCH: f64 = 0.05;
/// Largest sector, radians.
const WHOLE_TURN: f64 = std::f64::consts::TAU;
/// Shortest edge, metres: below it two corners are the same stitch.
const SHORTEST_EDGE: f64 = 1e-3;
/// Segments of a curved edge in the crossing test.
const CURVE_PIECES: usize = 24;
/// Largest coordinate of a panel, metres.
const LARGEST_COORDINATE: f64 = 10.0;

/// Checks that an outline is simple and counter-clockwise, with unique names and edges of usable length.
fn check_outline(p: &Panel) -> Result<(), GarmentError> {
    let panel = |why: &str| GarmentError::Panel {
        panel: p.name.clone(),
        why: why.to_owned(),
    };
    let edge = |i: usize, why: String| GarmentError::Edge {
        panel: p.name.clone(),
        edge: p.edges[i].name.clone(),
        why,
    };
    if p.edges.len() < 3 {
        return Err(panel("an outline needs at least three edges"));
    }
    let mut outline: Vec<(usize, [f64; 2])> = Vec::new();
    for (i, e) in p.edges.iter().enumerate() {
        if p.edges[..i].iter().any(|o| o.name == e.name) {
            return Err(edge(i, "the name is used twice".into()));
        }
        let points = e.sample(
            p.end(i),
            if e.curve == Curve::Line {
                1
            } else {
                CURVE_PIECES
            },
        );
        if points
            .iter()
            .flatten()
            .any(|c| !(c.abs() <= LARGEST_COORDINATE))
        {
            return Err(edge(
                i,
                format!("a coordinate is not finite or beyond {LARGEST_COORDINATE} m"),
            ));
        }
        if e.length(p.end(i)) < SHORTEST_EDGE {
            return Err(edge(i, format!("it is shorter than {SHORTEST_EDGE} m")));
        }
        outline.extend(points[..points.len() - 1].iter().map(|q| (i, *q)));
    }
    if let Some((i, j)) = crossing(&outline) {
        return Err(edge(i, format!("it crosses edge `{}`", p.edges[j].name)));
    }
    let n = outline.len();
    let area: f64 = (0..n)
        .map(|i| {
            let (p, q) = (outline[i].1, outline[(i + 1) % n].1);
            0.5 * (p[0] * q[1] - p[1] * q[0])
        })
        .sum();
    if area <= 0.0 {
        return Err(panel("the outline must run counter-clockwise"));
    }
    Ok(())
}

/// Two edges of a closed outline that cross. Each point has the number of its edge.
fn crossing(outline: &[(usize, [f64; 2])]) -> Option<(usize, usize)> {
    let n = outline.len();
    let cross = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    for i in 0..n {
        let ((ei, a), (_, b)) = (outline[i], outline[(i + 1) % n]);
        for j in i + 2..n {
            if i == 0 && j == n - 1 {
                continue;
            }
            let ((ej, c), (_, d)) = (outline[j], outline[(j + 1) % n]);
            let apart =
                (0..2).any(|k| a[k].max(b[k]) < c[k].min(d[k]) || c[k].max(d[k]) < a[k].min(b[k]));
            if !apart
                && cross(a, b, c) * cross(a, b, d) <= 0.0
                && cross(c, d, a) * cross(c, d, b) <= 0.0
            {
                return Some((ei, ej));
            }
        }
    }
    None
}
