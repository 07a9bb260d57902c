//! Wavefront OBJ: positions, texture coordinates, polygons, names of objects, groups and materials.

use super::FormatError;
use super::face_origins::FaceOrigins;
use super::image::read_limited;
use super::obj_parser::{ObjFaults, parse_records};
use super::text_encoding::decode_text;
use std::fmt::Write as _;
use std::path::Path;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Face, TriMesh};

/// Largest OBJ file that is read, bytes; a garment of 100,000 vertices takes about 12 MB.
const MAX_BYTES: u64 = 512 << 20;

/// Mesh of an OBJ file: corners index positions and texture coordinates separately.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObjMesh {
    /// Positions and triangles, checked.
    pub mesh: TriMesh,
    /// Texture coordinates, in the order of the file.
    pub uv: Vec<[f32; 2]>,
    /// Texture coordinate of each corner, shape `[faces]`; empty if a corner has none.
    pub face_uv: Vec<Face>,
    /// Part and line of each face; empty for a mesh of no file.
    pub origins: FaceOrigins,
    /// Changes and elements left out, for people.
    pub notes: Vec<String>,
    /// Faces of the file that were left out or lost corners.
    pub dropped: usize,
}

impl From<TriMesh> for ObjMesh {
    /// Mesh without texture coordinates and without a file.
    fn from(mesh: TriMesh) -> Self {
        Self {
            mesh,
            ..Self::default()
        }
    }
}

impl ObjMesh {
    /// Mesh with one vertex for each pair of position and texture coordinate: vertices, their uv (zero if absent),
    /// faces, and the position index of each vertex.
    pub fn unwelded(&self) -> (Vec<P3>, Vec<[f32; 2]>, Vec<Face>, Vec<u32>) {
        if self.face_uv.is_empty() {
            let v = self.mesh.vertices().to_vec();
            let (n, uv) = (v.len() as u32, vec![[0.0; 2]; v.len()]);
            return (v, uv, self.mesh.faces().to_vec(), (0..n).collect());
        }
        let mut seen = std::collections::BTreeMap::new();
        let (mut vertices, mut uv, mut under) = (Vec::new(), Vec::new(), Vec::new());
        let faces = self
            .mesh
            .faces()
            .iter()
            .zip(&self.face_uv)
            .map(|(f, t)| {
                std::array::from_fn(|k| {
                    *seen.entry((f[k], t[k])).or_insert_with(|| {
                        vertices.push(self.mesh.vertices()[f[k] as usize]);
                        uv.push(self.uv[t[k] as usize]);
                        under.push(f[k]);
                        (vertices.len() - 1) as u32
                    })
                })
            })
            .collect();
        (vertices, uv, faces, under)
    }
}

/// Reads an OBJ file in UTF-8 or UTF-16. Corners that repeat their neighbour and faces of fewer than three corners that are
/// left then are dropped, which a note says.
///
/// # Errors
/// Names the line and its fault: a malformed number, an index out of range, a polygon with fewer than three corners; or the
/// text without vertices or faces.
pub fn read_obj(path: &Path) -> Result<ObjMesh, FormatError> {
    parse_obj(&decode_text(&read_limited(path, MAX_BYTES)?), path)
}

/// Parses OBJ text; `origin` is named in errors.
///
/// # Errors
/// As [`read_obj`].
pub fn parse_obj(text: &str, origin: &Path) -> Result<ObjMesh, FormatError> {
    let records = parse_records(text, origin, ObjFaults::Refused)?;
    if records.vertices.is_empty() || records.faces.is_empty() {
        return Err(FormatError::field(origin, "mesh", records.found()));
    }
    let face_uv: Option<Vec<Face>> = records.face_uv.into_iter().collect();
    let mesh = TriMesh::new(records.vertices, records.faces)
        .map_err(|e| FormatError::field(origin, "mesh", e.to_string()))?;
    Ok(ObjMesh {
        mesh,
        uv: records.uv,
        face_uv: face_uv.unwrap_or_default(),
        origins: records.origins,
        notes: records.notes,
        dropped: records.dropped,
    })
}

