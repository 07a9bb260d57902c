use super::{folder, read_bytes, refusal};
use crate::scan::{PlyMesh, ScanMesh, read_scan, write_ply};
use proptest::prelude::*;
use tryon_geometry::math::{P3, V3};

/// Two triangles of a square with normals and colours.
fn square() -> ScanMesh {
    let corners = [
        [0.0, 0.0, 0.25],
        [1.5, 0.0, 0.0],
        [1.5, 1.0, -3.0],
        [0.0, 1.0, 1e-7],
    ];
    ScanMesh {
        points: corners.map(P3::from).to_vec(),
        faces: vec![[0, 1, 2], [0, 2, 3]],
        normals: vec![V3::z(), V3::x(), V3::y(), -V3::z()],
        colors: vec![[0, 1, 2], [255, 254, 253], [128, 7, 9], [10, 20, 30]],
        ..ScanMesh::default()
    }
}

/// Properties of the vertices of [`square`], a quad and an element of another kind, in an unusual order.
const HEADER: &str = "comment made by hand\nelement extra 2\nproperty list short double w\n\
    property char k\nelement face 1\nproperty uchar flags\nproperty list uint8 int32 vertex_index\n\
    property list uchar float texcoord\nelement vertex 4\nproperty uchar blue\nproperty double z\n\
    property float nx\nproperty uchar red\nproperty float y\nproperty uchar green\n\
    property list uchar ushort groups\nproperty float x\nproperty float ny\nproperty float nz\n\
    property float quality\nend_header\n";

/// Encoder of the numbers of a body.
struct Numbers {
    format: &'static str,
    out: Vec<u8>,
}

impl Numbers {
    fn put(&mut self, text: String, little: &[u8]) {
        match self.format {
            "ascii" => self.out.extend(format!("{text} ").bytes()),
            "binary_little_endian" => self.out.extend(little),
            _ => self.out.extend(little.iter().rev()),
        }
    }
    fn byte(&mut self, x: u8) {
        self.put(x.to_string(), &[x]);
    }
    fn float(&mut self, x: f32) {
        self.put(x.to_string(), &x.to_le_bytes());
    }
}

/// [`square`] in one of the three encodings.
fn encoded(format: &'static str) -> Vec<u8> {
    let out = format!("ply\nformat {format} 1.0\n{HEADER}").into_bytes();
    let mut n = Numbers { format, out };
    for k in [-1i8, 5] {
        n.put("2".into(), &2i16.to_le_bytes());
        for w in [1.0f64, -7.5] {
            n.put(w.to_string(), &w.to_le_bytes());
        }
        n.put(k.to_string(), &k.to_le_bytes());
    }
    n.byte(9);
    n.byte(4);
    for i in 0..4i32 {
        n.put(i.to_string(), &i.to_le_bytes());
    }
    n.byte(1);
    n.float(0.5);
    let s = square();
    for ((p, normal), color) in s.points.iter().zip(&s.normals).zip(&s.colors) {
        n.byte(color[2]);
        let z = f64::from(p.z);
        n.put(z.to_string(), &z.to_le_bytes());
        n.float(normal.x);
        n.byte(color[0]);
        n.float(p.y);
        n.byte(color[1]);
        n.byte(1);
        n.put("700".into(), &700u16.to_le_bytes());
        n.float(p.x);
        n.float(normal.y);
        n.float(normal.z);
        n.float(0.9);
    }
    n.out
}

#[test]
fn the_three_encodings_are_the_same_mesh() {
    let dir = folder();
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let read = read_bytes(dir.path(), "a.PLY", &encoded(format));
        assert_eq!(read.as_ref(), Ok(&square()), "{format}");
    }
}

