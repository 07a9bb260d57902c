//! Meshes from glTF, and the same with the base colours of their vertices for scans.

use super::accessors::Accessors;
use super::base_colors::{BaseColors, PrimitiveSurface};
use super::uri::MAX_BYTES;
use crate::FormatError;
use crate::TexturePoint;
use crate::image::read_limited;
use crate::obj::ObjMesh;
use crate::{FaceOrigin, FaceOrigins, PartName};
use ::gltf::accessor::DataType;
use ::gltf::mesh::Mode;
use ::gltf::{Document, Gltf, Node, Primitive, Semantic};
use nalgebra::Matrix4;
use std::ops::Range;
use std::path::Path;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Face, MeshError, TriMesh};

/// Deepest scene; deeper ones are cycles.
const MAX_DEPTH: usize = 64;
/// Most nodes of a scene; nodes shared by many parents multiply.
const MAX_NODES: usize = 10_000;
/// Most vertices of a scene; primitives that share one large accessor multiply.
const MAX_VERTICES: usize = 10_000_000;

/// Triangles of a glTF scene in one mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GltfModel {
    /// Vertices and triangles of all parts, node transforms applied, checked.
    pub mesh: TriMesh,
    /// Texture coordinates, shape `[vertices]`; empty when a part has none.
    pub uv: Vec<[f32; 2]>,
    /// The primitives, in the order of the scene.
    pub parts: Vec<GltfPart>,
    /// Elements left out, for people.
    pub notes: Vec<String>,
}

impl GltfModel {
    /// The same with corners that index texture coordinates separately, and with the part of each face.
    pub fn into_obj(self) -> ObjMesh {
        let face_uv = match self.uv.is_empty() {
            true => Vec::new(),
            false => self.mesh.faces().to_vec(),
        };
        let faces = (0u32..).zip(&self.parts).flat_map(|(part, p)| {
            let origin = FaceOrigin { part, line: 0 };
            p.faces.clone().map(move |_| origin)
        });
        let origins = FaceOrigins {
            faces: faces.collect(),
            parts: self.parts.iter().map(|p| p.names.clone()).collect(),
        };
        ObjMesh {
            mesh: self.mesh,
            uv: self.uv,
            face_uv,
            origins,
            notes: self.notes,
        }
    }
}

/// One primitive of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct GltfPart {
    /// Name of its mesh.
    pub name: String,
    /// Names of its node, mesh and material.
    pub names: PartName,
    /// Its faces in [`GltfModel::mesh`].
    pub faces: Range<usize>,
    /// Base colour, linear RGBA.
    pub color: [f32; 4],
    /// Drawn from both sides.
    pub double_sided: bool,
}

/// Scene as stored: positions may be non-finite and faces degenerate; indices are in range.
pub(crate) struct GltfScan {
    /// Positions of all primitives, node transforms applied.
    pub(crate) points: Vec<P3>,
    /// Triangles.
    pub(crate) faces: Vec<Face>,
    /// Base colours, sRGB, 0 to 255, shape `[points]`; NaN where a primitive has none.
    pub(crate) colors: Vec<[f32; 3]>,
    /// Colours of the textures between the vertices.
    pub(crate) texture: Vec<TexturePoint>,
}

/// Triangles read so far, and the buffers they come from.
struct SceneReader<'a> {
    path: &'a Path,
    accessors: &'a Accessors,
    /// Present for scans, which have colours and unchecked geometry.
    base_colors: Option<BaseColors<'a>>,
    vertices: Vec<P3>,
    faces: Vec<Face>,
    uv: Vec<[f32; 2]>,
    colors: Vec<[f32; 3]>,
    texture: Vec<TexturePoint>,
    parts: Vec<GltfPart>,
    nodes: usize,
}

/// Reads all triangles of the default scene, node transforms applied.
///
/// # Errors
/// Names the mesh and the accessor, face or vertex at fault.
pub fn read_glb(path: &Path) -> Result<GltfModel, FormatError> {
    parse_gltf(&read_limited(path, MAX_BYTES)?, path)
}

/// Parses the bytes of a file as [`read_glb`] does; external buffers lie beside `origin`.
///
/// # Errors
/// As [`read_glb`].
pub fn parse_gltf(bytes: &[u8], origin: &Path) -> Result<GltfModel, FormatError> {
    let (document, accessors) = open(bytes, origin)?;
    let mut file = SceneReader::new(origin, &accessors);
    file.scene(&document)?;
    let SceneReader {
        vertices,
        faces,
        mut uv,
        parts,
        ..
    } = file;
    if uv.len() != vertices.len() {
        uv.clear();
    }
    let mesh = TriMesh::new(vertices, faces)
        .map_err(|e| FormatError::field(origin, "mesh", e.to_string()))?;
    let notes = Vec::new();
    Ok(GltfModel {
        mesh,
        uv,
        parts,
        notes,
    })
}

