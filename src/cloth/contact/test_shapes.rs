//! Closed surfaces with known distances, for tests.

use super::{Part, SurfaceFrame, SurfaceModel};
use tryon_geometry::math::{P3, V3};
use tryon_geometry::mesh::{Face, Topology, TriMesh};
use tryon_geometry::par::Par;

/// Unit sphere from an octahedron subdivided `levels` times.
pub(super) fn sphere(levels: usize) -> TriMesh {
    let mut v: Vec<P3> = (0..6)
        .map(|k| {
            let mut p = P3::origin();
            p[k / 2] = if k % 2 == 0 { 1.0 } else { -1.0 };
            p
        })
        .collect();
    let mut f: Vec<Face> = vec![
        [0, 2, 4],
        [2, 1, 4],
        [1, 3, 4],
        [3, 0, 4],
        [2, 0, 5],
        [1, 2, 5],
        [3, 1, 5],
        [0, 3, 5],
    ];
    for _ in 0..levels {
        let mut middle = std::collections::BTreeMap::new();
        let mut next = Vec::new();
        for t in &f {
            let m: [u32; 3] = std::array::from_fn(|k| {
                let (a, b) = (t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3]));
                *middle.entry((a, b)).or_insert_with(|| {
                    let sum = v[a as usize].coords + v[b as usize].coords;
                    v.push(P3::from(sum.normalize()));
                    v.len() as u32 - 1
                })
            });
            next.extend([
                [t[0], m[0], m[2]],
                [m[0], t[1], m[1]],
                [m[2], m[1], t[2]],
                [m[0], m[1], m[2]],
            ]);
        }
        f = next;
    }
    TriMesh::new(v, f).expect("sphere")
}

/// Surface and frame with normals of a mesh whose vertices belong to these parts.
pub(super) fn surface(mesh: &TriMesh, parts: Vec<Part>) -> (SurfaceModel, SurfaceFrame) {
    let topology = Topology::new(mesh).expect("topology");
    let model = SurfaceModel::new(mesh.faces().to_vec(), topology, parts);
    let mut frame = SurfaceFrame {
        vertices: mesh.vertices().to_vec(),
        normals: Vec::new(),
    };
    model.update_normals(Par::Seq, &mut frame);
    (model, frame)
}

/// Two spheres with centres on the x axis, each of its own part and not connected; also the vertices of one sphere.
pub(super) fn two_spheres(
    levels: usize,
    radius: f32,
    centres: [f32; 2],
    parts: [Part; 2],
) -> (SurfaceModel, SurfaceFrame, usize) {
    let one = sphere(levels);
    let n = one.vertices().len();
    let mut vertices: Vec<P3> = Vec::new();
    for x in centres {
        let at = |p: &P3| P3::from(p.coords * radius + V3::x() * x);
        vertices.extend(one.vertices().iter().map(at));
    }
    let mut faces = one.faces().to_vec();
    faces.extend(one.faces().iter().map(|f| f.map(|v| v + n as u32)));
    let mesh = TriMesh::new(vertices, faces).expect("two spheres");
    let of = parts
        .into_iter()
        .flat_map(|p| std::iter::repeat_n(p, n))
        .collect();
    let (model, frame) = surface(&mesh, of);
    (model, frame, n)
}
