//! Reading of a mesh garment, and its pieces on another body.

use super::avatar::DressedAvatar;
use super::classifier::PieceClassifier;
use super::file_part::{PartRole, carried};
use super::layers::by_layer;
use super::linings::linings;
use super::piece::{GarmentPiece, PieceBuilder};
use super::sizing::{Sizing, SourceCloth};
use super::skin_lift::lifted;
use crate::body_sections::BodySections;
use crate::error::MeshGarmentError;
use crate::file_frame::FileFrame;
use crate::finished::FinishedGarment;
use crate::retarget::Retargeting;
use crate::settings::MeshGarmentSettings;
use crate::source_body::SourceBody;
use crate::suggest::Suggestion;
use std::path::Path;
use std::sync::Arc;
use tryon_body::measure::Measurements;
use tryon_body::{SkinSearch, Template};
use tryon_formats::mesh_frame::MeshFrame;
use tryon_formats::obj::ObjMesh;
use tryon_formats::sewn_obj::SewnObj;
use tryon_garment::import::{read_mesh, split};
use tryon_garment::{FabricImage, GarmentError, GarmentKind, GarmentMesh, Material, Size};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::TriMesh;

/// A mesh file with a garment.
#[derive(Clone, Debug)]
pub struct GarmentFile<'a> {
    /// `.obj`, `.glb`, `.gltf` or `.mhclo`.
    pub path: &'a Path,
    /// The body that it was made on.
    pub body: Option<SourceBody>,
    /// Unit and axes as far as they are stated.
    pub frame: MeshFrame,
}

impl<'a> GarmentFile<'a> {
    /// A file of unit and axes that are to be found.
    pub fn new(path: &'a Path, body: Option<SourceBody>) -> Self {
        Self {
            path,
            body,
            frame: MeshFrame::default(),
        }
    }
}

/// A garment file and the body that it was made on, ready for [`dress_all`](crate::dress_all).
#[derive(Clone, Debug)]
pub struct MeshGarment {
    /// Name of the file, or of the clothes in it.
    pub name: String,
    /// Findings about the file and decisions about its pieces, for people.
    pub notes: Vec<String>,
    /// Colour, sRGB; `None` where nobody said.
    pub color: Option<[u8; 3]>,
    /// Image in place of the colour, for texture coordinates of its drawn meshes; see [`MeshGarment::with_image`].
    pub image: Option<Arc<FabricImage>>,
    source: Arc<Template>,
    /// From its file to the source body.
    frame: FileFrame,
    /// Innermost first.
    pub(super) pieces: Vec<GarmentPiece>,
    /// Order on the body; `None` for that of its kind.
    layer: Option<u8>,
    /// Absent for a garment on a guessed body, and for one without cloth.
    sizing: Option<Arc<Sizing>>,
    /// Size that it is in; `None` while it is made to measure.
    size: Option<Size>,
    settings: MeshGarmentSettings,
}

