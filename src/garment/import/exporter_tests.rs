//! Meshes as exporters write them, of one tube: `testdata/meshes/make_meshes.py` writes them by the trade's own libraries.

use super::file::read_mesh;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;
use tryon_geometry::mesh::Topology;

/// Content of a file.
#[derive(Deserialize)]
struct ExpectedMesh {
    /// Area (m²) and bounds (m).
    area: f64,
    low: [f32; 3],
    high: [f32; 3],
    faces: usize,
    pieces: usize,
    /// Relative tolerance of the area, and that of the bounds (m).
    tolerance: Option<f64>,
    /// Words of a note.
    note: Option<String>,
    /// Thickness of the cloth, m.
    thickness: Option<f32>,
    /// Names of parts with faces.
    #[serde(default)]
    parts: Vec<String>,
    /// The faces' normals point outward.
    #[serde(default)]
    outward: bool,
}

#[test]
fn a_tube_is_the_same_however_it_is_written() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/meshes");
    let text = std::fs::read_to_string(folder.join("expected.json")).expect("a committed file");
    let all: BTreeMap<String, ExpectedMesh> = serde_json::from_str(&text).expect("valid");
    assert_eq!(all.len(), 18);
    for (name, wanted) in all {
        let file = read_mesh(&folder.join(&name), None).unwrap_or_else(|e| panic!("{e}"));
        let mesh = &file.sewn.obj.mesh;
        let topology = Topology::new(mesh).expect("oriented and manifold");
        assert_eq!(mesh.faces().len(), wanted.faces, "{name}");
        assert_eq!(topology.components().1, wanted.pieces, "{name}");
        let tolerance = wanted.tolerance.unwrap_or(1e-4);
        let area = mesh.area();
        assert!(
            (area / wanted.area - 1.0).abs() < tolerance,
            "{name}: {area}"
        );
        let (low, high) = mesh.bounds().expect("vertices");
        for k in 0..3 {
            let off = (low[k] - wanted.low[k])
                .abs()
                .max((high[k] - wanted.high[k]).abs());
            assert!(f64::from(off) < tolerance, "{name}: {low} to {high}");
        }

        let said = file.notes.join("; ");
        assert!(
            said.contains(&wanted.note.unwrap_or_default()),
            "{name}: {said}"
        );
        let counts = file.sewn.obj.origins.counts();
        let parts: Vec<String> = counts.iter().map(|(part, _)| part.to_string()).collect();
        assert!(
            wanted.parts.is_empty() || parts == wanted.parts,
            "{name}: {parts:?}"
        );
        assert!(!wanted.outward || mesh.volume() > 0.0, "{name}: inside out");
        match (file.thickness, wanted.thickness) {
            (None, None) => {}
            (Some(t), Some(w)) => assert!((t / w - 1.0).abs() < 0.01, "{name}: {t} for {w}"),
            other => panic!("{name}: thickness {other:?}"),
        }
    }
}

#[test]
fn damaged_files_never_panic() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("testdata/meshes");
    let scratch = tempfile::tempdir().expect("a folder");
    let mut x = 0x9e37_79b9u32;
    let mut random = |n: usize| {
        x ^= x << 13;
        x ^= x >> 17;
        x ^= x << 5;
        x as usize % n
    };
    for entry in std::fs::read_dir(&folder).expect("a folder").flatten() {
        let name = entry.file_name();
        let bytes = std::fs::read(entry.path()).expect("readable");
        let path = scratch.path().join(&name);
        for _ in 0..200 {
            let mut damaged = bytes.clone();
            for _ in 0..1 + random(4) {
                // Bytes of the file itself keep numbers numbers and base64 base64.
                damaged[random(bytes.len())] = bytes[random(bytes.len())];
            }
            std::fs::write(&path, damaged).expect("written");
            if let Ok(file) = read_mesh(&path, None) {
                assert!(Topology::new(&file.sewn.obj.mesh).is_ok(), "{name:?}");
            }
        }
    }
}
