//! Base colour of each vertex: factor × texture × COLOR_0, in linear light (glTF 2.0, section 3.9.2).

use super::accessors::Accessors;
use super::srgb::{encoded, linear};
use super::uri::external;
use crate::TexturePoint;
use crate::image::{decode_color, sample_texture};
use crate::texture_points::{TexturePoints, TexturedFace};
use ::gltf::{Document, Primitive, Semantic};
use std::borrow::Cow;
use std::path::Path;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::Face;

/// Triangles of a primitive among those of a file.
#[derive(Clone, Copy)]
pub(super) struct PrimitiveSurface<'a> {
    pub(super) vertices: &'a [P3],
    pub(super) faces: &'a [Face],
    /// Number of its first triangle in the file.
    pub(super) first: usize,
}

/// Reader of base colours; keeps the last texture, which neighbouring primitives share.
pub(super) struct BaseColors<'a> {
    origin: &'a Path,
    document: &'a Document,
    accessors: &'a Accessors,
    /// Index and pixels of an image.
    last: Option<(usize, ColorImage)>,
}

impl<'a> BaseColors<'a> {
    /// Images beside the document lie beside `origin`.
    pub(super) fn new(origin: &'a Path, document: &'a Document, accessors: &'a Accessors) -> Self {
        Self {
            origin,
            document,
            accessors,
            last: None,
        }
    }

    /// Base colours of a primitive, sRGB, 0 to 255, shape `[vertices]`; NaN where neither material nor COLOR_0 exists.
    pub(super) fn of_primitive(
        &mut self,
        p: &Primitive<'_>,
        vertices: usize,
    ) -> Result<Vec<[f32; 3]>, String> {
        let material = p.material();
        let pbr = material.pbr_metallic_roughness();
        let texture = pbr.base_color_texture();
        let vertex_colors = p.get(&Semantic::Colors(0));
        if material.index().is_none() && vertex_colors.is_none() {
            return Ok(vec![[f32::NAN; 3]; vertices]);
        }
        let [r, g, b, _] = pbr.base_color_factor();
        let mut colors = vec![[r, g, b]; vertices];
        if let Some(info) = texture {
            let name = format!("TEXCOORD_{}", info.tex_coord());
            let uv = p.get(&Semantic::TexCoords(info.tex_coord()));
            let uv = uv.ok_or_else(|| format!("its texture needs {name}, which is missing"))?;
            let uv = self.accessors.normalized::<2>(&uv)?;
            let image = self.image(info.texture().source().index())?;
            let texels = uv.iter().map(|t| texel(image, *t)).collect();
            multiply(&mut colors, texels).map_err(|why| format!("{name}: {why}"))?;
        }
        if let Some(a) = vertex_colors {
            multiply(&mut colors, self.accessors.normalized::<3>(&a)?)
                .map_err(|why| format!("COLOR_0: {why}"))?;
        }
        Ok(colors
            .iter()
            .map(|c| c.map(|l| 255.0 * encoded(l)))
            .collect())
    }

    /// Colours of a primitive's texture between its vertices; none without a texture, and where COLOR_0 multiplies it.
    pub(super) fn points_of_primitive(
        &mut self,
        p: &Primitive<'_>,
        surface: PrimitiveSurface<'_>,
        out: &mut Vec<TexturePoint>,
    ) -> Result<(), String> {
        let PrimitiveSurface {
            vertices,
            faces,
            first,
        } = surface;
        let material = p.material();
        let pbr = material.pbr_metallic_roughness();
        let Some(info) = pbr.base_color_texture() else {
            return Ok(());
        };
        let uv = p.get(&Semantic::TexCoords(info.tex_coord()));
        let (Some(uv), None) = (uv, p.get(&Semantic::Colors(0))) else {
            return Ok(());
        };
        let uv = self.accessors.normalized::<2>(&uv)?;
        let [r, g, b, _] = pbr.base_color_factor();
        let meshes = self.document.meshes();
        let parts = meshes.map(|m| m.primitives().count()).sum();
        let image = self.image(info.texture().source().index())?;
        let places = TexturePoints::over(vertices, faces, parts);
        let color = |c: [f32; 3]| {
            let light = c.map(|s| linear(s / 255.0));
            [light[0] * r, light[1] * g, light[2] * b].map(|l| 255.0 * encoded(l))
        };
        for (f, face) in (first as u32..).zip(faces) {
            let at = face.map(|v| uv.get(v as usize).copied().unwrap_or([f32::NAN; 2]));
            let textured = TexturedFace {
                face: f,
                corners: face.map(|v| vertices[v as usize]),
                uv: at,
            };
            places.add(&textured, image, color, out);
        }
        Ok(())
    }

    /// Pixels of an image.
    fn image(&mut self, index: usize) -> Result<&ColorImage, String> {
        let image = match self.last.take() {
            Some((i, image)) if i == index => image,
            _ => self.decode(index)?,
        };
        Ok(&self.last.insert((index, image)).1)
    }

    /// Decodes an image of the document; the crate's own accessor panics on incomplete ones.
    fn decode(&self, index: usize) -> Result<ColorImage, String> {
        let image = self.document.as_json().images.get(index);
        let image = image.ok_or("no such image")?;
        let bytes = match (&image.buffer_view, &image.uri) {
            (Some(view), _) => {
                let view = self.document.views().nth(view.value());
                Cow::Borrowed(self.accessors.view(&view.ok_or("no such buffer view")?)?)
            }
            (None, Some(uri)) => {
                let bytes = external(uri, self.origin, &format!("image {index}"));
                Cow::Owned(bytes.map_err(|e| e.to_string())?)
            }
            (None, None) => return Err(format!("image {index} has no data")),
        };
        decode_color(&bytes, self.origin).map_err(|e| format!("image {index}: {e}"))
    }
}

/// Linear colour of a texture; NaN for coordinates that are not finite.
fn texel(image: &ColorImage, uv: [f32; 2]) -> [f32; 3] {
    sample_texture(image, uv).map_or([f32::NAN; 3], |c| c.map(|s| linear(s / 255.0)))
}

/// Multiplies colours row by row.
fn multiply(colors: &mut [[f32; 3]], factors: Vec<[f32; 3]>) -> Result<(), String> {
    if colors.len() != factors.len() {
        return Err(format!(
            "{} rows for {} vertices",
            factors.len(),
            colors.len()
        ));
    }
    for (color, factor) in colors.iter_mut().zip(factors) {
        for (c, f) in color.iter_mut().zip(factor) {
            *c *= f;
        }
    }
    Ok(())
}
