//! Hems: distance of the seen boundaries of true garments from the rings of found ones.

use super::settings::CaptureBenchSettings;
use crate::scans::TrueGarment;
use crate::segment::distance_from_segment;
use tryon_clothcap::multi::Ring;
use tryon_geometry::math::P3;
use tryon_geometry::mesh::boundary_edges;
use tryon_geometry::spatial::HashGrid;

/// Seen part of a garment's boundary: ends and middles of its boundary edges, metres. `points` and their labels are those of
/// the scan, `label` is the garment's.
pub(super) fn seen_hems(
    settings: &CaptureBenchSettings,
    garment: &TrueGarment,
    points: &[P3],
    labels: &[u8],
    label: u8,
) -> Vec<P3> {
    let around = settings.around;
    let mut grid = HashGrid::default();
    // Searches reach half a cell. Points found twice hardly change the share.
    grid.fill(points, 2.0 * around);
    let is_seen = |p: &P3| {
        let (mut own, mut all) = (0, 0);
        grid.within(p, around, |i, _| {
            own += usize::from(labels[i as usize] == label);
            all += 1;
        });
        own > 0 && own as f64 >= settings.least_own * f64::from(all)
    };
    let ends = |[a, b]: [u32; 2]| {
        let [a, b] = [a, b].map(|v| garment.vertices[v as usize]);
        [a, nalgebra::center(&a, &b)]
    };
    let all = boundary_edges(&garment.faces).into_iter().flat_map(ends);
    all.filter(is_seen).collect()
}

/// Mean distance of points from the nearest ring, metres; `vertices` are those of the part. 0 without points or rings.
pub(super) fn distance_from_rings(points: &[P3], rings: &[Ring], vertices: &[P3]) -> f64 {
    let closed = |ring: &Ring| {
        let next = ring.vertices.iter().cycle().skip(1);
        let sides = ring.vertices.iter().zip(next);
        let at = |v: &u32| vertices[*v as usize];
        sides.map(|(a, b)| [at(a), at(b)]).collect::<Vec<_>>()
    };
    let segments: Vec<[P3; 2]> = rings.iter().flat_map(closed).collect();
    let distance = |p: &P3| {
        let all = segments.iter().map(|s| distance_from_segment(p, s));
        all.reduce(f32::min).unwrap_or(0.0)
    };
    points.iter().map(|p| f64::from(distance(p))).sum::<f64>() / points.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Square of 2 m in the plane z = 0.
    fn square() -> TrueGarment {
        TrueGarment {
            name: "square".into(),
            vertices: [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|[x, y]| P3::new(x, y, 0.0))
                .to_vec(),
            faces: vec![[0, 1, 2], [0, 2, 3]],
        }
    }

    #[test]
    fn hems_under_other_garments_are_not_seen() {
        let mut points = vec![P3::new(1.0, 0.0, 0.0), P3::new(1.0, 1.0, 0.005)];
        // Cloth of another garment, through which one point of this one pokes.
        points.extend((0..9).map(|k| P3::new(-1.0, -1.0, 0.001 * k as f32)));
        let mut labels = vec![2; points.len()];
        labels[2] = 1;
        labels[..2].fill(1);
        let seen = seen_hems(
            &CaptureBenchSettings::default(),
            &square(),
            &points,
            &labels,
            1,
        );
        assert_eq!(seen, [P3::new(1.0, 0.0, 0.0), P3::new(1.0, 1.0, 0.0)]);
    }

    #[test]
    fn a_ring_that_is_lifted_is_as_far_as_it_is() {
        let ring = Ring {
            name: "hem".into(),
            vertices: vec![0, 1, 2, 3],
        };
        let lifted: Vec<P3> = square()
            .vertices
            .iter()
            .map(|p| P3::new(p.x, p.y, 0.25))
            .collect();
        let hems = seen_hems(
            &CaptureBenchSettings::default(),
            &square(),
            &square().vertices,
            &[1; 4],
            1,
        );
        let found = distance_from_rings(&hems, &[ring], &lifted);
        assert!((found - 0.25).abs() < 1e-6, "{found}");
        assert_eq!(distance_from_rings(&hems, &[], &lifted), 0.0);
    }
}
