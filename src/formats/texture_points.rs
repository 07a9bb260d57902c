//! Colours of a mesh's texture at points within its triangles: what vertices alone would lose.

use crate::image::sample_texture;
use tryon_geometry::camera::ColorImage;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::{Face, face_normal};

/// About the most points of a mesh: 2 mm apart on a person.
const MOST_POINTS: usize = 500_000;
/// Most subdivisions of the sides of one triangle.
const MOST_SUBDIVISIONS: f32 = 64.0;

/// Colour at a point of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexturePoint {
    /// Triangle.
    pub face: u32,
    /// Barycentric coordinates in it.
    pub weights: [f32; 3],
    /// sRGB.
    pub color: [u8; 3],
}

/// Triangle with texture coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexturedFace {
    /// Its number.
    pub(crate) face: u32,
    /// Corners, units of the mesh.
    pub(crate) corners: [P3; 3],
    /// Texture coordinates of the corners, v down.
    pub(crate) uv: [[f32; 2]; 3],
}

/// Places of the points: evenly over the surface, no denser than the texels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexturePoints {
    /// Area of one point, square units of the mesh.
    area: f32,
}

impl TexturePoints {
    /// Points over these triangles, one of `parts` meshes that share the limit.
    pub(crate) fn over(vertices: &[P3], faces: &[Face], parts: usize) -> Self {
        let areas = faces.iter().map(|f| area(vertices, f));
        let total: f32 = areas.filter(|a| a.is_finite()).sum();
        Self {
            area: total * parts.max(1) as f32 / MOST_POINTS as f32,
        }
    }

    /// Adds the points of a triangle; `color` is that of the mesh at a colour of the image,
    /// both sRGB, 0 to 255.
    pub(crate) fn add(
        &self,
        textured: &TexturedFace,
        image: &ColorImage,
        color: impl Fn([f32; 3]) -> [f32; 3],
        out: &mut Vec<TexturePoint>,
    ) {
        let TexturedFace { face, corners, uv } = *textured;
        let texels = (0..3).map(|k| {
            let (p, q) = (uv[k], uv[(k + 1) % 3]);
            let across = (q[0] - p[0]) * image.width() as f32;
            across.hypot((q[1] - p[1]) * image.height() as f32)
        });
        let texels = texels.fold(0.0, f32::max);
        let wanted = (area(&corners, &[0, 1, 2]) / self.area).sqrt();
        // Comparisons are false for what is not finite.
        if !(wanted >= 0.0 && texels >= 0.0) {
            return;
        }
        let n = wanted.min(texels).min(MOST_SUBDIVISIONS).ceil().max(1.0) as u32;
        for i in 0..n {
            for j in 0..n - i {
                let upright = [1.0 / 3.0].into_iter();
                let turned = (i + j + 1 < n).then_some(2.0 / 3.0);
                for middle in upright.chain(turned) {
                    let [b, c] = [i, j].map(|k| (k as f32 + middle) / n as f32);
                    let weights = [1.0 - b - c, b, c];
                    let at = [0, 1].map(|k| (0..3).map(|c| weights[c] * uv[c][k]).sum());
                    if let Some(sampled) = sample_texture(image, at) {
                        out.push(TexturePoint {
                            face,
                            weights,
                            color: color(sampled).map(|c| c.round().clamp(0.0, 255.0) as u8),
                        });
                    }
                }
            }
        }
    }
}

fn area(vertices: &[P3], face: &Face) -> f32 {
    0.5 * face_normal(vertices, face).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_cover_a_triangle_evenly_and_no_denser_than_texels() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(P3::from);
        let image = ColorImage::filled(9, 9, [7, 8, 9]);
        let uv = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let places = TexturePoints::over(&corners, &[[0, 1, 2]], 1);
        let mut out = Vec::new();
        let textured = TexturedFace {
            face: 4,
            corners,
            uv,
        };
        places.add(&textured, &image, |c| c, &mut out);
        // 12.7 texels along the longest side.
        assert_eq!(out.len(), 13 * 13);
        for k in 0..3 {
            let mean = out.iter().map(|p| p.weights[k]).sum::<f32>() / 169.0;
            assert!((mean - 1.0 / 3.0).abs() < 1e-5);
        }
        assert!(out.iter().all(|p| p.color == [7, 8, 9] && p.face == 4));
        let count = out.len();
        let lost = TexturedFace {
            corners: [corners[0], corners[1], P3::new(0.0, f32::NAN, 0.0)],
            ..textured
        };
        places.add(&lost, &image, |c| c, &mut out);
        let unmapped = TexturedFace {
            uv: [[f32::NAN; 2]; 3],
            ..textured
        };
        places.add(&unmapped, &image, |c| c, &mut out);
        assert_eq!(out.len(), count);
    }
}
