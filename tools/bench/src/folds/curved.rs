//! Geometry in place of normals alone: a drawn mesh on the cubic patches of its triangles (Vlachos et al. 2001).

use tryon_garment::{GarmentError, GarmentMesh, GarmentSubdivision};
use tryon_geometry::math::P3;
use tryon_geometry::mesh::vertex_normals;
use tryon_geometry::par::Par;

/// Finer mesh of a garment and its vertices (m): each triangle becomes four, middles of edges lie on the cubic curves that
/// meet the normals at their ends at right angles.
///
/// # Errors
/// A mesh that is not manifold.
pub(super) fn curved(
    garment: &GarmentMesh,
    x: &[P3],
) -> Result<(GarmentMesh, Vec<P3>), GarmentError> {
    let topology = garment.topology()?;
    let mut normals = Vec::new();
    vertex_normals(
        Par::Rayon,
        x,
        &garment.faces,
        topology.vertex_faces(),
        &mut normals,
    );
    let finer = GarmentSubdivision::new(garment);
    let mut vertices = x.to_vec();
    let middles = finer.parents.iter().map(|[a, b]| {
        let (p, q) = (x[*a as usize], x[*b as usize]);
        let [m, n] = [a, b].map(|v| &normals[*v as usize]);
        let d = q - p;
        // Bézier points at a third, pulled into the planes of the ends.
        p + d * 0.5 - (m * d.dot(m) - n * d.dot(n)) * 0.125
    });
    vertices.extend(middles);
    Ok((finer.mesh, vertices))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_garment::{Size, Triangulation, library};

    #[test]
    fn middles_of_a_sphere_lie_near_it() {
        let pattern = library::pattern("tank", Size::M).expect("a pattern");
        let garment = GarmentMesh::sew(&pattern, &Triangulation::default()).expect("sewn");
        let sphere = |[u, v]: [f32; 2]| {
            let (s, c) = v.sin_cos();
            P3::new(u.sin() * c, s, u.cos() * c)
        };
        // One panel wraps its part of the sphere; others lie beside it.
        let x: Vec<P3> = garment.uv.iter().map(|uv| sphere(*uv)).collect();
        let (finer, curved) = curved(&garment, &x).expect("manifold");
        assert_eq!(finer.vertices, curved.len());
        let flat = GarmentSubdivision::new(&garment)
            .refine(&x.iter().map(|p| p.coords.cast()).collect::<Vec<_>>());
        let deep = |radius: f64| (1.0 - radius).abs();
        let mut depths: Vec<[f64; 2]> = (garment.vertices..finer.vertices)
            .map(|i| {
                [
                    deep(flat[i].norm()),
                    deep(f64::from(curved[i].coords.norm())),
                ]
            })
            .collect();
        depths.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let [straight, bent] = depths[depths.len() / 2];
        assert!(
            straight > 2e-5 && bent < 0.3 * straight,
            "{straight} {bent}"
        );
    }
}
