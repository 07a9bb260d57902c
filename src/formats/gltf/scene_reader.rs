//! Triangles of the default scene of a glTF file.

use super::base_colors::{BaseColors, PrimitiveSurface};
use super::deform::{morph_weights, skin_matrices};
use super::file::{GltfFile, Purpose};
use super::part::GltfPart;
use super::placement::{MAX_DEPTH, instances, local, roots, world_transforms};
use super::shape::PrimitiveShape;
use crate::{FormatError, PartName, TexturePoint};
use ::gltf::{Node, Primitive};
use nalgebra::Matrix4;
use std::path::Path;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Face, TriMesh};

/// Most nodes and instances of a scene; nodes shared by many parents multiply.
const MAX_NODES: usize = 10_000;
/// Most vertices of a scene; primitives that share one large accessor multiply.
const MAX_VERTICES: usize = 10_000_000;

/// Triangles of all primitives.
#[derive(Default)]
pub(super) struct SceneTriangles {
    pub(super) vertices: Vec<P3>,
    pub(super) faces: Vec<Face>,
    /// Texture coordinates of the primitives that have some.
    pub(super) uv: Vec<[f32; 2]>,
    /// Colours of a scan, shape `[vertices]`.
    pub(super) colors: Vec<[f32; 3]>,
    pub(super) texture: Vec<TexturePoint>,
    pub(super) parts: Vec<GltfPart>,
    /// Elements left out.
    pub(super) notes: Vec<String>,
}

/// Reader of a scene.
pub(super) struct SceneReader<'a> {
    path: &'a Path,
    file: &'a GltfFile,
    /// Present for scans, which have colours and may have positions that are not finite.
    base_colors: Option<BaseColors<'a>>,
    world: Vec<Matrix4<f32>>,
    nodes: usize,
    /// Vertices read, with those that no face uses.
    read: usize,
    /// Primitives of points or lines.
    flat: usize,
    /// Degenerate triangles.
    degenerate: usize,
    out: SceneTriangles,
}

/// Primitive to add, and its place.
struct PlacedPrimitive<'p, 'd> {
    primitive: &'p Primitive<'d>,
    names: PartName,
    /// Name of the mesh and number in it, for errors.
    place: String,
    /// Weights of its morph targets.
    weights: &'p [f32],
    /// Matrices of the joints of a skinned primitive.
    joints: Option<&'p [Matrix4<f32>]>,
    /// Places of its instances in the scene.
    transforms: &'p [Matrix4<f32>],
}

impl<'a> SceneReader<'a> {
    pub(super) fn new(path: &'a Path, file: &'a GltfFile, purpose: Purpose) -> Self {
        let base_colors = BaseColors::new(path, &file.document, &file.accessors);
        Self {
            path,
            file,
            base_colors: (purpose == Purpose::Scan).then_some(base_colors),
            world: world_transforms(file),
            nodes: 0,
            read: 0,
            flat: 0,
            degenerate: 0,
            out: SceneTriangles::default(),
        }
    }

    /// Reads the default scene, or the first, or all nodes of a file without scenes.
    ///
    /// # Errors
    /// Names the node, or the mesh and what in it is at fault; a scene without triangles.
    pub(super) fn read(mut self) -> Result<SceneTriangles, FormatError> {
        let document = &self.file.document;
        let scene = document
            .default_scene()
            .or_else(|| document.scenes().next());
        let nodes = match scene {
            Some(scene) => scene.nodes().collect(),
            None => roots(self.file),
        };
        for node in nodes {
            self.node(&node, &Matrix4::identity(), 0)?;
        }
        let fault = |why: String| Err(FormatError::field(self.path, "meshes", why));
        if self.is_too_large() {
            return fault(format!(
                "more than {MAX_VERTICES} vertices or {MAX_NODES} nodes and instances"
            ));
        }
        if self.out.faces.is_empty() {
            let (nodes, flat) = (self.nodes, self.flat);
            return fault(format!(
                "no triangles: {nodes} nodes in the scene, {flat} primitives of points or lines"
            ));
        }
        if self.flat > 0 {
            let note = format!("{} primitives of points or lines left out", self.flat);
            self.out.notes.push(note);
        }
        let textured = self.out.uv.len();
        if textured > 0 && textured < self.out.vertices.len() {
            let note = "texture coordinates not used: some meshes have none".to_owned();
            self.out.notes.push(note);
        }
        if self.degenerate > 0 {
            let note = format!("{} faces that use a vertex twice left out", self.degenerate);
            self.out.notes.push(note);
        }
        Ok(self.out)
    }

