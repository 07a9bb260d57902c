//! Bending rigidity that a real-time mesh carries.
//!
//! A sheet folds under its own weight to radii of its bending length c = (B/w)^⅓ (Peirce 1930). A mesh of edges h has no
//! radius below a share of h: there the moment of a hinge, the sine of half its angle, no longer grows, and cloth crumples
//! edge by edge. The least rigidity is that whose bending length is this share of an edge: B = w (share h)³.

use crate::settings::ResolutionSettings;
use serde::Serialize;
use tryon_garment::{Bending, GarmentMesh, Material};

/// Resolution limit of a mesh in bending.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BendingResolution {
    /// Mean edge length (m).
    pub edge: f64,
    /// Least rigidity that edges of this length carry (N·m).
    pub least: f64,
    /// Rigidity of the fabric along warp and weft (N·m), its friction that of cloth under its own weight.
    pub own: [f64; 2],
    /// Rigidity of the mesh along warp and weft (N·m).
    pub used: [f64; 2],
}

impl BendingResolution {
    /// Limit of a mesh with these flat triangles (m), and the material that it carries.
    pub fn of(
        material: &Material,
        rest: &[[[f64; 2]; 3]],
        settings: &ResolutionSettings,
    ) -> (Self, Material) {
        let edge = mean_edge(rest);
        let load = settings.gravity * material.area_density;
        let least = load * (settings.edges * edge).powi(3);
        let own = material.bending.secant(load);
        let used = own.at_least(least);
        let both = |b: &Bending| [b.warp, b.weft];
        let limit = Self {
            edge,
            least,
            own: both(&own),
            used: both(&used),
        };
        let mut carried = material.clone();
        carried.bending = used;
        (limit, carried)
    }
    /// Limit of the mesh of a garment in real time, and the material that it carries.
    pub fn of_garment(g: &GarmentMesh) -> (Self, Material) {
        Self::of(&g.material, &g.rest, &ResolutionSettings::default())
    }
    /// Largest ratio of the mesh's rigidity to the fabric's, 1 where the mesh resolves it.
    pub fn stiffening(&self) -> f64 {
        let ratio = |k: usize| self.used[k] / self.own[k].max(f64::MIN_POSITIVE);
        ratio(0).max(ratio(1))
    }
}

/// Mean length of the sides of flat triangles (m).
fn mean_edge(rest: &[[[f64; 2]; 3]]) -> f64 {
    let side = |t: &[[f64; 2]; 3], k: usize| {
        let (a, b) = (t[k], t[(k + 1) % 3]);
        (a[0] - b[0]).hypot(a[1] - b[1])
    };
    let sum: f64 = rest
        .iter()
        .flat_map(|t| [0, 1, 2].map(|k| side(t, k)))
        .sum();
    sum / (3 * rest.len()).max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_meshes_are_stiffer_than_a_fabric_and_fine_ones_as_it_is() {
        let silk = Material::preset("silk").expect("a preset");
        let settings = ResolutionSettings::default();
        let triangle = |h: f64| [[[0.0, 0.0], [h, 0.0], [0.5 * h, 0.75f64.sqrt() * h]]];
        let (coarse, carried) = BendingResolution::of(&silk, &triangle(0.02), &settings);
        assert!((coarse.edge - 0.02).abs() < 1e-12);
        let load = settings.gravity * silk.area_density;
        let length = carried.bending.lengths(load)[1];
        assert!((length / (settings.edges * 0.02) - 1.0).abs() < 1e-9);
        assert!(coarse.stiffening() > 1.0);
        let (fine, carried) = BendingResolution::of(&silk, &triangle(0.004), &settings);
        assert!(fine.stiffening() == 1.0);
        assert_eq!(carried.bending, silk.bending.secant(load));
    }
}
