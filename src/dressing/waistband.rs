//! Even spreading of a waistband around the body before it is tied, so that no part of it is pulled more than another.

use std::collections::{BTreeMap, BTreeSet};
use tryon_cloth::contact::{SurfaceFrame, SurfaceModel};
use tryon_garment::{AnchorKind, GarmentMesh, Region};
use tryon_geometry::math::P3;

/// Parts that a waistband may lie on.
const HIPS: Region = Region::TRUNK.with(Region::LEFT_LEG).with(Region::RIGHT_LEG);
/// Gauss–Seidel rounds; with half of them bands stay uneven by more than 5 %.
const ROUNDS: usize = 400;

/// A garment on a posed skin.
#[derive(Clone, Copy)]
pub(super) struct GarmentOnSkin<'a> {
    pub(super) mesh: &'a GarmentMesh,
    pub(super) surface: &'a SurfaceModel,
    pub(super) frame: &'a SurfaceFrame,
    /// Distance from the skin, metres.
    pub(super) offset: f64,
}

/// Moves firm band anchors along their band, at constant height and at the garment's offset, until it is stretched evenly.
///
/// `edges` with rest lengths; `positions` in the frame of the skin, metres.
pub(super) fn spread(on: &GarmentOnSkin<'_>, edges: &[([u32; 2], f64)], positions: &mut [P3]) {
    let GarmentOnSkin { surface, frame, .. } = *on;
    let is_band = |kind| kind == AnchorKind::Band;
    let sets = on.mesh.anchors.iter();
    for set in sets.filter(|s| s.strength >= 1.0 && is_band(s.kind)) {
        let held: BTreeSet<u32> = set.vertices.iter().copied().collect();
        let mut around = BTreeMap::<u32, Vec<(u32, f32)>>::new();
        for ([a, b], rest) in edges {
            if held.contains(a) && held.contains(b) {
                around.entry(*a).or_default().push((*b, *rest as f32));
                around.entry(*b).or_default().push((*a, *rest as f32));
            }
        }
        // Ends of an open band, and vertices off any band, stay.
        around.retain(|_, n| n.len() == 2);
        let mut near: Vec<u32> = around
            .keys()
            .map(|v| surface.nearest_vertex(frame, &positions[*v as usize], HIPS.0))
            .collect();
        for _ in 0..ROUNDS {
            for ((v, n), near) in around.iter().zip(&mut near) {
                let (v, [(p, before), (q, after)]) = (*v as usize, [n[0], n[1]]);
                let (p, q) = (positions[p as usize], positions[q as usize]);
                let height = positions[v].y;
                let even = P3::from((p.coords * after + q.coords * before) / (before + after));
                let c = surface.closest(frame, &P3::new(even.x, height, even.z), *near, HIPS.0);
                *near = c.vertex;
                let off = c.point + c.normal * on.offset as f32;
                positions[v] = P3::new(off.x, height, off.z);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tryon_cloth::Sheet;
    use tryon_garment::{Size, Triangulation, library};
    use tryon_geometry::mesh::{Face, Topology, TriMesh};
    use tryon_geometry::par::Par;

    /// A tube of radius `r` around the y axis.
    fn tube(r: f32) -> TriMesh {
        let (around, up) = (180u32, 40u32);
        let at = |i: u32, j: u32| j * around + i % around;
        let place = |k: u32| {
            let (a, y) = (
                std::f32::consts::TAU * (k % around) as f32 / around as f32,
                (k / around) as f32 * 0.01,
            );
            P3::new(r * a.sin(), y, r * a.cos())
        };
        let cell = |k: u32| -> [Face; 2] {
            let (i, j) = (k % around, k / around);
            [
                [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
            ]
        };
        TriMesh::new(
            (0..around * up).map(place).collect(),
            (0..around * (up - 1)).flat_map(cell).collect(),
        )
        .expect("a tube")
    }

    #[test]
    fn an_uneven_waistband_ends_evenly_stretched() {
        let mesh = GarmentMesh::sew(
            &library::pattern("skirt", Size::M).expect("a skirt"),
            &Triangulation::default(),
        )
        .expect("a mesh");
        let edges = Sheet::of_garment(&mesh).expect("a sheet").edges;
        let band = &mesh.anchors[0].vertices;
        let solid = tube(0.13);
        let surface = SurfaceModel::new(
            solid.faces().to_vec(),
            Topology::new(&solid).expect("topology"),
            vec![u8::MAX; solid.vertices().len()],
        );
        let mut frame = SurfaceFrame {
            vertices: solid.vertices().to_vec(),
            normals: Vec::new(),
        };
        surface.update_normals(Par::Seq, &mut frame);
        // Around the band in order, three times as dense in front as behind.
        let mut order = vec![band[0]];
        while let Some(next) = edges
            .iter()
            .filter_map(|([a, b], _)| {
                let last = order[order.len() - 1];
                let other = if *a == last {
                    *b
                } else if *b == last {
                    *a
                } else {
                    return None;
                };
                (band.contains(&other) && !order.contains(&other)).then_some(other)
            })
            .next()
        {
            order.push(next);
        }
        assert_eq!(order.len(), band.len(), "one ring");
        let mut x = vec![P3::origin(); mesh.vertices];
        for (i, v) in order.iter().enumerate() {
            let t = std::f32::consts::TAU * i as f32 / order.len() as f32;
            let a = t + 0.5 * t.sin();
            x[*v as usize] = P3::new(0.135 * a.sin(), 0.2, 0.135 * a.cos());
        }
        let stretch = |x: &[P3]| -> Vec<f64> {
            edges
                .iter()
                .filter(|(v, _)| v.iter().all(|v| band.contains(v)))
                .map(|(v, l)| f64::from((x[v[0] as usize] - x[v[1] as usize]).norm()) / l)
                .collect()
        };
        let range = |s: &[f64]| {
            s.iter()
                .fold([f64::MAX, f64::MIN], |[a, b], v| [a.min(*v), b.max(*v)])
        };
        let [low, high] = range(&stretch(&x));
        assert!(high / low > 2.0, "{low} {high}");
        let on = GarmentOnSkin {
            mesh: &mesh,
            surface: &surface,
            frame: &frame,
            offset: 0.005,
        };
        spread(&on, &edges, &mut x);
        let [low, high] = range(&stretch(&x));
        assert!(high / low < 1.05, "{low} {high}");
        for v in band {
            let p = x[*v as usize];
            assert!(
                (p.x.hypot(p.z) - 0.135).abs() < 2e-4 && (p.y - 0.2).abs() < 1e-6,
                "{p}"
            );
        }
    }
}