    /// Adds a node and its children; `above` is the transform of the parent.
    fn node(
        &mut self,
        node: &Node<'_>,
        above: &Matrix4<f32>,
        depth: usize,
    ) -> Result<(), FormatError> {
        self.nodes += 1;
        let (path, file) = (self.path, self.file);
        let fault = |why: String| FormatError::field(path, format!("node {}", node.index()), why);
        if depth > MAX_DEPTH || self.is_too_large() {
            return Err(fault("the scene is too deep or large".into()));
        }
        let here = above * local(node);
        if let Some(mesh) = node.mesh() {
            // The transform of the node of a skinned mesh has no effect: its joints place it.
            let joints = node.skin().map(|s| skin_matrices(file, &s, &self.world));
            let joints = joints
                .transpose()
                .map_err(|why| fault(format!("skin: {why}")))?;
            let transforms: Vec<Matrix4<f32>> = match joints {
                Some(_) => vec![Matrix4::identity()],
                None => {
                    let own = instances(file, node.index()).map_err(fault)?;
                    own.iter().map(|i| here * i).collect()
                }
            };
            self.nodes = self.nodes.saturating_add(transforms.len() - 1);
            let index = mesh.index();
            let name = mesh
                .name()
                .map_or_else(|| format!("mesh {index}"), str::to_owned);
            for (k, primitive) in mesh.primitives().enumerate() {
                if self.is_too_large() {
                    break;
                }
                let material = primitive.material();
                let placed = PlacedPrimitive {
                    primitive: &primitive,
                    names: PartName {
                        object: node.name().unwrap_or_default().to_owned(),
                        group: name.clone(),
                        material: material.name().unwrap_or_default().to_owned(),
                    },
                    place: format!("{name}, primitive {k}"),
                    weights: &morph_weights(node),
                    joints: joints.as_deref(),
                    transforms: &transforms,
                };
                self.primitive(&placed)?;
            }
        }
        for child in node.children() {
            self.node(&child, &here, depth + 1)?;
        }
        Ok(())
    }

    fn is_too_large(&self) -> bool {
        self.nodes > MAX_NODES || self.read > MAX_VERTICES || self.out.vertices.len() > MAX_VERTICES
    }

    /// Adds all instances of a primitive.
    fn primitive(&mut self, placed: &PlacedPrimitive<'_, '_>) -> Result<(), FormatError> {
        let fault = |(field, why): (&str, String)| {
            FormatError::field(self.path, format!("{}: {field}", placed.place), why)
        };
        let (weights, joints) = (placed.weights, placed.joints);
        let shape = PrimitiveShape::read(self.file, placed.primitive, weights, joints);
        let Some(mut shape) = shape.map_err(fault)? else {
            self.flat += 1;
            return Ok(());
        };
        self.degenerate += shape.degenerate;
        self.read += shape.vertices.len();
        if self.base_colors.is_none() {
            shape.drop_unused();
        }
        for transform in placed.transforms {
            if self.out.vertices.len() > MAX_VERTICES {
                break;
            }
            let moved = shape.vertices.iter().map(|v| transform.transform_point(v));
            let moved: Vec<P3> = moved.collect();
            let mut faces = shape.faces.clone();
            // A mirrored mesh is turned inside out.
            if transform.determinant() < 0.0 {
                faces.iter_mut().for_each(|f| f.swap(1, 2));
            }
            self.append(placed, moved, faces)?;
            self.out.uv.extend(&shape.uv);
        }
        Ok(())
    }

    /// Adds the vertices and faces of an instance of a primitive, in the frame of the scene.
    fn append(
        &mut self,
        placed: &PlacedPrimitive<'_, '_>,
        vertices: Vec<P3>,
        faces: Vec<Face>,
    ) -> Result<(), FormatError> {
        let (path, p) = (self.path, placed.primitive);
        let fault = |field: &str, why: String| {
            FormatError::field(path, format!("{}: {field}", placed.place), why)
        };
        let first = self.out.faces.len();
        let base = self.out.vertices.len() as u32;
        self.out
            .faces
            .extend(faces.iter().map(|f| f.map(|i| i + base)));
        if let Some(base_colors) = &mut self.base_colors {
            let colors = base_colors.of_primitive(p, vertices.len());
            let colors = colors.map_err(|why| fault("base colour", why))?;
            self.out.colors.extend(colors);
            let surface = PrimitiveSurface {
                vertices: &vertices,
                faces: &faces,
                first,
            };
            base_colors
                .points_of_primitive(p, surface, &mut self.out.texture)
                .map_err(|why| fault("base colour", why))?;
            self.out.vertices.extend(vertices);
        } else {
            // Checked alone first, so that an error names the primitive's own vertex.
            let mesh = TriMesh::new(vertices, faces).map_err(|e| fault("mesh", e.to_string()))?;
            self.out.vertices.extend(mesh.vertices());
        }
        let material = p.material();
        self.out.parts.push(GltfPart {
            names: placed.names.clone(),
            faces: first..self.out.faces.len(),
            color: material.pbr_metallic_roughness().base_color_factor(),
            double_sided: material.double_sided(),
        });
        Ok(())
    }
}
