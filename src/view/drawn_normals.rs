//! Normals of a garment as shading uses them, at points of its surface: for judges of folds.

use super::input::GarmentView;
use super::shading::{ShadedFace, relief};
use super::surface::Surface;
use tryon_geometry::math::V3;

/// Point of a triangle mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnPoint {
    /// Face.
    pub face: u32,
    /// Barycentric coordinates.
    pub weights: [f32; 3],
}

/// Outward unit normals at points of a garment, in its frame: interpolated, with wrinkles and relief of its cloth as means
/// over about `footprint` metres. Faces that are out of range have the zero vector.
pub fn drawn_normals(garment: &GarmentView<'_>, at: &[DrawnPoint], footprint: f32) -> Vec<V3> {
    let surface = Surface::shaded(garment);
    let [fabric] = &surface.fabrics[..] else {
        return vec![V3::zeros(); at.len()];
    };
    let normal = |point: &DrawnPoint| {
        let Some(face) = surface.faces.get(point.face as usize) else {
            return V3::zeros();
        };
        let f = face.map(|i| i as usize);
        let corners = f.map(|i| surface.vertices[i].coords);
        let face = ShadedFace::new(
            point.face,
            corners,
            f.map(|i| surface.attributes[i]),
            fabric,
        );
        let attributes = face.interpolate(point.weights);
        let n = V3::new(attributes[0], attributes[1], attributes[2]);
        let n = n.try_normalize(0.0).unwrap_or_else(V3::zeros);
        let tilt = fabric.cloth.as_ref().map_or_else(V3::zeros, |cloth| {
            face.tilt(&relief(cloth, &attributes, fabric.metres_per_uv, footprint))
        });
        (n - tilt).try_normalize(0.0).unwrap_or_else(V3::zeros)
    };
    at.iter().map(normal).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Appearance, ShadedCloth};
    use tryon_geometry::math::P3;

    #[test]
    fn compressed_cloth_has_wrinkles_about_the_mesh_normal() {
        let flat = [[0.0, 0.0], [0.3, 0.0], [0.0, 0.3]];
        let worn = flat.map(|[u, v]| P3::new(0.96 * u, v, 2.0));
        let at: Vec<DrawnPoint> = (0..200)
            .map(|i| {
                let share = i as f32 / 400.0;
                DrawnPoint {
                    face: 0,
                    weights: [0.5, share, 0.5 - share],
                }
            })
            .collect();
        let normals = |appearance: &Appearance| {
            let view = GarmentView {
                vertices: &worn,
                faces: &[[0, 1, 2]],
                uv: &flat,
                normals: &[],
                places: &[],
                appearance,
            };
            drawn_normals(&view, &at, 6e-3)
        };
        let sheet = normals(&Appearance::default());
        assert!(sheet.iter().all(|n| (n - V3::z()).norm() < 1e-6));
        let cloth = Appearance {
            cloth: Some(ShadedCloth::named("cotton")),
            ..Appearance::default()
        };
        let [across, along] = [0, 1].map(|k| {
            let squares = normals(&cloth).iter().map(|n| n[k] * n[k]).sum::<f32>();
            (squares / at.len() as f32).sqrt()
        });
        assert!(across > 0.05 && along < 0.5 * across, "{across} {along}");
    }
}
