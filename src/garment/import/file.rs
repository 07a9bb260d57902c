//! Mesh files as surfaces of cloth: OBJ with or without stitches, glTF, MakeHuman clothes.

use std::collections::BTreeMap;
use std::path::Path;
use tryon_formats::FormatError;
use tryon_formats::gltf::{GltfModel, read_glb};
use tryon_formats::mhclo::read_mhclo;
use tryon_formats::obj::{ObjMesh, read_obj};
use tryon_formats::sewn_obj::{SewnObj, Stitch, read_sewn_obj};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Face, TriMesh, UnionFind, edge_faces, sides, undirected};

/// Surface of a mesh file.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshFile {
    /// Name of the file, or of the garment in it.
    pub name: String,
    /// Surface in the unit and frame of the file, with consistent orientation.
    pub sewn: SewnObj,
    /// Faces whose orientation was reversed.
    pub turned: usize,
    /// Positions are on the given body: it has all vertices of MakeHuman's binding.
    pub bound: bool,
}

/// Reads an OBJ, a glTF (`.glb`, `.gltf`) or a MakeHuman binding (`.mhclo`, with the OBJ beside it). `base` are the
/// vertices of the body that a binding names; without them, or without MakeHuman's helpers among them, the positions
/// are those of the OBJ.
///
/// # Errors
/// Faults of the file; an edge with more than two faces or of a one-sided surface (Möbius strip), by its vertices.
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
    let (name, mut sewn, bound) = match extension.as_str() {
        "obj" => (stem, read_sewn_obj(path)?, false),
        "glb" | "gltf" => (
            stem,
            SewnObj {
                obj: welded(read_glb(path)?, path)?,
                stitches: Vec::new(),
            },
            false,
        ),
        "mhclo" => {
            let m = read_mhclo(path)?;
            let mut obj = read_obj(&path.with_file_name(&m.obj_file))?;
            if m.bindings.len() != obj.mesh.vertices().len() {
                let why = format!(
                    "{} are bound, {} has {}",
                    m.bindings.len(),
                    m.obj_file,
                    obj.mesh.vertices().len()
                );
                return Err(FormatError::field(path, "verts", why));
            }
            let fitted = base.and_then(|b| m.fit(b, path).ok());
            let bound = fitted.is_some();
            if let Some(p) = fitted {
                obj.mesh = obj
                    .mesh
                    .with_vertices(p)
                    .map_err(|e| FormatError::field(path, "verts", e.to_string()))?;
            }
            (
                if m.name.is_empty() { stem } else { m.name },
                SewnObj {
                    obj,
                    stitches: Vec::new(),
                },
                bound,
            )
        }
        other => {
            let why = format!("`.{other}` is no mesh garment; .obj, .glb, .gltf and .mhclo are");
            return Err(FormatError::field(path, "name", why));
        }
    };
    let turned = orient(&mut sewn.obj, path)?;
    Ok(MeshFile {
        name,
        sewn,
        turned,
        bound,
    })
}

/// Welds the vertices that glTF splits along texture seams.
fn welded(model: GltfModel, path: &Path) -> Result<ObjMesh, FormatError> {
    /// Largest distance of vertices that are welded, as a share of the model's size.
    const SAME: f32 = 1e-5;
    let size = model
        .mesh
        .bounds()
        .map_or(1.0, |(lo, hi)| (hi - lo).amax())
        .max(f32::MIN_POSITIVE);
    let key = |p: &P3| [p.x, p.y, p.z].map(|c| (c / (SAME * size)).round() as i64);
    let mut seen = BTreeMap::new();
    let mut vertices = Vec::new();
    let under: Vec<u32> = model
        .mesh
        .vertices()
        .iter()
        .map(|p| {
            *seen.entry(key(p)).or_insert_with(|| {
                vertices.push(*p);
                vertices.len() as u32 - 1
            })
        })
        .collect();
    let (mut faces, mut face_uv) = (Vec::new(), Vec::new());
    for f in model.mesh.faces() {
        let w = f.map(|v| under[v as usize]);
        if w[0] != w[1] && w[1] != w[2] && w[0] != w[2] {
            faces.push(w);
            face_uv.push(*f);
        }
    }
    if model.uv.is_empty() {
        face_uv.clear();
    }
    let mesh = TriMesh::new(vertices, faces)
        .map_err(|e| FormatError::field(path, "mesh", e.to_string()))?;
    Ok(ObjMesh {
        mesh,
        uv: model.uv,
        face_uv,
    })
}

