//! Mesh files as surfaces of cloth: OBJ with or without stitches, glTF, MakeHuman clothes.

use std::collections::BTreeMap;
use std::path::Path;
use tryon_formats::FormatError;
use tryon_formats::gltf::read_glb;
use tryon_formats::mhclo::read_mhclo;
use tryon_formats::obj::{ObjMesh, read_obj};
use tryon_formats::sewn_obj::{SewnObj, Stitch, read_sewn_obj};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Face, MeshError, MeshRepairSettings, TriMesh, UnionFind, repair};

/// Surface of a mesh file.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshFile {
    /// Name of the file, or of the garment in it.
    pub name: String,
    /// Surface in the unit and frame of the file, repaired: oriented manifold sheets.
    ///
    /// [`ObjMesh::origins`] has the part of the file that each face belongs to; [`split`] and [`some_faces`] keep it.
    pub sewn: SewnObj,
    /// Findings of the reader and changes of the repair, for people.
    pub notes: Vec<String>,
    /// Thickness of cloth that was modelled as a closed double layer, unit of the file; it is one sheet here.
    pub thickness: Option<f32>,
    /// Positions are on the given body: it has all vertices of MakeHuman's binding.
    pub bound: bool,
}

/// Reads an OBJ, a glTF (`.glb`, `.gltf`) or a MakeHuman binding (`.mhclo`, with the OBJ beside it). `base` are the
/// vertices of the body that a binding names; without them, or without MakeHuman's helpers among them, the positions
/// are those of the OBJ.
///
/// The surface is repaired by [`repair`]; [`MeshFile::notes`] say what changed. Coincident vertices of panels with stitches are
/// not joined: their seams are given.
///
/// # Errors
/// Faults of the file; a face of a one-sided surface (Möbius strip), by its line and part.
pub fn read_mesh(path: &Path, base: Option<&[P3]>) -> Result<MeshFile, FormatError> {
    let stem = path
        .file_stem()
        .and_then(|s| s.to_str())
        .unwrap_or("garment")
        .to_owned();
    let extension = path
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or("")
        .to_ascii_lowercase();
    let (name, sewn, bound) = match extension.as_str() {
        "obj" => (stem, read_sewn_obj(path)?, false),
        "glb" | "gltf" => (stem, unsewn(read_glb(path)?.into_obj()), false),
        "mhclo" => {
            let (name, obj, bound) = clothes(path, base)?;
            (
                if name.is_empty() { stem } else { name },
                unsewn(obj),
                bound,
            )
        }
        other => {
            let why = format!("`.{other}` is no mesh garment; .obj, .glb, .gltf and .mhclo are");
            return Err(FormatError::field(path, "name", why));
        }
    };
    let (sewn, thickness) = repaired(sewn, path)?;
    Ok(MeshFile {
        name,
        notes: sewn.obj.notes.clone(),
        sewn,
        thickness,
        bound,
    })
}

fn unsewn(obj: ObjMesh) -> SewnObj {
    SewnObj {
        obj,
        stitches: Vec::new(),
    }
}

/// MakeHuman clothes: their name, the OBJ beside the binding, and true if that is fitted to `base`.
fn clothes(path: &Path, base: Option<&[P3]>) -> Result<(String, ObjMesh, bool), FormatError> {
    let m = read_mhclo(path)?;
    let mut obj = read_obj(&path.with_file_name(&m.obj_file))?;
    let (bound, has) = (m.bindings.len(), obj.mesh.vertices().len());
    if bound != has {
        let why = format!("{bound} are bound, {} has {has}", m.obj_file);
        return Err(FormatError::field(path, "verts", why));
    }
    let fitted = base.and_then(|b| m.fit(b, path).ok());
    let is_fitted = fitted.is_some();
    if let Some(p) = fitted {
        let moved = obj.mesh.with_vertices(p);
        obj.mesh = moved.map_err(|e| FormatError::field(path, "verts", e.to_string()))?;
    }
    Ok((m.name, obj, is_fitted))
}