/// Reads all triangles of the default scene with the base colours of their vertices.
///
/// # Errors
/// As [`read_glb`], except for positions that are not finite and degenerate faces; names a texture that is missing.
pub(crate) fn read_gltf_scan(path: &Path) -> Result<GltfScan, FormatError> {
    let (document, accessors) = open(&read_limited(path, MAX_BYTES)?, path)?;
    let mut file = SceneReader::new(path, &accessors);
    file.base_colors = Some(BaseColors::new(path, &document, &accessors));
    file.scene(&document)?;
    Ok(GltfScan {
        points: file.vertices,
        faces: file.faces,
        colors: file.colors,
        texture: file.texture,
    })
}

/// Checks the container, parses the document and reads its buffers.
fn open(bytes: &[u8], origin: &Path) -> Result<(Document, Accessors), FormatError> {
    check_container(bytes, origin)?;
    check_positions(bytes, origin)?;
    let Gltf { document, blob } =
        Gltf::from_slice(bytes).map_err(|e| FormatError::field(origin, "gltf", e.to_string()))?;
    let accessors = Accessors::read(&document, blob, origin)?;
    Ok((document, accessors))
}

/// Checks the vertex indices of faces, which may be degenerate.
fn check_range(faces: &[Face], vertices: usize) -> Result<(), String> {
    let mut corners = faces
        .iter()
        .enumerate()
        .flat_map(|(f, c)| c.iter().map(move |i| (f, *i)));
    match corners.find(|(_, i)| *i as usize >= vertices) {
        None => Ok(()),
        Some((face, index)) => Err(MeshError::IndexOutOfRange {
            face,
            index,
            vertices,
        }
        .to_string()),
    }
}

/// Checks the lengths of header and chunks against the number of bytes.
fn check_container(bytes: &[u8], origin: &Path) -> Result<(), FormatError> {
    if !bytes.starts_with(b"glTF") {
        return Ok(());
    }
    let word = |at: usize| {
        bytes
            .get(at..at + 4)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
    };
    let cut = |field: &str| {
        FormatError::field(
            origin,
            field,
            "longer than the file: it is cut short or damaged",
        )
    };
    let total = word(8).ok_or_else(|| cut("header"))?;
    if total > bytes.len() || total < 20 {
        return Err(cut("header length"));
    }
    let mut at = 12;
    while at < total {
        let length = word(at).ok_or_else(|| cut("chunk"))?;
        at = at.saturating_add(8).saturating_add(length);
        if at > total {
            return Err(cut("chunk length"));
        }
    }
    Ok(())
}

/// Checks that the accessor of every POSITION exists: the gltf crate indexes it unchecked.
fn check_positions(bytes: &[u8], origin: &Path) -> Result<(), FormatError> {
    let text = match bytes.get(12..16) {
        Some(n) if bytes.starts_with(b"glTF") => {
            let end = 20 + u32::from_le_bytes([n[0], n[1], n[2], n[3]]) as usize;
            bytes.get(20..end).unwrap_or_default()
        }
        _ => bytes,
    };
    let root: serde_json::Value = serde_json::from_slice(text)
        .map_err(|e| FormatError::field(origin, "json", e.to_string()))?;
    let list = |v: &serde_json::Value, key: &str| {
        v.get(key)
            .and_then(|l| l.as_array())
            .cloned()
            .unwrap_or_default()
    };
    let accessors = list(&root, "accessors").len() as u64;
    for (m, mesh) in list(&root, "meshes").iter().enumerate() {
        for (k, p) in list(mesh, "primitives").iter().enumerate() {
            let position = p
                .get("attributes")
                .and_then(|a| a.get("POSITION"))
                .and_then(|i| i.as_u64());
            if let Some(i) = position.filter(|i| *i >= accessors) {
                let why = format!("accessor {i} of {accessors} does not exist");
                return Err(FormatError::field(
                    origin,
                    format!("mesh {m}, primitive {k}: POSITION"),
                    why,
                ));
            }
        }
    }
    Ok(())
}

impl<'a> SceneReader<'a> {
    fn new(path: &'a Path, accessors: &'a Accessors) -> Self {
        Self {
            path,
            accessors,
            base_colors: None,
            vertices: Vec::new(),
            faces: Vec::new(),
            uv: Vec::new(),
            colors: Vec::new(),
            texture: Vec::new(),
            parts: Vec::new(),
            nodes: 0,
        }
    }

    /// Reads the default scene, or the first.
    fn scene(&mut self, document: &Document) -> Result<(), FormatError> {
        let path = self.path;
        let fault = |field: &str, why: String| Err(FormatError::field(path, field, why));
        let scene = document
            .default_scene()
            .or_else(|| document.scenes().next());
        let Some(scene) = scene else {
            return fault("scene", "none".into());
        };
        for node in scene.nodes() {
            self.node(&node, &Matrix4::identity(), 0)?;
        }
        if self.vertices.len() > MAX_VERTICES {
            return fault("meshes", format!("more than {MAX_VERTICES} vertices"));
        }
        if self.faces.is_empty() {
            return fault("meshes", "no triangles".into());
        }
        Ok(())
    }

