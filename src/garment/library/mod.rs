//! The garments we draw ourselves.

mod dress;
mod skirt;
mod top;
mod trousers;

use super::{Curve, GarmentError, Panel, PanelEdge, Pattern, Placement, Seam, Size, size_table};

/// Names of all garments, in the order to show them.
pub fn names() -> &'static [&'static str] {
    &[
        "tshirt",
        "longsleeve",
        "tank",
        "hoodie",
        "dress",
        "skirt",
        "straight_skirt",
        "trousers",
        "shorts",
    ]
}

/// Colour a garment is shown in unless another is chosen, sRGB. Unknown names get the first.
pub fn dye(name: &str) -> [u8; 3] {
    const DYES: [[u8; 3]; 9] = [
        [0xd9, 0xd0, 0xbf],
        [0x5b, 0x75, 0x66],
        [0xb8, 0x5c, 0x3f],
        [0x6e, 0x74, 0x80],
        [0x3f, 0x62, 0x8f],
        [0x8c, 0x3a, 0x4a],
        [0x4a, 0x44, 0x4f],
        [0x34, 0x3c, 0x52],
        [0x9a, 0x88, 0x66],
    ];
    names()
        .iter()
        .position(|n| *n == name)
        .map_or(DYES[0], |i| DYES[i])
}

/// Draws the pattern of a garment in a size.
///
/// # Errors
/// Unknown name; the known ones are listed.
pub fn pattern(name: &str, size: Size) -> Result<Pattern, GarmentError> {
    let row = size_table()[size as usize];
    let p = match name {
        "tshirt" => top::tshirt(&row)?,
        "longsleeve" => top::longsleeve(&row)?,
        "tank" => top::tank(&row)?,
        "hoodie" => top::hoodie(&row)?,
        "dress" => dress::flared(&row)?,
        "skirt" => skirt::flared(&row)?,
        "straight_skirt" => skirt::straight(&row)?,
        "trousers" => trousers::long(&row)?,
        "shorts" => trousers::shorts(&row)?,
        _ => {
            return Err(GarmentError::UnknownGarment {
                name: name.to_owned(),
                known: names().join(", "),
            });
        }
    };
    p.check()?;
    Ok(p)
}

/// A panel from corners `(edge name, start corner, curve)`.
fn panel(name: &str, placement: Placement, edges: &[(&str, [f64; 2], Curve)]) -> Panel {
    Panel {
        name: name.to_owned(),
        placement,
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

/// The panel mirrored at x = 0, outline again counter-clockwise; edge names stay with their edges.
fn mirrored(p: &Panel, name: &str, placement: Placement) -> Panel {
    let flip = |q: [f64; 2]| [-q[0], q[1]];
    let n = p.edges.len();
    let edges = (0..n)
        .rev()
        .map(|i| PanelEdge {
            name: p.edges[i].name.clone(),
            from: flip(p.end(i)),
            curve: match p.edges[i].curve {
                Curve::Line => Curve::Line,
                Curve::Cubic(a, b) => Curve::Cubic(flip(b), flip(a)),
            },
        })
        .collect();
    Panel {
        name: name.to_owned(),
        placement,
        edges,
    }
}

fn sewn(a: [&str; 2], b: [&str; 2]) -> Seam {
    Seam {
        a: a.map(str::to_owned),
        b: b.map(str::to_owned),
        reversed: true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::garment::{GarmentMesh, Triangulation};

    /// Smallest angle of the library's triangles at the default edge length, degrees; measured 22.9° (T-shirt M).
    const MIN_ANGLE: f64 = 20.0;

    #[test]
    fn every_garment_in_every_size_sews_into_a_sound_mesh() {
        for name in names() {
            for size in Size::ALL {
                let p = pattern(name, size).expect("pattern");
                let m = GarmentMesh::sew(&p, &Triangulation::default())
                    .unwrap_or_else(|e| panic!("{name} {size}: {e}"));
                let rims = m
                    .topology()
                    .expect("manifold")
                    .edges()
                    .iter()
                    .filter(|e| e.twin.is_none())
                    .count();
                eprintln!(
                    "{name} {size}: {} vertices, {} faces, min angle {:.1}, rim edges {rims}",
                    m.vertices,
                    m.faces.len(),
                    m.min_angle
                );
                assert!(m.min_angle > MIN_ANGLE, "{name} {size}: {}", m.min_angle);
                assert!(m.rest.iter().all(|t| crate::garment::mesh_area(t) > 0.0));
                // Euler characteristic: tops are spheres with neck, hem and two sleeve openings; skirts tubes;
                // trousers a sphere with three holes.
                let chi = m.vertices as i64 - m.topology().expect("manifold").edges().len() as i64
                    + m.faces.len() as i64;
                let holes = match *name {
                    "skirt" | "straight_skirt" => 2, // tubes
                    "trousers" | "shorts" => 3,
                    "hoodie" | "dress" | "tank" => 4,
                    _ => 4,
                };
                assert_eq!(chi, 2 - holes, "{name} {size}");
            }
        }
    }

    #[test]
    fn json_round_trip_and_named_faults() {
        let p = pattern("tshirt", Size::M).expect("pattern");
        let back = Pattern::from_json(&p.to_json()).expect("round trip");
        let (a, b) = (&p.panels[0].edges[2], &back.panels[0].edges[2]);
        assert!((a.from[1] - b.from[1]).abs() < 1e-12 && a.name == b.name);
        assert_eq!(
            (back.seams, back.anchors, back.size),
            (p.seams.clone(), p.anchors.clone(), p.size)
        );
        let mut q = p.clone();
        q.seams[0].b[1] = "nowhere".into();
        assert!(q.check().expect_err("seam").to_string().contains("nowhere"));
        let mut q = p.clone();
        q.panels[0].edges[1].from = [3.0, 3.0];
        let e = q.check().expect_err("crossing").to_string();
        assert!(e.contains("front") && e.contains("crosses"), "{e}");
        let mut q = p.clone();
        q.panels[1].edges[0].from[0] = f64::NAN;
        assert!(matches!(q.check(), Err(GarmentError::Edge { .. })));
        assert!(matches!(
            pattern("cape", Size::M),
            Err(GarmentError::UnknownGarment { .. })
        ));
    }
}
