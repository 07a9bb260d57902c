//! Dressed bodies as glTF: body and garments on one skin, a morph target a captured scan, and the motion.

use anyhow::{Context, Result};
use std::path::Path;
use tryon::body::{PosedSkin, RestBody, SkinWeights};
use tryon::clothcap::DressedPose;
use tryon::clothcap::archive::CaptureHeader;
use tryon::clothcap::picture::part_color;
use tryon::clothcap::texture::TextureAtlas;
use tryon::clothcap::topology::ClothTemplate;
use tryon::formats::gltf::{
    GlbInterpolation, GlbJoint, GlbJointMotion, GlbMesh, GlbMorphMotion, GlbMorphTarget,
    SkinnedGlb, SkinnedMesh, write_skinned_glb,
};
use tryon::formats::write_obj_scene;
use tryon::geometry::math::{P3, P3d, V3};

/// Dressed body in each frame of a motion.
pub(super) struct DressedMotion<'a> {
    pub(super) surface: &'a ClothTemplate,
    pub(super) header: &'a CaptureHeader,
    /// PNG file of each garment's texture; empty for captures without.
    pub(super) textures: &'a [Vec<u8>],
    pub(super) body: &'a RestBody,
    pub(super) frames: &'a [DressedPose],
    /// Time of each frame, seconds.
    pub(super) seconds: &'a [f64],
    /// A morph target a frame after the first; without, the skin alone moves the garments.
    pub(super) has_targets: bool,
}

/// One mesh at rest and its changes from frame to frame.
struct RestMesh {
    name: String,
    nodes: Vec<usize>,
    vertices: Vec<P3>,
    /// Displacements of each later frame from the first.
    targets: Vec<Vec<V3>>,
    /// Colours of the vertices; empty with a texture.
    colors: Vec<[u8; 3]>,
    faces: Vec<[u32; 3]>,
    uv: Vec<[f32; 2]>,
    /// PNG file; empty for none.
    texture: Vec<u8>,
}

/// Joints and weights of each vertex.
type SkinRows = (Vec<[u8; 4]>, Vec<[f32; 4]>);

impl RestMesh {
    /// The mesh over the vertices of an atlas, with its texture in place of colours.
    fn textured(self, atlas: &TextureAtlas, png: &[u8]) -> Self {
        fn taken<T: Copy>(all: &[T], atlas: &TextureAtlas) -> Vec<T> {
            atlas.vertex.iter().map(|v| all[*v as usize]).collect()
        }
        Self {
            nodes: taken(&self.nodes, atlas),
            vertices: taken(&self.vertices, atlas),
            targets: self.targets.iter().map(|t| taken(t, atlas)).collect(),
            colors: Vec::new(),
            faces: atlas.faces.clone(),
            uv: atlas.uv.clone(),
            texture: png.to_vec(),
            name: self.name,
        }
    }

    fn surface(&self) -> GlbMesh<'_> {
        GlbMesh {
            name: &self.name,
            vertices: &self.vertices,
            faces: &self.faces,
            uv: &self.uv,
            color: [255; 3],
            texture: &self.texture,
        }
    }

    /// Mean of the vertices' colours; white without.
    fn mean_color(&self) -> [u8; 3] {
        let n = self.colors.len() as u32;
        let sum = |k: usize| self.colors.iter().map(|c| u32::from(c[k])).sum::<u32>();
        [0, 1, 2].map(|k| sum(k).checked_div(n).map_or(u8::MAX, |mean| mean as u8))
    }

    /// Morph targets, named after the scans; the first scan is the mesh itself.
    fn morph_targets<'a>(&'a self, scans: &'a [String]) -> Vec<GlbMorphTarget<'a>> {
        let named = self.targets.iter().enumerate();
        named
            .map(|(k, deltas)| GlbMorphTarget {
                name: scans.get(k + 1).map_or("frame", String::as_str),
                deltas,
            })
            .collect()
    }
}

