//! Meshes as exporters write them.

use crate::common::arms_down;
use std::fmt::Write as _;
use std::path::Path;
use tryon::body::{BodyShape, embedded};
use tryon::dressing::{DressOptions, dress};
use tryon::formats::obj::write_obj;
use tryon::formats::scan::read_scan;
use tryon::formats::shared_data;
use tryon::garment::import::{MeshFile, read_mesh, split};
use tryon::garment::{Size, library};
use tryon::geometry::mesh::Topology;

/// Garment mesh of a report; `None` without the shared data.
fn report(name: &str) -> Option<MeshFile> {
    let path = shared_data(format!("reports/{name}"))?;
    Some(read_mesh(&path, None).unwrap_or_else(|e| panic!("{e}")))
}

/// Vertices, faces and connected pieces; the surface is manifold and oriented.
fn counts(file: &MeshFile) -> [usize; 3] {
    let mesh = &file.sewn.obj.mesh;
    let topology = Topology::new(mesh).expect("oriented and manifold");
    [
        mesh.vertices().len(),
        mesh.faces().len(),
        topology.components().1,
    ]
}

#[test]
fn obj_text_in_every_encoding_and_layout_is_a_square() {
    for name in ["utf16", "cr_only", "continued", "repeat"] {
        let Some(file) = report(&format!("obj_text/{name}.obj")) else {
            return;
        };
        assert_eq!(counts(&file), [4, 2, 1], "{name}");
        assert!((file.sewn.obj.mesh.area() - 1.0).abs() < 1e-6, "{name}");
        let said = file.notes.join("; ");
        let is_said = said.contains("left out (line 7)");
        assert_eq!(is_said, name == "repeat", "{name}: {said}");
    }
}

#[test]
fn obj_text_is_a_scan_too() {
    let Some(folder) = shared_data("reports/obj_text") else {
        return;
    };
    for name in ["utf16", "cr_only", "continued", "repeat"] {
        let scan = read_scan(&folder.join(format!("{name}.obj"))).expect("readable");
        assert_eq!((scan.points.len(), scan.faces.len()), (4, 2), "{name}");
    }
}

#[test]
fn text_without_faces_is_an_error_in_words() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("written");
        path
    };
    let e = read_mesh(&at("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"), None);
    let e = e.expect_err("no faces").to_string();
    assert!(
        e.contains("points.obj") && e.contains("3 vertices (`v`) and 0 faces (`f`)"),
        "{e}"
    );
    let stl = at("stl.obj", "solid cube\n facet normal 0 0 1\n  outer loop\n");
    for e in [read_mesh(&stl, None).err(), read_scan(&stl).err()] {
        let e = e.expect("no mesh").to_string();
        assert!(e.contains("0 vertices") && e.contains("`solid`"), "{e}");
    }
}

#[test]
fn three_faces_on_an_edge_are_split_and_said() {
    let Some(file) = report("obj_nonmanifold/three_faces.obj") else {
        return;
    };
    assert_eq!(counts(&file), [7, 3, 2]);
    let said = file.notes.join("; ");
    assert!(
        said.contains("1 edge with more than two faces split (line 8)"),
        "{said}"
    );
    let largest = &split(&file.sewn)[0].obj.mesh;
    assert!(
        (largest.area() - 1.0).abs() < 1e-6,
        "the flat square stays whole"
    );
}

#[test]
fn quantised_positions_are_a_unit_square() {
    let Some(file) = report("gltf_quantised/u16.glb") else {
        return;
    };
    assert_eq!(counts(&file), [4, 2, 1]);
    let (low, high) = file.sewn.obj.mesh.bounds().expect("vertices");
    assert!(low.coords.norm() < 1e-6 && (high.coords - low.coords).norm() - 2f32.sqrt() < 1e-6);
    assert!((file.sewn.obj.mesh.area() - 1.0).abs() < 1e-5);
}

#[test]
fn strips_and_lists_have_all_their_triangles() {
    let Some(file) = report("gltf_triangle_strip/quad_and_strip.glb") else {
        return;
    };
    assert_eq!(counts(&file), [6, 4, 1]);
    assert!((file.sewn.obj.mesh.area() - 2.0).abs() < 1e-6);
}

/// A worn T-shirt as one surface and as loose triangles, numbers of six digits.
#[test]
fn loose_triangles_of_a_shirt_are_one_shirt() {
    let template = embedded::template();
    let rest = template.personalise(&BodyShape::default());
    let pose = arms_down(&template, &rest);
    let pattern = library::pattern("tshirt", Size::M).expect("a pattern");
    let options = DressOptions {
        any_size: true,
        ..DressOptions::default()
    };
    let dressed = dress(&template, &rest, &pose, &[pattern], &options).expect("dressed");
    let (garment, x) = (
        &dressed.model.outfit.garments[0],
        &dressed.state.garments[0].positions,
    );

    let folder = tempfile::tempdir().expect("a folder");
    let [whole, soup] = ["whole.obj", "soup.obj"].map(|name| folder.path().join(name));
    write_obj(&whole, x, &garment.faces, None).expect("written");
    let mut text = String::new();
    for p in garment.faces.iter().flatten().map(|v| x[*v as usize]) {
        writeln!(text, "v {:.6} {:.6} {:.6}", p.x, p.y, p.z).expect("a string");
    }
    for k in 0..garment.faces.len() {
        writeln!(text, "f {} {} {}", 3 * k + 1, 3 * k + 2, 3 * k + 3).expect("a string");
    }
    std::fs::write(&soup, text).expect("written");

    let read = |path: &Path| read_mesh(path, None).expect("readable");
    let (whole, soup) = (read(&whole), read(&soup));
    assert_eq!(counts(&soup), counts(&whole));
    assert_eq!(counts(&soup)[0], garment.vertices);
    let areas = [&whole, &soup].map(|f| f.sewn.obj.mesh.area());
    assert!((areas[0] / areas[1] - 1.0).abs() < 1e-4, "{areas:?}");
    let said = soup.notes.join("; ");
    let joined = 3 * garment.faces.len() - garment.vertices;
    assert!(
        said.contains(&format!("{joined} vertices joined")),
        "{said}"
    );
}
