//! GarmentCode's sewing patterns (Korosteleva & Sorkine-Hornung 2023): `*_specification.json`, unprocessed.

use super::FormatError;
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Largest coordinate, metres.
const MAX_COORDINATE: f64 = 10.0;
/// Largest coordinate of a control point, in lengths of its edge.
const MAX_CONTROL: f64 = 100.0;

/// Shape of an edge in its own frame: x from its start (0) to its end (1), y to its left in the same unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RawCurve {
    /// Straight.
    Line,
    /// Quadratic Bézier with this control point.
    Quadratic([f64; 2]),
    /// Cubic Bézier with these control points.
    Cubic([f64; 2], [f64; 2]),
    /// Circular arc: radius in metres, longer arc, bulge to the right.
    Circle(f64, bool, bool),
}

/// Edge of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct RawEdge {
    /// Start and end vertex.
    pub ends: [usize; 2],
    /// Shape.
    pub curve: RawCurve,
}

/// Panel.
#[derive(Clone, Debug, PartialEq)]
pub struct RawPanel {
    /// Its name.
    pub name: String,
    /// Position of its origin beside the figure, metres (y up, z to the front).
    pub translation: [f64; 3],
    /// Euler angles about fixed x, y, z axes, degrees.
    pub rotation: [f64; 3],
    /// Corners, metres.
    pub vertices: Vec<[f64; 2]>,
    /// Edges; each starts at the end of the one before, in a closed loop.
    pub edges: Vec<RawEdge>,
}

/// Two edges that are sewn together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawStitch {
    /// `(panel, edge)` numbers of both.
    pub sides: [(usize, usize); 2],
    /// The right side of one fabric meets the wrong side of the other: the edges run the same way (`right_wrong`).
    pub wrong_side: bool,
}

/// Sewing pattern.
#[derive(Clone, Debug, PartialEq)]
pub struct RawPattern {
    /// Panels sorted by name.
    pub panels: Vec<RawPanel>,
    /// Seams.
    pub stitches: Vec<RawStitch>,
}

#[derive(Deserialize)]
struct JsonFile {
    pattern: JsonPattern,
    properties: JsonProperties,
}
#[derive(Deserialize)]
struct JsonPattern {
    panels: BTreeMap<String, JsonPanel>,
    stitches: Vec<Vec<Value>>,
}
#[derive(Deserialize)]
struct JsonProperties {
    units_in_meter: f64,
    curvature_coords: String,
}
#[derive(Deserialize)]
struct JsonPanel {
    translation: [f64; 3],
    #[serde(default)]
    rotation: [f64; 3],
    vertices: Vec<[f64; 2]>,
    edges: Vec<JsonEdge>,
}
#[derive(Deserialize)]
struct JsonEdge {
    endpoints: [usize; 2],
    curvature: Option<Value>,
}
#[derive(Deserialize)]
struct JsonStitch {
    panel: String,
    edge: usize,
}

/// True for the JSON text of a GarmentCode pattern (and not of this product).
pub fn is_garmentcode(text: &str) -> bool {
    serde_json::from_str::<Value>(text).is_ok_and(|v| {
        v.get("pattern")
            .is_some_and(|p| p.get("stitches").is_some())
    })
}

/// Parses pattern text; `origin` is named in errors.
///
/// # Errors
/// Syntax errors name line and column; faults name panel, edge or stitch.
pub fn parse_garmentcode(text: &str, origin: &Path) -> Result<RawPattern, FormatError> {
    let file: JsonFile = serde_json::from_str(text)
        .map_err(|e| FormatError::field(origin, "pattern", e.to_string()))?;
    let units = file.properties.units_in_meter;
    if !(units.is_finite() && units > 0.0) {
        return Err(FormatError::field(
            origin,
            "properties.units_in_meter",
            format!("{units} is no scale"),
        ));
    }
    if file.properties.curvature_coords != "relative" {
        let why = format!(
            "`{}`; only relative curvature is read",
            file.properties.curvature_coords
        );
        return Err(FormatError::field(
            origin,
            "properties.curvature_coords",
            why,
        ));
    }
    let panels = file.pattern.panels.into_iter();
    let panels = panels
        .map(|(name, p)| panel(name, p, units, origin))
        .collect::<Result<Vec<_>, _>>()?;
    let stitches = file.pattern.stitches.into_iter().enumerate();
    let stitches = stitches
        .map(|(k, sides)| stitch(k, sides, &panels, origin))
        .collect::<Result<_, _>>()?;
    Ok(RawPattern { panels, stitches })
}