/// Reverses faces until neighbours have the same orientation; returns the number of reversed faces.
fn orient(o: &mut ObjMesh, path: &Path) -> Result<usize, FormatError> {
    let mut faces = o.mesh.faces().to_vec();
    let mut around: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
    for (edge, face) in edge_faces(&faces) {
        around.entry(edge).or_default().push(face);
    }
    if let Some(([a, b], f)) = around.iter().find(|(_, f)| f.len() > 2) {
        let why = format!(
            "{} faces meet there ({:?}); cloth has at most two",
            f.len(),
            f
        );
        return Err(FormatError::field(path, format!("edge ({a}, {b})"), why));
    }
    let mut known = vec![false; faces.len()];
    let mut turned = vec![false; faces.len()];
    for seed in 0..faces.len() {
        if std::mem::replace(&mut known[seed], true) {
            continue;
        }
        let (mut piece, mut at) = (vec![seed], 0);
        while at < piece.len() {
            let i = piece[at];
            at += 1;
            let f = faces[i];
            for side in sides(&f) {
                for &n in &around[&undirected(side)] {
                    let n = n as usize;
                    // Faces of the same orientation run along their edge in opposite directions.
                    let alike = n == i || !sides(&faces[n]).contains(&side);
                    if known[n] && !alike {
                        let why = "its faces cannot be turned alike: the surface has one side only"
                            .to_owned();
                        let [a, b] = side;
                        return Err(FormatError::field(path, format!("edge ({a}, {b})"), why));
                    }
                    if !std::mem::replace(&mut known[n], true) {
                        if !alike {
                            faces[n].swap(1, 2);
                            turned[n] = true;
                        }
                        piece.push(n);
                    }
                }
            }
        }
        // The majority of the piece keeps its orientation.
        if piece.iter().filter(|i| turned[**i]).count() * 2 > piece.len() {
            for i in piece {
                faces[i].swap(1, 2);
                turned[i] = !turned[i];
            }
        }
    }
    for (f, _) in o.face_uv.iter_mut().zip(&turned).filter(|(_, t)| **t) {
        f.swap(1, 2);
    }
    o.mesh = TriMesh::new(o.mesh.vertices().to_vec(), faces)
        .map_err(|e| FormatError::field(path, "mesh", e.to_string()))?;
    Ok(turned.iter().filter(|t| **t).count())
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
    let at = |v: u32| Some(label[v as usize]).filter(|l| *l != u32::MAX);
    let stitches = sewn
        .stitches
        .iter()
        .filter_map(|s| {
            Some(Stitch {
                vertex: at(s.vertex)?,
                edge: [at(s.edge[0])?, at(s.edge[1])?],
                at: s.at,
            })
        })
        .collect();
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

    #[test]
    fn faces_get_one_orientation_and_faults_name_their_edge() {
        let mut o = obj(&format!("{QUAD}v 2 0 0\nf 1 2 3\nf 1 4 3\nf 2 3 5"));
        let n = orient(&mut o, Path::new("t.obj")).expect("turned");
        assert!(n > 0 && Topology::new(&o.mesh).is_ok());
        let mut o = obj(&format!("{QUAD}v 2 0 0\nf 1 2 3\nf 2 1 4\nf 1 2 5"));
        let e = orient(&mut o, Path::new("t.obj"))
            .expect_err("three")
            .to_string();
        assert!(e.contains("edge (0, 1)") && e.contains("3 faces"), "{e}");
        // A Möbius strip of five triangles.
        let ring = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 4 0 0\nf 1 2 3\nf 2 3 4\nf 3 4 5\nf 4 5 1\nf 5 1 2";
        let e = orient(&mut obj(ring), Path::new("t.obj"))
            .expect_err("one side")
            .to_string();
        assert!(e.contains("one side"), "{e}");
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
