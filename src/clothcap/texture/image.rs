//! Image of a texture atlas: texels that something was seen at, and the others filled from them.

use super::atlas::{Texel, TextureAtlas};
use tryon_formats::image::sample_texture;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::par::{self, Par};

/// Image of one garment.
#[derive(Clone, Debug, PartialEq)]
pub struct GarmentTexture {
    image: ColorImage,
    /// Texels painted with colours that were seen, row by row.
    seen: Vec<bool>,
}

impl GarmentTexture {
    /// Image between the colours of the surface's vertices, sRGB; no texel counts as seen.
    pub fn of_vertices(atlas: &TextureAtlas, colors: &[[u8; 3]]) -> Self {
        Self::filled(atlas, |f, texels| {
            let mixed = |t: &Texel| atlas.mixed(f, t.weights, colors);
            texels.iter().map(mixed).collect()
        })
    }

    /// Image with given colours, sRGB, 0 to 255: those of the texels of a face. No texel counts as seen.
    pub fn filled(
        atlas: &TextureAtlas,
        colors: impl Fn(usize, &[Texel]) -> Vec<[f32; 3]> + Sync,
    ) -> Self {
        let size = atlas.size;
        let mut out = Self {
            image: ColorImage::filled(size.width, size.height, [0; 3]),
            seen: vec![false; atlas.texels()],
        };
        let mut of_faces = Vec::new();
        par::map_into(Par::Rayon, atlas.faces.len(), 64, &mut of_faces, |f| {
            let texels = atlas.texels_of(f);
            let colors = colors(f, &texels);
            let of: Vec<_> = texels.iter().map(|t| t.index).zip(colors).collect();
            of
        });
        for (texel, color) in of_faces.into_iter().flatten() {
            out.put(texel, color);
        }
        out.fill_gutters(atlas);
        out
    }

    /// Image and texels that were seen, as stored; `None` for sizes other than the atlas's.
    pub fn from_images(atlas: &TextureAtlas, image: ColorImage, seen: &ColorImage) -> Option<Self> {
        let size = [atlas.size.width, atlas.size.height];
        let is_size = |i: &ColorImage| [i.width(), i.height()] == size;
        let seen_at = |c: &[u8]| c[0] > 127;
        (is_size(&image) && is_size(seen)).then(|| Self {
            image,
            seen: seen.data().chunks_exact(3).map(seen_at).collect(),
        })
    }

    /// Colours, sRGB.
    pub fn image(&self) -> &ColorImage {
        &self.image
    }

    /// White where colours were seen, black where they are filled in.
    pub fn seen_image(&self) -> ColorImage {
        let mut out = ColorImage::filled(self.image.width(), self.image.height(), [0; 3]);
        for (c, seen) in out.data_mut().chunks_exact_mut(3).zip(&self.seen) {
            c.fill(if *seen { 255 } else { 0 });
        }
        out
    }

    /// True for a texel painted with a colour that was seen.
    pub fn is_seen(&self, texel: u32) -> bool {
        self.seen[texel as usize]
    }

    /// Colour of a texel, sRGB.
    pub fn at(&self, texel: u32) -> [u8; 3] {
        let i = 3 * texel as usize;
        let c = &self.image.data()[i..i + 3];
        [c[0], c[1], c[2]]
    }

    /// Colour at barycentric coordinates in a face of the atlas, sRGB, 0 to 255.
    pub fn sample(&self, atlas: &TextureAtlas, face: usize, weights: [f32; 3]) -> [f32; 3] {
        let corners = atlas.faces[face].map(|v| atlas.uv[v as usize]);
        let uv = [0, 1].map(|k| (0..3).map(|c| corners[c][k] * weights[c]).sum());
        sample_texture(&self.image, uv).unwrap_or_default()
    }

    /// Paints texels with colours that were seen, then what lies around the charts.
    pub(super) fn paint(&mut self, atlas: &TextureAtlas, texels: &[(u32, [f32; 3])]) {
        for (texel, color) in texels {
            self.put(*texel, *color);
            self.seen[*texel as usize] = true;
        }
        if !texels.is_empty() {
            self.fill_gutters(atlas);
        }
    }

    fn put(&mut self, texel: u32, color: [f32; 3]) {
        let i = 3 * texel as usize;
        let rounded = color.map(|c| c.round().clamp(0.0, 255.0) as u8);
        self.image.data_mut()[i..i + 3].copy_from_slice(&rounded);
    }

    /// Gives texels outside of all charts the colour of the nearest one within, along rows and columns: bilinear samples at
    /// borders and smaller copies of the image meet no other colour.
    fn fill_gutters(&mut self, atlas: &TextureAtlas) {
        let (w, h) = (atlas.size.width, atlas.size.height);
        let mut is_filled = vec![false; atlas.texels()];
        let mut front: Vec<u32> = Vec::new();
        for f in 0..atlas.faces.len() {
            for texel in atlas.texels_of(f) {
                if !std::mem::replace(&mut is_filled[texel.index as usize], true) {
                    front.push(texel.index);
                }
            }
        }
        front.sort_unstable();
        while !front.is_empty() {
            let mut next = Vec::new();
            for t in front {
                let (x, y) = (t % w, t / w);
                let beside = [
                    (x > 0).then(|| t - 1),
                    (x + 1 < w).then(|| t + 1),
                    (y > 0).then(|| t - w),
                    (y + 1 < h).then(|| t + w),
                ];
                for n in beside.into_iter().flatten() {
                    if !std::mem::replace(&mut is_filled[n as usize], true) {
                        let (from, to) = (3 * t as usize, 3 * n as usize);
                        self.image.data_mut().copy_within(from..from + 3, to);
                        next.push(n);
                    }
                }
            }
            front = next;
        }
    }
}