/// Writes positions, faces and, if given, one texture coordinate a vertex.
///
/// # Errors
/// When the file cannot be written.
pub fn write_obj(
    path: &Path,
    vertices: &[P3],
    faces: &[Face],
    uv: Option<&[[f32; 2]]>,
) -> Result<(), FormatError> {
    let mut text = String::with_capacity(vertices.len() * 32 + faces.len() * 24);
    for p in vertices {
        let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
    }
    for t in uv.unwrap_or_default() {
        let _ = writeln!(text, "vt {} {}", t[0], t[1]);
    }
    for f in faces {
        let [a, b, c] = f.map(|i| i + 1);
        let _ = match uv {
            Some(_) => writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}"),
            None => writeln!(text, "f {a} {b} {c}"),
        };
    }
    std::fs::write(path, text).map_err(|e| FormatError::io(path, e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parse(text: &str) -> Result<ObjMesh, String> {
        parse_obj(text, Path::new("t.obj")).map_err(|e| e.to_string())
    }

    const QUAD: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn negative_indices_count_back_and_positive_ones_may_name_later_lines() {
        let m = parse(&format!("{QUAD}f 1 2 3 4\nf -4 -3 -2")).expect("valid");
        assert_eq!(m.mesh.faces(), [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
        assert!(m.face_uv.is_empty());
        let m = parse(&format!("f 1 2 3\n{QUAD}")).expect("valid");
        assert_eq!(m.mesh.faces(), [[0, 1, 2]]);
    }

    #[test]
    fn texture_seams_split_vertices() {
        let m = parse(&format!(
            "{QUAD}vt 0 0\nvt 1 0\nvt 1 1\nvt 5 5\nf 1/1 2/2 3/3\nf 1/4 3/3 4/1"
        ))
        .expect("valid");
        let (v, uv, f, under) = m.unwelded();
        assert_eq!((v.len(), f.len()), (5, 2));
        assert_eq!(uv[f[1][0] as usize], [5.0, 5.0]);
        assert_eq!(under[f[1][0] as usize], 0);
    }

    #[test]
    fn faults_name_line_face_and_index() {
        let e = parse(&format!("{QUAD}f 1 2 9")).expect_err("hole");
        assert!(
            e.contains("line 5: face 0") && e.contains("index 9 is out of range"),
            "{e}"
        );
        assert!(
            parse("v 1 2")
                .expect_err("short")
                .contains("line 1: vertex")
        );
        assert!(parse("v 1 2 nan").expect_err("nan").contains("not finite"));
        assert!(
            parse(&format!("{QUAD}f 1 2"))
                .expect_err("two corners")
                .contains("2 corners")
        );
        assert!(
            parse(&format!("{QUAD}f 1 2 0"))
                .expect_err("zero")
                .contains("index 0")
        );
        let e = parse("v 0,5 1 2").expect_err("comma");
        assert!(e.contains("decimal point"), "{e}");
    }

    #[test]
    fn repeated_corners_are_dropped_and_said() {
        let m = parse(&format!(
            "{QUAD}f 1 2 2\nf 1 2 2 3\nf 4 1 2 3 4\nf 1 2 1 2\nf 1 2 3"
        ))
        .expect("valid");
        assert_eq!((m.mesh.faces().len(), m.dropped), (1 + 2 + 1, 4));
        assert_eq!(m.notes.len(), 2, "{:?}", m.notes);
        assert!(
            m.notes[0].contains("2 faces") && m.notes[0].contains("lines 6, 7"),
            "{:?}",
            m.notes
        );
        assert!(
            m.notes[1].contains("2 faces") && m.notes[1].contains("lines 5, 8"),
            "{:?}",
            m.notes
        );
    }

    #[test]
    fn text_without_a_mesh_says_what_it_has() {
        for (text, words) in [
            (
                "solid a\nfacet normal 0 0 1\n",
                "0 vertices (`v`) and 0 faces (`f`) in 2 lines; they begin with `facet` (1), `solid` (1)",
            ),
            (
                QUAD,
                "4 vertices (`v`) and 0 faces (`f`) in 4 lines; they begin with `v` (4)",
            ),
            ("", "all are empty"),
        ] {
            let e = parse(text).expect_err("no mesh");
            assert!(e.contains(words), "{e}");
        }
    }

    #[test]
    fn faces_know_their_part_and_line() {
        let text = format!(
            "o Shirt\n{QUAD}g body\nusemtl red\nf 1 2 3 \\\n 4\ng sleeve\nf 1 2 3\nl 1 2\n"
        );
        let m = parse(&text).expect("valid");
        let counts: Vec<(String, usize)> = m
            .origins
            .counts()
            .into_iter()
            .map(|(p, n)| (p.to_string(), n))
            .collect();
        assert_eq!(
            counts,
            [
                ("Shirt / body / red".into(), 2),
                ("Shirt / sleeve / red".into(), 1)
            ]
        );
        assert_eq!(m.origins.place(2), "line 11 of `Shirt / sleeve / red`");
        assert!(m.notes[0].contains("1 `l`"), "{:?}", m.notes);
    }

    #[test]
    fn written_meshes_read_back() {
        let dir = tempfile::tempdir().expect("temporary folder");
        let path = dir.path().join("m.obj");
        let m = parse(&format!("{QUAD}f 1 2 3 4")).expect("valid");
        let uv = [[0.0, 0.25], [0.5, 1.0], [0.1, 0.2], [0.3, 0.4]];
        write_obj(&path, m.mesh.vertices(), m.mesh.faces(), Some(&uv)).expect("written");
        let back = read_obj(&path).expect("read");
        assert_eq!(back.mesh, m.mesh);
        assert_eq!(back.uv, uv);
    }

    proptest! {
        #[test]
        fn random_text_never_panics(text in "[vft0-9 ./\\-e\n]{0,200}") {
            let _ = parse(&text);
        }
    }
}
