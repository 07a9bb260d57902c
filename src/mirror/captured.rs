//! Captured garments as garments to wear: each part of a capture on the undressed body of its own subject.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use tryon_body::Template;
use tryon_clothcap::archive::{CaptureArchive, CaptureHeader, FrameDisplacements};
use tryon_clothcap::multi::ClothPart;
use tryon_clothcap::retarget::on_body;
use tryon_clothcap::segment::Slot;
use tryon_clothcap::texture::{GarmentTexture, Texel, TextureAtlas};
use tryon_clothcap::topology::ClothTemplate;
use tryon_dressing::{MeshGarment, MeshGarmentError, MeshGarmentSettings, SourceBody};
use tryon_formats::FormatError;
use tryon_garment::{FabricImage, Material, RenderMesh};
use tryon_geometry::math::order_statistics::medians;
use tryon_geometry::math::{P3, V3};
use tryon_geometry::spatial::{Bvh, SurfacePoint};

/// Garments of one capture, on its subject's body under them in the rest pose (eq. 22 to 25).
#[derive(Debug)]
pub struct CapturedWardrobe {
    header: CaptureHeader,
    displacements: FrameDisplacements,
    /// Textures of the parts; empty for captures without.
    textures: Vec<GarmentTexture>,
    body: SourceBody,
    /// Vertices of the clothed template on the body, metres, shape `[vertices]`.
    surface: Vec<P3>,
    /// Names of the parts.
    names: Vec<String>,
}

impl CapturedWardrobe {
    /// True for a folder that holds a capture.
    pub fn is_in(folder: &Path) -> bool {
        CaptureArchive::is_in(folder)
    }

    /// Reads a capture of bodies of `template`; the garments are those of its first finished scan.
    ///
    /// # Errors
    /// A file of the capture, by its field, or a capture without a finished scan.
    pub fn read(folder: &Path, template: &Arc<Template>) -> Result<Self, FormatError> {
        let (archive, header) = CaptureArchive::open(folder, template)?;
        let mut records = header
            .scans
            .iter()
            .map(|scan| archive.record(scan, template));
        let first = records.find_map(Result::transpose).ok_or_else(|| {
            FormatError::field(folder, "scans", "the capture has no finished scan")
        })??;
        let displacements = archive.displacements(&first.scan, &header, template)?;

        let rest = template.personalise(&first.body.shape);
        let moved = rest.vertices.iter().zip(&displacements.body);
        let skin: Vec<P3> = moved.map(|(p, d)| p + d).collect();
        let title = format!("the subject of {}", folder.display());
        let cloth = ClothTemplate::new(template, header.outfit.cloth.legs);
        let cloth =
            cloth.map_err(|e| FormatError::field(folder, "outfit.cloth.legs", e.to_string()))?;
        let surface = cloth.extend(&skin);
        let body = template.at_rest(&title, skin, &rest.joints);
        let body = body.map_err(|e| FormatError::field(folder, "body", e.to_string()))?;
        Ok(Self {
            names: names(&header.outfit.cloth.parts),
            body: SourceBody::of_template(Arc::new(body)),
            textures: archive.textures(&header)?,
            header,
            displacements,
            surface,
        })
    }

    /// Names of the garments, unique in the capture: `top`, `under`, `bottom` …
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Place on the body of garment `k`.
    pub fn slot(&self, k: usize) -> Slot {
        self.header.outfit.cloth.parts[k].slot
    }

    /// Garment `k` of a material, under a name of its own; its triangles get edges of `edge` metres.
    ///
    /// # Errors
    /// A fault of its mesh, by its edge, face or vertex.
    pub fn garment(
        &self,
        k: usize,
        name: &str,
        material: &Material,
        edge: f64,
    ) -> Result<MeshGarment, MeshGarmentError> {
        let outfit = &self.header.outfit;
        let part = &outfit.cloth.parts[k];
        let vertices = on_body(part, &self.displacements.garments[k], &self.surface);
        let mesh = part.trimmed(&vertices).ok_or_else(|| {
            MeshGarmentError::Nothing(format!("{name}: nothing is left of its narrow strips"))
        })?;
        let settings = MeshGarmentSettings::with_edge(edge);
        let made = MeshGarment::on_body(name, mesh, self.body.clone(), material, &settings)?;
        let mut garment = made.in_layer(layer(part.slot));
        garment.color = color(part, &outfit.colors[k]);
        let texture = outfit.atlases.get(k).zip(self.textures.get(k));
        Ok(match texture {
            Some((atlas, texture)) => {
                let captured = CapturedSurface {
                    bvh: Bvh::new(&part.faces, &vertices),
                    vertices: &vertices,
                    atlas,
                    texture,
                };
                captured.paint(garment)
            }
            None => garment,
        })
    }
}

/// Textured surface of a captured part on its subject's body.
struct CapturedSurface<'a> {
    bvh: Bvh,
    /// Metres, shape `[vertices]`.
    vertices: &'a [P3],
    atlas: &'a TextureAtlas,
    texture: &'a GarmentTexture,
}

impl CapturedSurface<'_> {
    /// Paints a garment made from this surface, whose triangles are others, with the colours at its nearest points.
    fn paint(&self, garment: MeshGarment) -> MeshGarment {
        let (x, faces) = garment.surface();
        let texel = self.atlas.size.texel;
        let atlas = TextureAtlas::new(&x, &faces, texel);
        let painted = GarmentTexture::filled(&atlas, |f, texels| {
            let corners = faces[f].map(|v| x[v as usize].coords);
            let mut near = None;
            let color = |t: &Texel| {
                let at: V3 = (0..3).map(|k| corners[k] * t.weights[k]).sum();
                let found = self.bvh.closest_near(self.vertices, &P3::from(at), near);
                near = found.map(|f| f.face);
                let color = |f: SurfacePoint| {
                    let face = f.face as usize;
                    self.texture.sample(self.atlas, face, f.weights)
                };
                found.map_or([0.0; 3], color)
            };
            texels.iter().map(color).collect()
        });
        let size = atlas.size;
        let metres = [size.width, size.height].map(|n| n as f32 * size.texel);
        let drawn = RenderMesh {
            uv: (atlas.uv.iter())
                .map(|t| [t[0] * metres[0], t[1] * metres[1]])
                .collect(),
            vertex: atlas.vertex,
            faces: atlas.faces,
            trims: vec![],
        };
        let image = FabricImage {
            pixels: painted.image().clone(),
            metres_per_pixel: size.texel,
        };
        garment.with_image(image, &drawn)
    }
}

/// Slot of each part, numbered where a slot has several.
fn names(parts: &[ClothPart]) -> Vec<String> {
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    let name = |part: &ClothPart| {
        let count = seen.entry(part.slot.name()).or_default();
        *count += 1;
        match count {
            1 => part.slot.name().to_owned(),
            n => format!("{}_{n}", part.slot.name()),
        }
    };
    parts.iter().map(name).collect()
}

/// Order on the body, 0 innermost.
fn layer(slot: Slot) -> u8 {
    match slot {
        Slot::Skin | Slot::Hair | Slot::Shoes | Slot::Bottom => 0,
        Slot::Under | Slot::OnePiece => 1,
        Slot::Top => 2,
    }
}

/// Median of the colours that the scan saw, sRGB.
fn color(part: &ClothPart, colors: &[[u8; 3]]) -> Option<[u8; 3]> {
    let seen = colors
        .iter()
        .zip(&part.hidden)
        .filter(|(_, hidden)| !**hidden);
    medians(&seen.map(|(c, _)| *c).collect::<Vec<_>>())
}
