//! Collars: cloth that stands on the edge that it is sewn to.

use tryon_garment::{GarmentMesh, Placement};
use tryon_geometry::math::{P3, V3};

/// Outward lean of a collar over its height: upright ones of one neckline would meet the head.
const LEAN: f32 = 0.3;

/// Stands the vertices that only collars have on the nearest placed edge of their panel; `placed` says which have a place.
pub(super) fn stand_collars(mesh: &GarmentMesh, placed: &[bool], positions: &mut [P3]) {
    let seam: Vec<usize> = (0..mesh.vertices)
        .filter(|v| placed[*v] && collar_corners(mesh, *v).next().is_some())
        .collect();
    let centre = seam.iter().map(|v| positions[*v].coords).sum::<V3>() / seam.len().max(1) as f32;
    for v in (0..mesh.vertices).filter(|v| !placed[*v]) {
        let mut sum = V3::zeros();
        let mut n = 0.0;
        for (panel, q) in collar_corners(mesh, v) {
            if let Some((foot, height)) = foot(mesh, &seam, positions, panel, q) {
                let out = V3::new(foot.x - centre.x, 0.0, foot.z - centre.z);
                let direction = V3::y() + out.try_normalize(1e-6).unwrap_or_default() * LEAN;
                sum += foot.coords + direction.normalize() * height;
                n += 1.0;
            }
        }
        if n > 0.0 {
            positions[v] = P3::from(sum / n);
        }
    }
}

fn collar_corners(mesh: &GarmentMesh, vertex: usize) -> impl Iterator<Item = (u16, [f64; 2])> + '_ {
    let corners = mesh.corners[vertex].iter().copied();
    corners.filter(|(p, _)| mesh.placements[usize::from(*p)] == Placement::Collar)
}

/// Nearest point of the panel's placed vertices in its flat shape, interpolated in space, and its flat distance.
fn foot(
    mesh: &GarmentMesh,
    seam: &[usize],
    positions: &[P3],
    panel: u16,
    q: [f64; 2],
) -> Option<(P3, f32)> {
    let own: Vec<([f64; 2], P3)> = seam
        .iter()
        .flat_map(|v| collar_corners(mesh, *v).map(move |c| (*v, c)))
        .filter(|(_, (p, _))| *p == panel)
        .map(|(v, (_, at))| (at, positions[v]))
        .collect();
    // Mean of the nearest ones, weighted by the inverse square distance: exact at them, smooth between them.
    let square = |p: [f64; 2]| (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2);
    let nearest = own.iter().map(|(p, _)| square(*p)).reduce(f64::min)?;
    let mut sum = V3::zeros();
    let mut weight = 0.0;
    for (p, at) in &own {
        let w = (1.0 / (square(*p) / nearest.max(1e-12)).powi(4)) as f32;
        sum += at.coords * w;
        weight += w;
    }
    Some((P3::from(sum / weight), nearest.sqrt() as f32))
}