impl DressedMotion<'_> {
    /// Writes body and garments of the first frame as OBJ, with materials and textures beside it.
    pub(super) fn write_obj(&self, path: &Path) -> Result<()> {
        let Some(frame) = self.frames.first() else {
            return Ok(());
        };
        let mut meshes = self.rest_meshes();
        let posed = std::iter::once(&frame.body).chain(&frame.garments);
        for (mesh, vertices) in meshes.iter_mut().zip(posed) {
            (mesh.vertices, mesh.targets) = (vertices.clone(), Vec::new());
        }
        let meshes = self.textured(meshes);
        let surfaces: Vec<GlbMesh<'_>> = meshes
            .iter()
            .map(|m| GlbMesh {
                color: m.mean_color(),
                ..m.surface()
            })
            .collect();
        write_obj_scene(path, &surfaces).with_context(|| format!("{}", path.display()))?;
        Ok(())
    }

    /// Writes body and garments to one file.
    pub(super) fn write(&self, path: &Path) -> Result<()> {
        let skeleton = self.surface.body().skeleton();
        let joints: Vec<GlbJoint<'_>> = skeleton
            .joints()
            .iter()
            .zip(&self.body.joints)
            .map(|(j, rest)| GlbJoint {
                name: &j.name,
                parent: j.parent,
                rest: *rest,
            })
            .collect();
        let rotations: Vec<_> = self
            .frames
            .iter()
            .map(|f| f.pose.local_rotations(skeleton))
            .collect();
        let roots: Vec<P3d> = self
            .frames
            .iter()
            .map(|f| f.pose.root.point(&self.body.joints[0]))
            .collect();
        let meshes = self.textured(self.rest_meshes());
        // Frame k shows target k − 1 alone; the first one none.
        let count = self.frames.len();
        let shown = |k: usize| (1..count).map(|t| f32::from(u8::from(t == k))).collect();
        let shown: Vec<Vec<f32>> = (0..count).map(shown).collect();
        let rows: Vec<SkinRows> = meshes.iter().map(|m| self.skin_rows(&m.nodes)).collect();
        let targets: Vec<Vec<GlbMorphTarget<'_>>> = meshes
            .iter()
            .map(|m| m.morph_targets(&self.header.scans))
            .collect();
        let skinned: Vec<SkinnedMesh<'_>> = meshes
            .iter()
            .zip(&rows)
            .zip(&targets)
            .map(|((m, (joints, weights)), targets)| SkinnedMesh {
                surface: m.surface(),
                colors: &m.colors,
                joints,
                weights,
                targets,
                target_weights: &[],
                target_motion: (!targets.is_empty()).then_some(GlbMorphMotion {
                    seconds: self.seconds,
                    weights: &shown,
                    interpolation: GlbInterpolation::Step,
                }),
            })
            .collect();
        let glb = SkinnedGlb {
            joints: &joints,
            meshes: &skinned,
            motion: Some(GlbJointMotion {
                seconds: self.seconds,
                roots: &roots,
                rotations: &rotations,
            }),
        };
        write_skinned_glb(path, &glb).with_context(|| format!("{}", path.display()))
    }

    /// Weights of all vertices of the clothed template, those of the body among them.
    fn weights(&self) -> &SkinWeights {
        self.surface.template().weights()
    }

    fn skin_rows(&self, nodes: &[usize]) -> SkinRows {
        let weights = self.weights();
        let joints = nodes.iter().map(|v| weights.joints[*v]).collect();
        (joints, nodes.iter().map(|v| weights.weights[*v]).collect())
    }

    /// Body, then garments.
    fn rest_meshes(&self) -> Vec<RestMesh> {
        let body = self.surface.body().mesh();
        let all: Vec<usize> = (0..body.vertices().len()).collect();
        let mut out = vec![self.rest_mesh("body".into(), all, |f| &f.body)];
        out[0].faces = body.faces().to_vec();
        out[0].colors = vec![part_color(0); out[0].vertices.len()];
        let outfit = &self.header.outfit;
        for (k, part) in outfit.cloth.parts.iter().enumerate() {
            let nodes = part.nodes.iter().map(|v| *v as usize).collect();
            let mut mesh = self.rest_mesh(part.slot.name().into(), nodes, |f| &f.garments[k]);
            mesh.faces.clone_from(&part.faces);
            mesh.colors.clone_from(&outfit.colors[k]);
            out.push(mesh);
        }
        out
    }

    /// Body and garments, those with a texture over the vertices of its atlas.
    fn textured(&self, meshes: Vec<RestMesh>) -> Vec<RestMesh> {
        let atlases = self.header.outfit.atlases.iter().zip(self.textures);
        let mut atlases = std::iter::once(None).chain(atlases.map(Some));
        let textured = |mesh: RestMesh| match atlases.next().flatten() {
            Some((atlas, png)) => mesh.textured(atlas, png),
            None => mesh,
        };
        meshes.into_iter().map(textured).collect()
    }

    fn rest_mesh(
        &self,
        name: String,
        nodes: Vec<usize>,
        posed: impl Fn(&DressedPose) -> &Vec<P3>,
    ) -> RestMesh {
        let rest = |f: &DressedPose| {
            let skin = PosedSkin::blended(self.weights(), &f.bones);
            skin.unpose(nodes.iter().copied(), posed(f))
        };
        let mut frames = self.frames.iter().map(rest);
        let vertices = frames.next().unwrap_or_default();
        let change = |f: Vec<P3>| f.iter().zip(&vertices).map(|(a, b)| a - b).collect();
        let targets = if self.has_targets {
            frames.map(change).collect()
        } else {
            Vec::new()
        };
        RestMesh {
            name,
            targets,
            vertices,
            nodes,
            colors: Vec::new(),
            faces: Vec::new(),
            uv: Vec::new(),
            texture: Vec::new(),
        }
    }
}
