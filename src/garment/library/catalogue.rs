//! Garments by name.

use super::{LibraryCuts, dress, skirt, top, trims, trousers};
use crate::{GarmentError, Pattern, Size, size_table};

/// Names of all garments, in display order.
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

/// Default colour of a garment, sRGB; that of the first one for unknown names.
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

/// Drafts the pattern of a garment in a size.
///
/// # Errors
/// Unknown name; the known ones are listed.
pub fn pattern(name: &str, size: Size) -> Result<Pattern, GarmentError> {
    pattern_with(name, size, &LibraryCuts::default())
}

/// As [`pattern`], with other cuts.
///
/// # Errors
/// As [`pattern`], and a cut that closes no panel.
pub fn pattern_with(name: &str, size: Size, cuts: &LibraryCuts) -> Result<Pattern, GarmentError> {
    let row = size_table()[size as usize];
    let mut p = match name {
        "tshirt" => top::draft(&row, name, "jersey", &cuts.tshirt)?,
        "longsleeve" => top::draft(&row, name, "cotton", &cuts.longsleeve)?,
        "tank" => top::draft(&row, name, "jersey", &cuts.tank)?,
        "hoodie" => top::draft(&row, name, "fleece", &cuts.hoodie)?,
        "dress" => dress::flared(&row, &cuts.dress)?,
        "skirt" => skirt::flared(&row, &cuts.skirt)?,
        "straight_skirt" => skirt::straight(&row, &cuts.straight_skirt)?,
        "trousers" => trousers::draft(&row, name, "denim", &cuts.trousers)?,
        "shorts" => trousers::draft(&row, name, "twill", &cuts.shorts)?,
        _ => {
            return Err(GarmentError::UnknownGarment {
                name: name.to_owned(),
                known: names().join(", "),
            });
        }
    };
    p.trims = trims::of(name, &p.panels);
    p.check()?;
    Ok(p)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{GarmentMesh, Triangulation, rest_area};

    /// Smallest angle of the library's triangles at the default edge length, degrees; measured 22.9° (T-shirt M).
    const MIN_ANGLE: f64 = 20.0;

    #[test]
    fn every_garment_in_every_size_sews_into_a_manifold() {
        for name in names() {
            for size in Size::ALL {
                let p = pattern(name, size).expect("pattern");
                let m = GarmentMesh::sew(&p, &Triangulation::default())
                    .unwrap_or_else(|e| panic!("{name} {size}: {e}"));
                assert!(m.min_angle > MIN_ANGLE, "{name} {size}: {}", m.min_angle);
                assert!(m.rest.iter().all(|t| rest_area(t) > 0.0));
                // Euler characteristic: spheres with holes; four of a top, two of a skirt, three of trousers.
                let chi = m.vertices as i64 - m.topology().expect("manifold").edges().len() as i64
                    + m.faces.len() as i64;
                let holes = match *name {
                    "skirt" | "straight_skirt" => 2,
                    "trousers" | "shorts" => 3,
                    _ => 4,
                };
                assert_eq!(chi, 2 - holes, "{name} {size}");
            }
        }
    }

    #[test]
    fn json_round_trips_and_faults_are_named() {
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