#[test]
fn written_meshes_read_back() {
    let dir = folder();
    let (s, path) = (square(), dir.path().join("m.ply"));
    let mut mesh = PlyMesh {
        points: &s.points,
        faces: &s.faces,
        normals: &s.normals,
        colors: &s.colors,
        labels: Some(&[3, 255, 0, 1]),
    };
    write_ply(&path, &mesh).expect("written");
    assert_eq!(read_scan(&path).expect("read"), s);
    let bytes = std::fs::read(&path).expect("read");
    let label = bytes.windows(20).position(|w| w == b"property uchar label");
    assert!(label.is_some(), "the labels are declared");
    // Rows of 28 bytes end in the label.
    let rows = &bytes[bytes.len() - 2 * 13 - 4 * 28..];
    assert_eq!([rows[27], rows[55], rows[83], rows[111]], [3, 255, 0, 1]);
    mesh.labels = Some(&[1]);
    let e = write_ply(&path, &mesh).expect_err("one label");
    assert!(e.to_string().contains("labels"), "{e}");
    mesh.labels = None;
    mesh.faces = &[[0, 1, 4]];
    let e = write_ply(&path, &mesh).expect_err("out of range");
    assert!(e.to_string().contains("face 0"), "{e}");
    mesh.faces = &[];
    mesh.normals = &[];
    mesh.colors = &[];
    write_ply(&path, &mesh).expect("written");
    let points = ScanMesh {
        points: s.points.clone(),
        ..ScanMesh::default()
    };
    assert_eq!(read_scan(&path).expect("read"), points);
}

#[test]
fn every_truncation_is_an_error() {
    let dir = folder();
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let bytes = encoded(format);
        // An ASCII number may lack its last digits and its separator unnoticed.
        let whole = bytes.len() - if format == "ascii" { 3 } else { 0 };
        for cut in 0..whole {
            let e = refusal(dir.path(), "a.ply", &bytes[..cut]);
            assert!(e.contains("a.ply"), "{format}, {cut}: {e}");
        }
    }
}

#[test]
fn a_cut_list_names_element_and_row() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 1 0 0 0 1 0\n3 0 1 2\n3 0";
    let e = refusal(folder().path(), "a.ply", text.as_bytes());
    assert!(
        e.contains("element face, row 1") && e.contains("cut short"),
        "{e}"
    );
}

/// ASCII triangle with these properties and numbers after `x y z` and this face.
fn triangle(properties: &str, numbers: [&str; 3], face: &str) -> String {
    let [a, b, c] = numbers;
    format!(
        "ply\r\nformat ascii 1.0\r\nelement vertex 3\r\nproperty float x\r\nproperty float y\r\n\
         property float z\r\n{properties}element face 1\r\n\
         property list uchar int vertex_indices\r\nend_header\r\n\
         0 0 0 {a}\r\n1 0 nan {b}\r\n0 -inf 0 {c}\r\n{face}\r\n"
    )
}

#[test]
fn positions_that_are_not_finite_are_kept() {
    let text = triangle("", ["", "", ""], "3 0 1 1");
    let scan = read_bytes(folder().path(), "a.ply", text.as_bytes()).expect("valid");
    assert!(scan.points[1].z.is_nan() && scan.points[2].y == f32::NEG_INFINITY);
    assert_eq!(scan.faces, [[0, 1, 1]], "degenerate, and kept");
    assert!(scan.colors.is_empty() && scan.normals.is_empty());
}

#[test]
fn float_colours_are_scaled_and_holes_take_the_mean() {
    let dir = folder();
    let names = "property float r\r\nproperty float g\r\nproperty float b\r\n";
    let text = triangle(names, ["0 1 0.2", "nan 0 0", "1 0 0.6"], "3 0 1 2");
    let scan = read_bytes(dir.path(), "a.ply", text.as_bytes()).expect("valid");
    assert_eq!(scan.colors, [[0, 255, 51], [128, 128, 102], [255, 0, 153]]);
    let text = triangle(names, ["0 200 20", "-nan(ind) 0 0", "100 0 300"], "3 0 1 2");
    let scan = read_bytes(dir.path(), "a.ply", text.as_bytes()).expect("valid");
    assert_eq!(scan.colors[0], [0, 200, 20]);
    assert_eq!(scan.colors[2], [100, 0, 255]);
    let names = "property ushort diffuse_red\r\nproperty ushort diffuse_green\r\n\
        property ushort diffuse_blue\r\n";
    let text = triangle(names, ["0 65535 257", "1 2 3", "4 5 6"], "3 0 1 2");
    let scan = read_bytes(dir.path(), "a.ply", text.as_bytes()).expect("valid");
    assert_eq!(scan.colors[0], [0, 255, 1]);
    let text = triangle(names, ["nan 0 0", "nan 0 0", "nan 0 0"], "3 0 1 2");
    let scan = read_bytes(dir.path(), "a.ply", text.as_bytes()).expect("valid");
    assert!(scan.colors.is_empty(), "no colour is finite");
}