/// Repaired surface, with what changed among its notes; and the thickness of cloth that was modelled with it.
fn repaired(sewn: SewnObj, path: &Path) -> Result<(SewnObj, Option<f32>), FormatError> {
    let defaults = MeshRepairSettings::default();
    let settings = MeshRepairSettings {
        weld: if sewn.stitches.is_empty() {
            defaults.weld
        } else {
            0.0
        },
        ..defaults
    };
    let SewnObj { obj, stitches } = sewn;
    let done = repair(&obj.mesh, &settings).map_err(|e| match e {
        MeshError::OneSided { face } => {
            let why = "the surface has one side only (a twisted band); cut it open there";
            FormatError::field(path, obj.origins.place(face), why)
        }
        e => FormatError::field(path, "mesh", e.to_string()),
    })?;
    let faces = done.face_source.iter().map(|f| *f as usize);
    let corner = |c: u32| Some(obj.face_uv.get(c as usize / 3)?[c as usize % 3]);
    let corners = done.corner_source.iter();
    let face_uv = corners.filter_map(|c| Some([corner(c[0])?, corner(c[1])?, corner(c[2])?]));

    // The first copy of a vertex keeps its stitches.
    let mut number = vec![None; obj.mesh.vertices().len()];
    for (new, old) in (0u32..).zip(&done.vertex_source) {
        number[*old as usize].get_or_insert(new);
    }
    let stitches = moved(&stitches, |v| number[v as usize]);
    let mut notes = obj.notes;
    notes.extend(done.report.clauses(|face| obj.origins.place(face as usize)));
    if let Some(thickness) = done.thickness {
        notes.push(format!(
            "cloth {thickness:.2e} thick, in the unit of the file, taken as one sheet"
        ));
    }
    let obj = ObjMesh {
        face_uv: face_uv.collect(),
        origins: obj.origins.of_faces(faces),
        uv: obj.uv,
        mesh: done.mesh,
        notes,
        dropped: obj.dropped,
    };
    Ok((SewnObj { obj, stitches }, done.thickness))
}

/// Stitches of the vertices that have a new number.
fn moved(stitches: &[Stitch], number: impl Fn(u32) -> Option<u32>) -> Vec<Stitch> {
    let moved = |s: &Stitch| {
        Some(Stitch {
            vertex: number(s.vertex)?,
            edge: [number(s.edge[0])?, number(s.edge[1])?],
            at: s.at,
        })
    };
    stitches.iter().filter_map(moved).collect()
}

/// Pieces of cloth, connected by faces or stitches, largest first.
pub fn split(sewn: &SewnObj) -> Vec<SewnObj> {
    let mut sets = UnionFind::new(sewn.obj.mesh.vertices().len());
    for f in sewn.obj.mesh.faces() {
        sets.join(f[0], f[1]);
        sets.join(f[0], f[2]);
    }
    for s in &sewn.stitches {
        sets.join(s.vertex, s.edge[0]);
        sets.join(s.vertex, s.edge[1]);
    }
    let mut pieces: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (i, f) in sewn.obj.mesh.faces().iter().enumerate() {
        pieces.entry(sets.root(f[0])).or_default().push(i);
    }
    let mut out: Vec<SewnObj> = pieces
        .into_values()
        .filter_map(|faces| some_faces(sewn, &faces))
        .collect();
    out.sort_by_key(|p| std::cmp::Reverse(p.obj.mesh.faces().len()));
    out
}