    /// Adds a node and its children; `above` is the transform of the parent.
    fn node(
        &mut self,
        node: &Node<'_>,
        above: &Matrix4<f32>,
        depth: usize,
    ) -> Result<(), FormatError> {
        self.nodes += 1;
        if depth > MAX_DEPTH || self.nodes > MAX_NODES || self.vertices.len() > MAX_VERTICES {
            return Err(FormatError::field(
                self.path,
                format!("node {}", node.index()),
                "the scene is too deep or large",
            ));
        }
        let here = above * Matrix4::from(node.transform().matrix());
        if let Some(mesh) = node.mesh() {
            for (k, p) in mesh.primitives().enumerate() {
                if self.vertices.len() > MAX_VERTICES {
                    break;
                }
                let name = mesh
                    .name()
                    .map_or_else(|| format!("mesh {}", mesh.index()), str::to_owned);
                if p.mode() == Mode::Triangles {
                    self.primitive(&name, k, &p, &here)?;
                }
            }
        }
        for child in node.children() {
            self.node(&child, &here, depth + 1)?;
        }
        Ok(())
    }

    /// Adds primitive `k` of mesh `name` under the transform `place`.
    fn primitive(
        &mut self,
        name: &str,
        k: usize,
        p: &Primitive<'_>,
        place: &Matrix4<f32>,
    ) -> Result<(), FormatError> {
        let path = self.path;
        let fault = |field: &str, why: String| {
            FormatError::field(path, format!("{name}, primitive {k}: {field}"), why)
        };
        let positions = p
            .get(&Semantic::Positions)
            .ok_or_else(|| fault("POSITION", "missing".into()))?;
        let positions: Vec<[f32; 3]> = self
            .accessors
            .floats(&positions)
            .map_err(|why| fault("POSITION", why))?;
        let vertices: Vec<P3> = positions
            .into_iter()
            .map(|v| place.transform_point(&P3::from(v)))
            .collect();
        let uv = match p.get(&Semantic::TexCoords(0)) {
            Some(a) if a.data_type() == DataType::F32 => self
                .accessors
                .floats(&a)
                .map_err(|why| fault("TEXCOORD_0", why))?,
            _ => Vec::new(),
        };
        if !uv.is_empty() && uv.len() != vertices.len() {
            return Err(fault(
                "TEXCOORD_0",
                format!("{} for {} vertices", uv.len(), vertices.len()),
            ));
        }
        let corners: Vec<u32> = match p.indices() {
            Some(a) => self
                .accessors
                .indices(&a)
                .map_err(|why| fault("indices", why))?,
            None => (0..vertices.len() as u32).collect(),
        };
        if !corners.len().is_multiple_of(3) {
            return Err(fault(
                "indices",
                format!("{} do not make triangles", corners.len()),
            ));
        }
        let faces: Vec<Face> = corners
            .chunks_exact(3)
            .map(|c| [c[0], c[1], c[2]])
            .collect();
        let first = self.faces.len();
        if let Some(base_colors) = &mut self.base_colors {
            check_range(&faces, vertices.len()).map_err(|why| fault("mesh", why))?;
            let colors = base_colors.of_primitive(p, vertices.len());
            self.colors
                .extend(colors.map_err(|why| fault("base colour", why))?);
            let surface = PrimitiveSurface {
                vertices: &vertices,
                faces: &faces,
                first,
            };
            base_colors
                .points_of_primitive(p, surface, &mut self.texture)
                .map_err(|why| fault("base colour", why))?;
            self.append(&vertices, &faces);
        } else {
            // Checked alone first, so that an error names the primitive's own face and vertex.
            let mesh = TriMesh::new(vertices, faces).map_err(|e| fault("mesh", e.to_string()))?;
            self.append(mesh.vertices(), mesh.faces());
        }
        self.uv.extend(uv);
        let material = p.material();
        self.parts.push(GltfPart {
            name: name.to_owned(),
            names: PartName {
                object: String::new(),
                group: name.to_owned(),
                material: material.name().unwrap_or_default().to_owned(),
            },
            faces: first..self.faces.len(),
            color: material.pbr_metallic_roughness().base_color_factor(),
            double_sided: material.double_sided(),
        });
        Ok(())
    }

    /// Adds the vertices and faces of a primitive.
    fn append(&mut self, vertices: &[P3], faces: &[Face]) {
        let base = self.vertices.len() as u32;
        self.vertices.extend(vertices);
        self.faces.extend(faces.iter().map(|f| f.map(|i| i + base)));
    }
}
