//! Reading of a mesh garment, and its pieces on another body.

use super::classifier::PieceClassifier;
use super::layers::by_layer;
use super::piece::{GarmentPiece, PieceBuilder};
use crate::body::Template;
use crate::dressing::body_sections::BodySections;
use crate::dressing::error::MeshGarmentError;
use crate::dressing::retarget::Retargeting;
use crate::dressing::skin_binding::skin_normals;
use crate::dressing::source_body::SourceBody;
use crate::formats::sewn_obj::SewnObj;
use crate::garment::import::{read_mesh, split};
use crate::garment::{GarmentError, GarmentKind, GarmentMesh, Material};
use crate::math::P3;
use crate::spatial::PointTree;
use std::path::Path;
use std::sync::Arc;

/// Least height of cloth above the skin at the start, metres.
const ABOVE: f32 = 0.006;
/// Distance from the skin within which cloth is lifted, metres.
const NEAR: f32 = 0.04;

/// A garment file and the body that it was made on, ready for [`dress_all`](crate::dressing::dress_all).
#[derive(Clone, Debug)]
pub struct MeshGarment {
    /// Name of the file, or of the clothes in it.
    pub name: String,
    /// Findings about the file and decisions about its pieces, for people.
    pub notes: Vec<String>,
    source: Arc<Template>,
    /// Innermost first.
    pieces: Vec<GarmentPiece>,
}

impl MeshGarment {
    /// Reads a garment (`.obj`, `.glb`, `.gltf`, `.mhclo`) made on `body` (see [`SourceBody::read`]); without one a guess is
    /// made. Meshes without flat panels get triangles with edges of `edge` metres, flat panels where theirs are shorter.
    ///
    /// # Errors
    /// A fault of one of the files, by its edge, face or vertex.
    pub fn read(
        path: &Path,
        body: Option<&Path>,
        material: &Material,
        edge: f64,
    ) -> Result<Self, MeshGarmentError> {
        Self::read_on(
            path,
            body.map(SourceBody::read).transpose()?,
            material,
            edge,
        )
    }
    /// As [`Self::read`], on a body that has been read.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_on(
        path: &Path,
        body: Option<SourceBody>,
        material: &Material,
        edge: f64,
    ) -> Result<Self, MeshGarmentError> {
        let file = read_mesh(path, body.as_ref().map(|b| b.file.as_slice()))?;
        let raw = file.sewn.obj.mesh.vertices();
        let has_binding = path.extension().is_some_and(|e| e == "mhclo");
        let source = match body {
            // The body lacks the vertices that the binding names: the file's own positions, moved over its skin.
            Some(b) if has_binding && !file.bound => b.under(raw),
            Some(b) => b,
            None => SourceBody::guess(raw)?,
        };
        let mut notes = vec![format!("made on {}", source.description)];
        if file.turned > 0 {
            notes.push(format!(
                "{} faces turned over to agree with their neighbours",
                file.turned
            ));
        }
        let sewn = in_metres(file.sewn, &source)
            .map_err(|why| MeshGarmentError::Piece { piece: 0, why })?;
        let classifier = PieceClassifier::new(&source.template);
        let builder = PieceBuilder {
            classifier: &classifier,
            name: &file.name,
            material,
            edge,
        };
        let pieces = build(&builder, &sewn, &mut notes)?;
        if pieces.is_empty() {
            let why = format!("{}: no piece with an area", path.display());
            return Err(MeshGarmentError::Nothing(why));
        }
        Ok(Self {
            name: file.name,
            notes,
            source: source.template.clone(),
            pieces,
        })
    }
    /// The same under another name, which its garments get too.
    #[must_use]
    pub fn named(mut self, name: &str) -> Self {
        for p in &mut self.pieces {
            p.garment.name = name.to_owned();
        }
        self.name = name.to_owned();
        self
    }
    /// Layer among other garments: tops and dresses lie over skirts and trousers.
    pub fn layer(&self) -> u8 {
        let is_outer =
            |p: &GarmentPiece| matches!(p.garment.kind, GarmentKind::Top | GarmentKind::Dress);
        u8::from(self.pieces.iter().any(is_outer))
    }
    /// Vertices of all pieces.
    pub fn vertices(&self) -> usize {
        self.pieces.iter().map(|p| p.garment.vertices).sum()
    }
    /// The pieces on another body, innermost first: meshes, and positions in the canonical pose (m).
    pub(in crate::dressing) fn retargeted(
        &self,
        template: &Template,
        sections: &BodySections,
    ) -> Vec<(GarmentMesh, Vec<P3>)> {
        let map = Retargeting::new(&self.source, template, sections);
        let skin = &sections.vertices;
        let normals = skin_normals(template, skin);
        let tree = PointTree::new(skin);
        let lift = |p: P3| match tree.nearest(&p, NEAR) {
            Some((i, _)) => p + normals[i] * (ABOVE - normals[i].dot(&(p - skin[i]))).max(0.0),
            None => p,
        };
        let pieces = self.pieces.iter();
        pieces.map(|p| p.retargeted(&map, lift)).collect()
    }
}

/// The surface in the frame of the source body.
fn in_metres(mut sewn: SewnObj, source: &SourceBody) -> Result<SewnObj, GarmentError> {
    let x = source.to_metres(sewn.obj.mesh.vertices());
    sewn.obj.mesh = sewn.obj.mesh.with_vertices(x).map_err(GarmentError::Mesh)?;
    for c in sewn.obj.uv.iter_mut().flatten() {
        *c *= source.unit();
    }
    Ok(sewn)
}

/// Sheets of cloth in layers, over one rigid piece with all accessories.
fn build(
    builder: &PieceBuilder<'_>,
    sewn: &SewnObj,
    notes: &mut Vec<String>,
) -> Result<Vec<GarmentPiece>, MeshGarmentError> {
    let (cloth, rigid): (Vec<SewnObj>, Vec<SewnObj>) = split(sewn)
        .into_iter()
        .partition(|p| builder.classifier.is_cloth(p));
    let mut pieces = Vec::new();
    for (piece, s) in cloth.into_iter().enumerate() {
        let (p, note) = builder
            .cloth(s)
            .map_err(|why| MeshGarmentError::Piece { piece, why })?;
        notes.push(format!("piece {piece}: {note}"));
        pieces.push(p);
    }
    let piece = pieces.len();
    pieces = by_layer(pieces);
    let made = builder
        .rigid(&rigid)
        .map_err(|why| MeshGarmentError::Piece { piece, why })?;
    if let Some(p) = made {
        notes.push(format!(
            "{} {} of {} vertices carried by the skin: no cloth that falls",
            rigid.len(),
            if rigid.len() == 1 { "part" } else { "parts" },
            p.garment.vertices
        ));
        pieces.insert(0, p);
    }
    for (layer, p) in pieces.iter_mut().enumerate() {
        p.garment.layer = layer.min(255) as u8;
    }
    Ok(pieces)
}