/// Part of a surface: these faces, their vertices and the stitches between them; `None` without faces.
pub fn some_faces(sewn: &SewnObj, faces: &[usize]) -> Option<SewnObj> {
    let mut label = vec![u32::MAX; sewn.obj.mesh.vertices().len()];
    let mut vertices = Vec::new();
    let mut name = |v: u32| {
        let l = &mut label[v as usize];
        if *l == u32::MAX {
            *l = vertices.len() as u32;
            vertices.push(sewn.obj.mesh.vertices()[v as usize]);
        }
        *l
    };
    let own: Vec<Face> = faces
        .iter()
        .map(|i| sewn.obj.mesh.faces()[*i].map(&mut name))
        .collect();
    let stitches = moved(&sewn.stitches, |v| {
        Some(label[v as usize]).filter(|l| *l != u32::MAX)
    });
    let face_uv = faces
        .iter()
        .filter_map(|i| sewn.obj.face_uv.get(*i).copied())
        .collect();
    let mesh = TriMesh::new(vertices, own)
        .ok()
        .filter(|m| !m.faces().is_empty())?;
    Some(SewnObj {
        obj: ObjMesh {
            mesh,
            uv: sewn.obj.uv.clone(),
            face_uv,
            origins: sewn.obj.origins.of_faces(faces.iter().copied()),
            ..ObjMesh::default()
        },
        stitches,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_formats::obj::parse_obj;
    use tryon_geometry::mesh::Topology;

    fn obj(text: &str) -> ObjMesh {
        parse_obj(text, Path::new("t.obj")).expect("an OBJ")
    }

    const QUAD: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    fn read(name: &str, text: &str) -> Result<MeshFile, String> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("written");
        read_mesh(&path, None).map_err(|e| e.to_string())
    }

    #[test]
    fn surfaces_are_repaired_and_changes_name_their_lines() {
        let m = read(
            "t.obj",
            &format!("{QUAD}v 2 0 0\nv 9 9 9\nf 1 2 3\nf 1 4 3\nf 2 3 5\nf 3 1 2\n"),
        )
        .expect("mended");
        assert!(Topology::new(&m.sewn.obj.mesh).is_ok());
        assert_eq!(m.sewn.obj.mesh.faces().len(), 3);
        let notes = m.notes.join("; ");
        assert!(
            notes.contains("turned over") && notes.contains("1 repeated face removed (line 10)"),
            "{notes}"
        );
        assert!(notes.contains("1 vertex without a face removed"), "{notes}");

        let m = read(
            "t.obj",
            &format!("{QUAD}v 0 0 1\no a\nf 1 2 3\nf 1 3 4\no b\nf 1 3 5"),
        )
        .expect("split");
        let notes = m.notes.join("; ");
        assert!(
            notes.contains("1 edge with more than two faces split (line 10 of `b`)"),
            "{notes}"
        );
        let parts: Vec<String> = split(&m.sewn)
            .iter()
            .map(|s| s.obj.origins.counts()[0].0.to_string())
            .collect();
        assert_eq!(parts, ["a", "b"]);

        // A Möbius strip of five triangles.
        let ring = "v 0 0 0\nv 1 0 0\nv 2 0 3\nv 3 4 0\nv 4 0 5\nf 1 2 3\nf 2 3 4\nf 3 4 5\nf 4 5 1\nf 5 1 2";
        let e = read("t.obj", ring).expect_err("one side");
        assert!(e.contains("one side") && e.contains("`line "), "{e}");
    }

    #[test]
    fn texture_coordinates_and_stitches_follow_their_corners() {
        let text = format!(
            "{QUAD}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 4/4 3/3\nf 2/2 3/3 1/1\n"
        );
        let m = read("t.obj", &text).expect("mended").sewn.obj;
        assert_eq!(m.face_uv.len(), 2);
        for (f, t) in m.mesh.faces().iter().zip(&m.face_uv) {
            for (v, t) in f.iter().zip(t) {
                let p = m.mesh.vertices()[*v as usize];
                assert_eq!([p.x, p.y], m.uv[*t as usize]);
            }
        }
        // Coincident vertices of two panels with a stitch stay apart; a stray vertex moves the numbers.
        let sewn = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nv 1 0 0\nv 0 -1 0\nf 2 3 4\nf 6 5 7\nstitch 4 1 2 0\n";
        let m = read("t.obj", sewn).expect("sewn").sewn;
        assert_eq!(m.obj.mesh.vertices().len(), 6);
        assert_eq!((m.stitches[0].vertex, m.stitches[0].edge), (3, [0, 1]));
    }

    #[test]
    fn pieces_are_connected_by_faces_and_stitches() {
        let two = obj(&format!(
            "{QUAD}v 5 0 0\nv 6 0 0\nv 6 1 0\nf 5 6 7\nf 1 2 3 4"
        ));
        let sewn = SewnObj {
            obj: two,
            stitches: Vec::new(),
        };
        let p = split(&sewn);
        assert_eq!(
            p.iter()
                .map(|s| s.obj.mesh.vertices().len())
                .collect::<Vec<_>>(),
            [4, 3]
        );
        let stitch = Stitch {
            vertex: 4,
            edge: [1, 2],
            at: 0.0,
        };
        let p = split(&SewnObj {
            stitches: vec![stitch],
            ..sewn
        });
        assert_eq!(
            (p.len(), p[0].stitches.len(), p[0].obj.mesh.vertices().len()),
            (1, 1, 7)
        );
    }
}