#[test]
fn faults_name_the_face_and_the_property() {
    let dir = folder();
    for (face, fault) in [
        ("3 0 1 3", "vertex index 3 is out of range"),
        ("3 0 1 -1", "-1 is no count or index"),
        ("3 0 1 0.5", "0.5 is no count or index"),
        ("2 0 1", "2 corners"),
        ("3 0 one 2", "`one` is no number"),
    ] {
        let e = refusal(
            dir.path(),
            "a.ply",
            triangle("", ["", "", ""], face).as_bytes(),
        );
        assert!(
            e.contains("element face, row 0") && e.contains(fault),
            "{e}"
        );
    }
    for (from, to, fault) in [
        (
            "property float z",
            "property float depth",
            "lacks x, y or z",
        ),
        ("property float z", "property real z", "unknown type `real`"),
        ("vertex_indices", "corners", "lacks the list"),
        ("format ascii", "format text", "unknown format"),
        (
            "element vertex 3",
            "element vertex -3",
            "`-3` is no number of rows",
        ),
        ("element vertex", "element point", "missing"),
        ("ply\r", "plx\r", "no PLY file"),
    ] {
        let text = triangle("", ["", "", ""], "3 0 1 2").replace(from, to);
        let e = refusal(dir.path(), "a.ply", text.as_bytes());
        assert!(e.contains(fault), "{e}");
    }
}

#[test]
fn huge_counts_are_refused_before_anything_is_allocated() {
    let dir = folder();
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (from, to) in [
            ("element vertex 4\n", "element vertex 4000000000\n"),
            ("element face 1\n", "element face 18446744073709551615\n"),
            ("element extra 2\n", "element extra 4000000000\n"),
        ] {
            let bytes = encoded(format);
            let end = b"end_header\n";
            let body = bytes.windows(end.len()).position(|w| w == end);
            let (head, body) = bytes.split_at(body.expect("a header"));
            let head = String::from_utf8_lossy(head).replace(from, to);
            let bytes = [head.as_bytes(), body].concat();
            let e = refusal(dir.path(), "a.ply", &bytes);
            assert!(e.contains("more than the file holds"), "{format}: {e}");
        }
    }
    let text = "ply\nformat binary_little_endian 1.0\nelement none 4000000000\n\
        element vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
        property list uint uchar w\nend_header\n";
    let mut bytes = text.as_bytes().to_vec();
    bytes.extend([0; 12]);
    bytes.extend(u32::MAX.to_le_bytes());
    let e = refusal(dir.path(), "a.ply", &bytes);
    assert!(
        e.contains("element vertex, row 0") && e.contains("cut short"),
        "{e}"
    );
    let e = refusal(
        dir.path(),
        "a.ply",
        b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n",
    );
    assert!(e.contains("empty"), "{e}");
}

#[test]
fn headers_of_classic_mac_files_end_in_a_carriage_return() {
    let text = triangle("", ["", "", ""], "3 0 1 2").replace("\r\n", "\r");
    let scan = read_bytes(folder().path(), "a.ply", text.as_bytes()).expect("valid");
    assert_eq!(scan.faces, [[0, 1, 2]]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]
    #[test]
    fn damaged_bytes_never_panic(at in any::<usize>(), x in any::<u8>(), kind in 0usize..3) {
        let format = ["ascii", "binary_little_endian", "binary_big_endian"][kind];
        let mut bytes = encoded(format);
        let n = bytes.len();
        bytes[at % n] ^= x;
        let _ = read_bytes(folder().path(), "a.ply", &bytes);
    }
}
