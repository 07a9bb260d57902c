//! Prolongation: positions of a fine mesh from those of a coarse one of the same pattern, through the flat panels.

use tryon_garment::GarmentMesh;
use tryon_geometry::math::V3d;

/// Interpolates linearly in the coarse triangle that contains each fine vertex on its panel.
///
/// The outlines differ, as curves have more chords on the fine mesh: there the nearest triangle extrapolates.
pub(super) fn prolong(coarse: &GarmentMesh, fine: &GarmentMesh, x: &[V3d]) -> Vec<V3d> {
    let mut by_panel: Vec<Vec<usize>> = vec![Vec::new(); coarse.panels.len()];
    for (f, p) in coarse.face_panel.iter().enumerate() {
        by_panel[usize::from(*p)].push(f);
    }
    fine.corners
        .iter()
        .map(|corners| {
            let sum = corners.iter().fold(V3d::zeros(), |s, (panel, q)| {
                s + by_panel
                    .get(usize::from(*panel))
                    .map_or_else(V3d::zeros, |faces| interpolate(coarse, faces, x, *q))
            });
            sum / corners.len().max(1) as f64
        })
        .collect()
}

fn interpolate(mesh: &GarmentMesh, faces: &[usize], x: &[V3d], q: [f64; 2]) -> V3d {
    // The triangle whose smallest weight is largest contains the point, or is the one nearest to containing it.
    let mut best = (f64::NEG_INFINITY, 0usize, [0.0; 3]);
    for &f in faces {
        let w = weights(&mesh.rest[f], q);
        let least = w[0].min(w[1]).min(w[2]);
        if least > best.0 {
            best = (least, f, w);
            if least >= 0.0 {
                break;
            }
        }
    }
    let corners = mesh.faces[best.1];
    (0..3).fold(V3d::zeros(), |s, k| s + x[corners[k] as usize] * best.2[k])
}

/// Barycentric weights of a point of the plane.
fn weights(t: &[[f64; 2]; 3], q: [f64; 2]) -> [f64; 3] {
    let cross = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let area = cross(t[0], t[1], t[2]);
    [
        cross(q, t[1], t[2]) / area,
        cross(t[0], q, t[2]) / area,
        cross(t[0], t[1], q) / area,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_garment::{Size, Triangulation, library};

    #[test]
    fn prolongation_reproduces_a_linear_map_of_the_panels() {
        let p = library::pattern("skirt", Size::M).expect("pattern");
        let how = |edge_length| Triangulation {
            edge_length,
            min_angle: 0.0,
            ..Triangulation::default()
        };
        let sew = |edge_length| GarmentMesh::sew(&p, &how(edge_length)).expect("sewn");
        let (coarse, fine) = (sew(0.05), sew(0.02));
        let map = |q: [f64; 2]| V3d::new(2.0 * q[0] - q[1], 0.5 * q[0], 3.0 * q[1] + 1.0);
        let x: Vec<V3d> = coarse.corners.iter().map(|c| map(c[0].1)).collect();
        let y = prolong(&coarse, &fine, &x);
        // Away from seams, which average two panels that a linear map pulls apart.
        let seam_free = |q: [f64; 2]| q[0].abs() < 0.1;
        let mut seen = 0;
        for (c, y) in fine
            .corners
            .iter()
            .zip(&y)
            .filter(|(c, _)| c.len() == 1 && seam_free(c[0].1))
        {
            assert!((y - map(c[0].1)).norm() < 1e-9, "{:?}", c[0]);
            seen += 1;
        }
        assert!(seen > 100);
    }
}
