//! Tests of pieces: role, kind, layers and linings.

use super::*;
use crate::mesh_garment::file_part::{PartRole, carried};
use crate::mesh_garment::layers::by_layer;
use crate::mesh_garment::linings::linings;
use std::f32::consts::TAU;
use tryon_body::embedded;
use tryon_formats::{FaceOrigin, FaceOrigins, PartName};

/// An upright open tube around (0, 0) in the file's own coordinates.
fn tube(radius: f32, y: std::ops::Range<f32>) -> SewnObj {
    let (n, rows) = (48u32, 16u32);
    let vertices = (0..n * rows).map(|k| {
        let (a, t) = (TAU * (k % n) as f32 / n as f32, (k / n) as f32);
        let y = y.start + (y.end - y.start) * t / (rows - 1) as f32;
        P3::new(radius * a.sin(), y, radius * a.cos())
    });
    let faces = (0..n * (rows - 1)).flat_map(|k| {
        let (i, j) = (k % n, k / n);
        let at = |i: u32, j: u32| j * n + i % n;
        [
            [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
            [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
        ]
    });
    let mesh = TriMesh::new(vertices.collect(), faces.collect()).expect("a tube");
    SewnObj {
        obj: ObjMesh::from(mesh),
        stitches: Vec::new(),
    }
}

/// A part with a name in its file.
fn named(mut sewn: SewnObj, object: &str) -> SewnObj {
    let faces = sewn.obj.mesh.faces().len();
    sewn.obj.origins = FaceOrigins {
        parts: vec![PartName {
            object: object.into(),
            ..PartName::default()
        }],
        faces: vec![FaceOrigin::default(); faces],
    };
    sewn
}

fn with_builder(test: impl Fn(&PieceBuilder<'_>)) {
    let template = embedded::template();
    let settings = MeshGarmentSettings::with_edge(0.03);
    test(&PieceBuilder {
        classifier: &PieceClassifier::new(&template, &settings.classifier),
        name: "piece",
        material: &Material::preset("cotton").expect("preset"),
        settings: &settings,
    });
}

#[test]
fn a_tube_around_both_legs_is_a_skirt_held_at_its_upper_opening() {
    with_builder(|b| {
        let (piece, note) = b.cloth(0, tube(0.26, 0.45..1.0)).expect("cloth");
        let g = &piece.garment;
        assert_eq!(g.kind, GarmentKind::Skirt, "{note}");
        assert_eq!(g.anchors.len(), 1);
        assert_eq!(g.anchors[0].kind, AnchorKind::Band);
        let lowest = g.anchors[0].vertices.iter();
        let lowest = lowest
            .map(|v| piece.positions[*v as usize].y)
            .fold(9.0, f32::min);
        assert!(lowest > 0.95, "{lowest}");
        // Every vertex may touch both legs, and no arm.
        let all = Region::TRUNK.with(LEGS);
        assert!(g.regions.iter().filter(|r| **r == all).count() * 10 > 8 * g.vertices);
    });
}

#[test]
fn buttons_and_hats_are_no_cloth_and_become_one_rigid_piece() {
    with_builder(|b| {
        let (button, hat) = (tube(0.02, 1.2..1.22), tube(0.12, 1.62..1.8));
        assert_eq!(b.classifier.role(&button), PartRole::Fastening);
        assert_eq!(b.classifier.role(&hat), PartRole::Accessory);
        let skirt = tube(0.26, 0.45..1.0);
        assert_eq!(b.classifier.role(&skirt), PartRole::Cloth);
        // A flap of cloth, but for its name.
        let flap = tube(0.06, 0.9..1.0);
        assert_eq!(b.classifier.role(&flap), PartRole::Cloth);
        let named = named(flap, "Buckles");
        assert_eq!(b.classifier.role(&named), PartRole::Fastening);
        let said = carried(&[button.clone(), named], "fastening", "fastenings");
        let said = said.expect("two parts");
        assert!(said.starts_with("2 fastenings (`Buckles`) of"), "{said}");
        let rigid = b.rigid(&[button, hat]).expect("a mesh").expect("an area");
        assert!(rigid.is_rigid() && rigid.garment.vertices == 2 * 48 * 16);
        assert!(b.rigid(&[]).expect("nothing").is_none());
    });
}

/// 5 mm below another sheet lies a lining, 5 cm below another garment; a name is half of the evidence.
#[test]
fn cloth_close_below_other_cloth_is_its_lining() {
    with_builder(|b| {
        let piece = |sewn| b.cloth(0, sewn).expect("cloth").0;
        let shell = piece(tube(0.26, 0.5..1.0));
        let lining = |radius: f32, y: std::ops::Range<f32>, name: &str| {
            let pair = [piece(named(tube(radius, y), name)), shell.clone()];
            linings(&pair, &b.settings.lining)[0]
        };
        assert_eq!(lining(0.255, 0.55..0.98, ""), Some(1));
        assert_eq!(lining(0.21, 0.5..1.0, ""), None);
        // Two thirds of it are below the shell.
        assert_eq!(lining(0.255, 0.3..0.9, ""), None);
        assert_eq!(lining(0.255, 0.3..0.9, "Lining"), Some(1));
    });
}

#[test]
fn layers_are_ordered_from_the_skin_outwards() {
    with_builder(|b| {
        let piece = |r| b.cloth(0, tube(r, 0.5..1.0)).expect("cloth").0;
        let radius = |p: &GarmentPiece| p.positions[0].x.hypot(p.positions[0].z);
        let sorted = by_layer(vec![piece(0.34), piece(0.24), piece(0.29)]);
        let radii: Vec<f32> = sorted.iter().map(radius).collect();
        assert!(radii.windows(2).all(|w| w[0] < w[1]), "{radii:?}");
    });
}