/// Stitch `k`: panel and edge of both sides, and as a third entry `right_wrong` where the sides of the fabric differ.
fn stitch(
    k: usize,
    sides: Vec<Value>,
    panels: &[RawPanel],
    origin: &Path,
) -> Result<RawStitch, FormatError> {
    let fault = |what: &str, why: String| {
        FormatError::field(origin, format!("pattern.stitches[{k}]{what}"), why)
    };
    if sides.len() < 2 {
        return Err(fault("", format!("{} sides; 2 are sewn", sides.len())));
    }
    let wrong_side = match sides.get(2).map(Value::as_str) {
        None | Some(Some("right_right" | "")) => false,
        Some(Some("right_wrong")) => true,
        Some(_) => {
            let why = format!(
                "{} is no pair of fabric sides; `right_wrong` is known",
                sides[2]
            );
            return Err(fault("[2]", why));
        }
    };
    let mut pair = [(0, 0); 2];
    for (i, (slot, side)) in pair.iter_mut().zip(sides).enumerate() {
        let at = |why: String| fault(&format!("[{i}]"), why);
        let s: JsonStitch = serde_json::from_value(side).map_err(|e| at(e.to_string()))?;
        let p = panels
            .iter()
            .position(|p| p.name == s.panel)
            .ok_or_else(|| at(format!("there is no panel `{}`", s.panel)))?;
        let n = panels[p].edges.len();
        if s.edge >= n {
            let why = format!("panel `{}` has no edge {} (it has {n})", s.panel, s.edge);
            return Err(at(why));
        }
        *slot = (p, s.edge);
    }
    Ok(RawStitch {
        sides: pair,
        wrong_side,
    })
}

fn panel(name: String, p: JsonPanel, units: f64, origin: &Path) -> Result<RawPanel, FormatError> {
    let fault = |what: String, why: String| {
        FormatError::field(origin, format!("pattern.panels.{name}{what}"), why)
    };
    let metres = |v: f64| v / units;
    let good = |v: f64| v.abs() <= MAX_COORDINATE;
    let translation = p.translation.map(metres);
    if !translation.iter().all(|v| good(*v)) || !p.rotation.iter().all(|a| a.is_finite()) {
        return Err(fault(
            ".translation".into(),
            "not finite or too far away".into(),
        ));
    }
    let vertices: Vec<[f64; 2]> = p.vertices.iter().map(|v| v.map(metres)).collect();
    if let Some(k) = vertices.iter().position(|v| !v.iter().all(|c| good(*c))) {
        return Err(fault(
            format!(".vertices[{k}]"),
            format!("{:?} is not within {MAX_COORDINATE} m", vertices[k]),
        ));
    }
    let n = p.edges.len();
    if n < 3 {
        return Err(fault(
            ".edges".into(),
            format!("{n} edges; an outline needs at least 3"),
        ));
    }
    let mut edges: Vec<RawEdge> = Vec::with_capacity(n);
    for (k, e) in p.edges.iter().enumerate() {
        let at = |why: String| fault(format!(".edges[{k}]"), why);
        if let Some(v) = e.endpoints.iter().find(|v| **v >= vertices.len()) {
            return Err(at(format!(
                "vertex {v} does not exist (there are {})",
                vertices.len()
            )));
        }
        let next = &p.edges[(k + 1) % n];
        if e.endpoints[1] != next.endpoints[0] {
            let (a, b) = (e.endpoints[1], next.endpoints[0]);
            return Err(at(format!(
                "it ends in vertex {a}, but the next edge starts in vertex {b}"
            )));
        }
        let curve = e
            .curvature
            .as_ref()
            .map_or(Ok(RawCurve::Line), |c| curve(c, units))
            .map_err(at)?;
        edges.push(RawEdge {
            ends: e.endpoints,
            curve,
        });
    }
    Ok(RawPanel {
        translation,
        rotation: p.rotation,
        vertices,
        edges,
        name,
    })
}

