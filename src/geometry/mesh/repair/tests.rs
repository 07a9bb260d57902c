//! Tests of the repair on small surfaces with known results.

use super::*;
use crate::math::P3;

fn mesh(points: &[[f32; 3]], faces: &[Face]) -> TriMesh {
    let points = points.iter().map(|p| P3::from(*p)).collect();
    TriMesh::new(points, faces.to_vec()).expect("valid")
}

fn repaired(points: &[[f32; 3]], faces: &[Face]) -> RepairedMesh {
    repair(&mesh(points, faces), &MeshRepairSettings::default()).expect("repaired")
}

const SQUARE: [[f32; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
];

/// Square grid of n × n cells in the plane z, counter-clockwise from above.
fn grid(n: u32, z: f32) -> (Vec<[f32; 3]>, Vec<Face>) {
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let points =
        (0..=n).flat_map(|i| (0..=n).map(move |j| [i as f32 / n as f32, j as f32 / n as f32, z]));
    let cells = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let faces = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    (points.collect(), faces.collect())
}

#[test]
fn a_sound_mesh_stays_as_it_is() {
    let (points, faces) = grid(3, 0.0);
    let out = repaired(&points, &faces);
    assert!(out.report.is_empty(), "{}", out.report);
    assert_eq!(out.mesh, mesh(&points, &faces));
    assert_eq!(out.corner_source[4], [12, 13, 14]);
    assert_eq!(out.report.to_string(), "nothing to repair");
}

#[test]
fn loose_triangles_are_joined() {
    let (points, faces) = grid(4, 0.5);
    let soup: Vec<[f32; 3]> = faces
        .iter()
        .flatten()
        .map(|v| points[*v as usize])
        .collect();
    let loose: Vec<Face> = (0..faces.len() as u32)
        .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
        .collect();
    let out = repaired(&soup, &loose);
    assert_eq!(
        (out.mesh.vertices().len(), out.report.joined),
        (25, 96 - 25)
    );
    assert_eq!(out.mesh.faces().len(), 32);
    assert!((out.mesh.area() - 1.0).abs() < 1e-6);
    let topology = Topology::new(&out.mesh).expect("manifold");
    assert_eq!((topology.components().1, topology.edges().len()), (1, 56));
}

#[test]
fn joining_ignores_cell_borders_and_keeps_what_lies_apart() {
    // The tolerance is 1e-5: 0.6e-5 apart across any cell border, and 3e-5 apart.
    for offset in [0.0f32, 1e-5, 2e-5, 4e-5, 0.25] {
        let points = [
            [offset, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [offset, 1.0, 0.0],
            [offset + 0.6e-5, 0.0, 0.0],
            [offset, 1.0, 3e-5],
            [-0.0, 0.0, 1.0],
        ];
        let out = repaired(&points, &[[0, 1, 2], [3, 4, 5]]);
        assert_eq!(out.report.joined, 1, "{offset}");
    }
}

#[test]
fn repeated_and_double_faces_go() {
    let out = repaired(&SQUARE, &[[0, 1, 2], [0, 2, 3], [2, 0, 1], [0, 3, 2]]);
    assert_eq!(out.mesh.faces(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(
        (out.report.repeated.count, &out.report.repeated.first),
        (2, &vec![2, 3])
    );
}

#[test]
fn a_needle_gives_its_apex_to_its_neighbour() {
    // The apex of the needle lies on the diagonal of a square.
    let mut points = SQUARE.to_vec();
    points.push([0.5, 0.5, 0.0]);
    let faces = [[0, 4, 2], [0, 1, 4], [4, 1, 2], [0, 2, 3]];
    let out = repaired(&points, &faces);
    let topology = Topology::new(&out.mesh).expect("manifold");
    assert_eq!((out.mesh.faces().len(), topology.edges().len()), (4, 8));
    assert!((out.mesh.area() - 1.0).abs() < 1e-6);
    assert_eq!(
        (out.report.needles.count, &out.report.needles.first),
        (1, &vec![0])
    );
    let apex = out
        .corner_source
        .iter()
        .flatten()
        .filter(|c| **c == 1)
        .count();
    assert_eq!(
        apex, 2,
        "both new faces have the needle's own corner at its apex"
    );
}

#[test]
fn a_third_face_on_an_edge_is_split_off() {
    let mut points = SQUARE.to_vec();
    points.push([0.5, 0.5, 1.0]);
    let out = repaired(&points, &[[0, 1, 2], [0, 2, 3], [0, 2, 4]]);
    let topology = Topology::new(&out.mesh).expect("manifold");
    assert_eq!((topology.components().1, out.mesh.vertices().len()), (2, 7));
    assert_eq!(
        (out.report.edges.count, &out.report.edges.first),
        (1, &vec![2])
    );
    assert_eq!(out.vertex_source[5..], [0, 2]);
    assert_eq!(
        out.report.to_string(),
        "1 edge with more than two faces split (face 2)"
    );
}

#[test]
fn sheets_that_cross_stay_whole() {
    // Two squares through each other along a common edge: four faces on it.
    let points = [
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
    ];
    let out = repaired(&points, &[[0, 1, 2], [0, 1, 4], [1, 0, 3], [1, 0, 5]]);
    let topology = Topology::new(&out.mesh).expect("manifold");
    let (piece, pieces) = topology.components();
    assert_eq!(pieces, 2);
    let of_face = |f: usize| piece[out.mesh.faces()[f][0] as usize];
    assert_eq!((of_face(0), of_face(1)), (of_face(2), of_face(3)));
}

#[test]
fn a_book_whose_pages_meet_again_is_taken_apart() {
    // Three half tubes between two edges: every end of an edge is tied to the others around it.
    let mut points = vec![[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut faces: Vec<Face> = Vec::new();
    for (x, z) in [(1.0, 0.0), (-1.0, 0.5), (-1.0, -0.5)] {
        let a = points.len() as u32;
        points.extend([[x, 0.0, z], [x, 1.0, z]]);
        faces.extend([[0, a, 1], [a, a + 1, 1]]);
    }
    faces.extend([[2, 4, 3], [2, 6, 7]]);
    let out = repaired(&points, &faces);
    assert!(Topology::new(&out.mesh).is_ok());
    assert_eq!(out.mesh.faces().len(), faces.len());
}

#[test]
fn sheets_that_meet_in_a_point_are_parted() {
    let points = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [-1.0, 0.0, 0.0],
        [-1.0, -1.0, 0.0],
        [9.0, 9.0, 9.0],
    ];
    let out = repaired(&points, &[[0, 1, 2], [0, 3, 4]]);
    assert_eq!(
        (
            out.mesh.vertices().len(),
            out.report.vertices,
            out.report.stray
        ),
        (6, 1, 1)
    );
}

#[test]
fn the_majority_keeps_its_orientation_and_one_sided_bands_are_refused() {
    let (points, mut faces) = grid(2, 0.0);
    faces[3].swap(0, 1);
    let out = repaired(&points, &faces);
    assert_eq!(out.report.turned, 1);
    assert!(out.mesh.faces().iter().all(|f| {
        let n = crate::mesh::face_normal(out.mesh.vertices(), f);
        n.z > 0.0
    }));
    let turned = &out.mesh.faces()[3];
    let sources = out.corner_source[3].map(|c| faces[c as usize / 3][c as usize % 3]);
    assert_eq!(*turned, sources);

    let ring: Vec<[f32; 3]> = (0..5)
        .map(|k| [k as f32, (k * k) as f32, (k % 2) as f32])
        .collect();
    let strip = [[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 0], [4, 0, 1]];
    let error = repair(&mesh(&ring, &strip), &MeshRepairSettings::default());
    assert!(
        matches!(error, Err(MeshError::OneSided { .. })),
        "{error:?}"
    );
}

/// Tube around y with walls of `thickness`, closed by rims at both ends.
fn thick_tube(thickness: f32) -> (Vec<[f32; 3]>, Vec<Face>) {
    let (around, along) = (48u32, 20u32);
    let mut points = Vec::new();
    for radius in [0.2, 0.2 - thickness] {
        for j in 0..=along {
            for i in 0..around {
                let (s, c) = (std::f32::consts::TAU * i as f32 / around as f32).sin_cos();
                points.push([radius * s, 0.6 * j as f32 / along as f32, radius * c]);
            }
        }
    }
    let inner = around * (along + 1);
    let mut faces = Vec::new();
    let mut quad = |a, b, c, d| faces.extend([[a, b, c], [a, c, d]]);
    for i in 0..around {
        let k = (i + 1) % around;
        for j in 0..along {
            let [a, b] = [i, k].map(|i| j * around + i);
            quad(a, b, b + around, a + around);
            quad(inner + b, inner + a, inner + a + around, inner + b + around);
        }
        let top = along * around;
        quad(i, inner + i, inner + k, k);
        quad(top + i, top + k, inner + top + k, inner + top + i);
    }
    (points, faces)
}

#[test]
fn cloth_with_thickness_is_one_sheet() {
    for thickness in [0.001, 0.003, 0.01] {
        let (points, faces) = thick_tube(thickness);
        assert!(
            Topology::new(&mesh(&points, &faces))
                .expect("manifold")
                .is_closed()
        );
        let out = repaired(&points, &faces);
        assert_eq!(out.mesh.faces().len(), 48 * 20 * 2, "{}", out.report);
        assert!(
            out.mesh
                .vertices()
                .iter()
                .all(|p| (p.x.hypot(p.z) - 0.2).abs() < 1e-5)
        );
        let found = out.thickness.expect("a thickness");
        // Chords of the two polygons are nearer than their circles.
        assert!(
            (found / thickness - 1.0).abs() < 0.02,
            "{found} for {thickness}"
        );
        assert_eq!(
            Topology::new(&out.mesh)
                .expect("manifold")
                .boundary_components()
                .len(),
            2
        );
    }
    let (points, faces) = thick_tube(0.08);
    let out = repaired(&points, &faces);
    assert!(
        out.report.is_empty() && out.thickness.is_none(),
        "{}",
        out.report
    );
}