impl MeshGarment {
    /// Reads a garment (`.obj`, `.glb`, `.gltf`, `.mhclo`) made on `body` (see [`SourceBody::read`]); without one a guess is
    /// made. Unit and axes are found.
    ///
    /// # Errors
    /// A fault of one of the files, by its edge, face or vertex.
    pub fn read(
        path: &Path,
        body: Option<&Path>,
        material: &Material,
        settings: &MeshGarmentSettings,
    ) -> Result<Self, MeshGarmentError> {
        let body = body.map(SourceBody::read).transpose()?;
        Self::read_on(GarmentFile::new(path, body), material, settings)
    }
    /// As [`Self::read`], on a body that has been read, or in a frame that is stated.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn read_on(
        file: GarmentFile<'_>,
        material: &Material,
        settings: &MeshGarmentSettings,
    ) -> Result<Self, MeshGarmentError> {
        let GarmentFile { path, body, frame } = file;
        let file = read_mesh(path, body.as_ref().map(|b| b.file.as_slice()))?;
        let avatar = match &body {
            None => DressedAvatar::find(&file.sewn, &frame, &settings.avatar)?,
            Some(_) => None,
        };
        let (sewn, body, note) = match avatar {
            Some(a) => (a.clothes, Some(a.body), Some(a.note)),
            None => (file.sewn, body, None),
        };
        let raw = sewn.obj.mesh.vertices();
        let is_avatar = note.is_some();
        let has_binding = path.extension().is_some_and(|e| e == "mhclo");
        let source = match body {
            // The body lacks the vertices that the binding names: the file's own positions, moved over its skin.
            Some(b) if file.bound || is_avatar => b,
            Some(b) if has_binding => b.under(raw, &frame, &settings.guess)?,
            Some(b) => b.wearing(raw, &frame, &settings.guess)?,
            None => SourceBody::guess(raw, &frame, &settings.guess)?,
        };
        let sewn =
            in_metres(sewn, &source).map_err(|why| MeshGarmentError::Piece { piece: 0, why })?;
        let mut out = Self::build(&file.name, &sewn, source, material, settings)?;
        out.notes.extend(note.into_iter().chain(file.notes));
        Ok(out)
    }
    /// A garment over a body in its rest pose, `mesh` in the frame of the body, metres.
    ///
    /// # Errors
    /// A fault of the mesh, by its edge, face or vertex.
    pub fn on_body(
        name: &str,
        mesh: TriMesh,
        body: SourceBody,
        material: &Material,
        settings: &MeshGarmentSettings,
    ) -> Result<Self, MeshGarmentError> {
        let sewn = SewnObj {
            obj: ObjMesh::from(mesh),
            stitches: Vec::new(),
        };
        Self::build(name, &sewn, body, material, settings)
    }
    /// Pieces of a surface in the frame of the body, metres.
    fn build(
        name: &str,
        sewn: &SewnObj,
        source: SourceBody,
        material: &Material,
        settings: &MeshGarmentSettings,
    ) -> Result<Self, MeshGarmentError> {
        let mut notes = vec![format!("made on {}", source.description)];
        let classifier = PieceClassifier::new(&source.template, &settings.classifier);
        let builder = PieceBuilder {
            classifier: &classifier,
            name,
            material,
            settings,
        };
        let pieces = build(&builder, sewn, &mut notes)?;
        if pieces.is_empty() {
            let why = format!("{name}: no piece with an area");
            return Err(MeshGarmentError::Nothing(why));
        }
        let mut out = Self {
            name: name.to_owned(),
            notes,
            color: None,
            image: None,
            source: source.template.clone(),
            frame: source.frame(),
            pieces,
            layer: None,
            sizing: None,
            size: None,
            settings: *settings,
        };
        if source.is_known {
            out.add_sizes(material);
        }
        Ok(out)
    }
    /// Measures the garment on its body.
    fn add_sizes(&mut self, material: &Material) {
        let cloth = SourceCloth {
            name: &self.name,
            material,
            pieces: &self.pieces,
            positions: &self.off_skin(),
            settings: &self.settings,
        };
        self.sizing = Sizing::new(&self.source, &cloth).map(Arc::new);
        if let Some(sizing) = &self.sizing {
            self.notes.push(format!("made in size {}", sizing.size()));
        }
    }
    /// Vertices of each piece off the skin of the source body, metres.
    fn off_skin(&self) -> Vec<Vec<P3>> {
        let skin = SkinSearch::new(&self.source, self.source.mesh().vertices(), 0.0);
        let lift = &self.settings.lift;
        let piece = |p: &GarmentPiece| {
            p.positions
                .iter()
                .map(|p| lifted(&skin, *p, lift))
                .collect()
        };
        self.pieces.iter().map(piece).collect()
    }
    /// Size of the body that it was made on; `None` for a garment in one size, made to measure.
    pub fn own_size(&self) -> Option<Size> {
        self.sizing.as_ref().map(|s| s.size())
    }
    /// The garment in a size: its rest shape is that on its own body, graded by the steps of the size table. `None` for a
    /// garment in one size.
    pub fn in_size(&self, size: Size) -> Option<Self> {
        let sizing = self.sizing.as_ref()?;
        let grading = sizing.grading(size);
        let pieces = self.pieces.iter().zip(self.off_skin());
        let pieces = pieces.map(|(p, x)| p.in_size(size, &grading, &x, &self.settings.piece));
        Some(Self {
            pieces: pieces.collect(),
            size: Some(size),
            ..self.clone()
        })
    }
    /// Measures in the size that it is in; `None` while it is made to measure.
    pub fn finished(&self) -> Option<FinishedGarment> {
        self.finished_in(self.size?)
    }
    /// Measures in a size.
    pub(crate) fn finished_in(&self, size: Size) -> Option<FinishedGarment> {
        let finished = self.sizing.as_ref()?.finished(size);
        Some(FinishedGarment {
            name: self.name.clone(),
            ..finished
        })
    }
    /// Size for a body: that of the body, or the first larger one with enough ease. `None` for a garment in one size.
    pub fn suggest(&self, body: &Measurements) -> Option<Suggestion> {
        self.sizing.as_ref()?.suggest(body)
    }
    /// The same in another place in the order of garments, 0 innermost.
    #[must_use]
    pub fn in_layer(self, layer: u8) -> Self {
        Self {
            layer: Some(layer),
            ..self
        }
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
    /// Layer among other garments: tops and dresses lie over skirts and trousers unless it says otherwise.
    pub fn layer(&self) -> u8 {
        self.layer.unwrap_or_else(|| self.layer_of_kind())
    }
    fn layer_of_kind(&self) -> u8 {
        let is_outer =
            |p: &GarmentPiece| matches!(p.garment.kind, GarmentKind::Top | GarmentKind::Dress);
        u8::from(self.pieces.iter().any(is_outer))
    }
    /// Points of its file over the body that it was made on: metres, y up, facing +z.
    pub fn in_metres(&self, points: &[P3]) -> Vec<P3> {
        points.iter().map(|p| self.frame.to_metres(p)).collect()
    }
    /// Vertices of all pieces.
    pub fn vertices(&self) -> usize {
        self.pieces.iter().map(|p| p.garment.vertices).sum()
    }
    /// The pieces on another body, innermost first: meshes, and positions in the canonical pose (m).
    pub(crate) fn retargeted(
        &self,
        template: &Template,
        sections: &BodySections,
    ) -> Vec<(GarmentMesh, Vec<P3>)> {
        let map = Retargeting::new(&self.source, template, sections, &self.settings.retarget);
        let skin = SkinSearch::new(template, &sections.vertices, 0.0);
        let pieces = self.pieces.iter();
        pieces
            .map(|p| p.retargeted(&map, &skin, &self.settings))
            .collect()
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

/// Checks that one sheet of cloth at the least goes around the body.
fn check_worn(cloth: &[GarmentPiece], least: f64) -> Result<(), MeshGarmentError> {
    let most = cloth.iter().map(|p| p.wrap).fold(0.0, f64::max);
    if cloth.is_empty() || most >= least {
        return Ok(());
    }
    Err(MeshGarmentError::NotWorn {
        most: (100.0 * most).round() as u32,
        least: (100.0 * least).round() as u32,
    })
}

/// Sheets of cloth in layers, over one rigid piece with all accessories.
fn build(
    builder: &PieceBuilder<'_>,
    sewn: &SewnObj,
    notes: &mut Vec<String>,
) -> Result<Vec<GarmentPiece>, MeshGarmentError> {
    let (mut cloth, mut fastenings, mut accessories) = (Vec::new(), Vec::new(), Vec::new());
    for part in split(sewn) {
        match builder.classifier.role(&part) {
            PartRole::Cloth => cloth.push(part),
            PartRole::Fastening => fastenings.push(part),
            PartRole::Accessory => accessories.push(part),
        }
    }
    let mut pieces = Vec::new();
    for (piece, s) in cloth.into_iter().enumerate() {
        let (p, note) = builder
            .cloth(piece, s)
            .map_err(|why| MeshGarmentError::Piece { piece, why })?;
        notes.push(note);
        pieces.push(p);
    }
    check_worn(&pieces, builder.settings.classifier.wrap)?;
    let piece = pieces.len();
    pieces = by_layer(pieces);
    let lined = linings(&pieces, &builder.settings.lining);
    let lined = lined.iter().zip(&pieces);
    notes.extend(lined.filter_map(|(outer, lining)| {
        let outer = &pieces[(*outer)?];
        Some(format!("{} is the lining of {}", lining.part, outer.part))
    }));
    notes.extend(carried(&fastenings, "fastening", "fastenings"));
    notes.extend(carried(&accessories, "accessory", "accessories"));
    let rigid: Vec<SewnObj> = fastenings.into_iter().chain(accessories).collect();
    let made = builder
        .rigid(&rigid)
        .map_err(|why| MeshGarmentError::Piece { piece, why })?;
    if let Some(p) = made {
        pieces.insert(0, p);
    }
    for (layer, p) in pieces.iter_mut().enumerate() {
        p.garment.layer = layer.min(255) as u8;
    }
    Ok(pieces)
}