fn curve(value: &Value, units: f64) -> Result<RawCurve, String> {
    if value.is_null() {
        return Ok(RawCurve::Line);
    }
    let point = |v: &Value| -> Result<[f64; 2], String> {
        let p: [f64; 2] =
            serde_json::from_value(v.clone()).map_err(|e| format!("curvature: {e}"))?;
        if p.iter().all(|c| c.abs() < MAX_CONTROL) {
            Ok(p)
        } else {
            Err(format!("control point {p:?} is out of range"))
        }
    };
    // Older form: a bare control point.
    if value.is_array() {
        return point(value).map(RawCurve::Quadratic);
    }
    let kind = value.get("type").and_then(Value::as_str).unwrap_or("");
    let params = value
        .get("params")
        .and_then(Value::as_array)
        .ok_or("curvature has no params")?;
    let number = |k: usize| params.get(k).and_then(Value::as_f64);
    match (kind, params.as_slice()) {
        ("quadratic", [a]) => point(a).map(RawCurve::Quadratic),
        ("cubic", [a, b]) => Ok(RawCurve::Cubic(point(a)?, point(b)?)),
        ("circle", [_, _, _]) => match (number(0), number(1), number(2)) {
            (Some(r), Some(large), Some(right)) if r.is_finite() && r > 0.0 => {
                Ok(RawCurve::Circle(r / units, large != 0.0, right != 0.0))
            }
            _ => Err("a circle needs a radius and two flags".into()),
        },
        _ => Err(format!(
            "curvature `{kind}` with {} parameters is not known",
            params.len()
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = r#"{"pattern":{"panels":{"a":{"translation":[0,0,10],"vertices":[[0,0],[50,0],[50,50],[0,50]],
        "edges":[{"endpoints":[0,1]},{"endpoints":[1,2],"curvature":{"type":"circle","params":[30,0,1]}},
        {"endpoints":[2,3],"curvature":[0.5,0.1]},{"endpoints":[3,0]}]}},
        "stitches":[[{"panel":"a","edge":1},{"panel":"a","edge":3}]]},
        "properties":{"units_in_meter":100,"curvature_coords":"relative"}}"#;

    fn parse(text: &str) -> Result<RawPattern, String> {
        parse_garmentcode(text, Path::new("p.json")).map_err(|e| e.to_string())
    }

    #[test]
    fn centimetres_become_metres_and_curves_read() {
        let p = parse(SQUARE).expect("valid");
        assert_eq!(p.panels[0].vertices[2], [0.5, 0.5]);
        assert_eq!(
            p.panels[0].edges[1].curve,
            RawCurve::Circle(0.3, false, true)
        );
        assert_eq!(p.panels[0].edges[2].curve, RawCurve::Quadratic([0.5, 0.1]));
        let sewn = RawStitch {
            sides: [(0, 1), (0, 3)],
            wrong_side: false,
        };
        assert_eq!(p.stitches, [sewn]);
        assert!(is_garmentcode(SQUARE) && !is_garmentcode("{}"));
    }

    #[test]
    fn faults_name_panel_edge_and_stitch() {
        let e = parse(&SQUARE.replace("[2,3]", "[2,9]")).expect_err("vertex");
        assert!(
            e.contains("panels.a.edges[2]") && e.contains("vertex 9"),
            "{e}"
        );
        let e = parse(&SQUARE.replace("[2,3]", "[3,2]")).expect_err("loop");
        assert!(
            e.contains("edges[1]") && e.contains("next edge starts in vertex 3"),
            "{e}"
        );
        let e = parse(&SQUARE.replace(r#""edge":3"#, r#""edge":7"#)).expect_err("stitch");
        assert!(
            e.contains("stitches[0][1]") && e.contains("no edge 7"),
            "{e}"
        );
        let e = parse(&SQUARE.replace("[50,50]", "[50,5e9]")).expect_err("far");
        assert!(e.contains("vertices[2]"), "{e}");
        for cut in 0..SQUARE.len() {
            assert!(parse(&SQUARE[..cut]).is_err(), "cut at {cut}");
        }
    }
}
