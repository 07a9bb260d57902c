//! Sheets, obstacles and an exhaustive intersection count for tests of the whole solver.

use super::*;
use crate::contact::edge_meets_triangle;
use crate::elastic::{BendLaw, ClothModel, ElasticFabric, RestSheet, StretchLaw, Stretching};
use nalgebra::Vector2;
use tryon_geometry::math::V3d;
use tryon_geometry::mesh::{Face, edges};

/// Acceleration of gravity (m/s²), down along y.
pub(super) const GRAVITY: f64 = 9.81;

/// Flat triangles, u along x and v along −z, so that faces turn up.
#[derive(Clone, Debug, Default)]
pub(super) struct PlanarSheet {
    /// Material coordinates (m), shape `[vertices]`.
    pub(super) at: Vec<Vector2<f64>>,
    pub(super) faces: Vec<Face>,
}

impl PlanarSheet {
    /// Grid of `columns` × `rows` rectangles of these sides (m), centred, with alternating diagonals.
    pub(super) fn grid([columns, rows]: [u32; 2], sides: [f64; 2]) -> Self {
        let at = |k: u32| {
            let (i, j) = (k % (columns + 1), k / (columns + 1));
            Vector2::new(
                (f64::from(i) - 0.5 * f64::from(columns)) * sides[0],
                (f64::from(j) - 0.5 * f64::from(rows)) * sides[1],
            )
        };
        let mut faces = Vec::new();
        for q in 0..columns * rows {
            let (i, j) = (q % columns, q / columns);
            let a = j * (columns + 1) + i;
            let [b, c, d] = [a + 1, a + columns + 2, a + columns + 1];
            if (i + j).is_multiple_of(2) {
                faces.extend([[a, b, c], [a, c, d]]);
            } else {
                faces.extend([[a, b, d], [b, c, d]]);
            }
        }
        let count = (columns + 1) * (rows + 1);
        Self {
            at: (0..count).map(at).collect(),
            faces,
        }
    }

    /// Adds another sheet after this one.
    pub(super) fn append(&mut self, other: &Self) {
        let first = self.at.len() as u32;
        self.at.extend(&other.at);
        let moved = other.faces.iter().map(|f| f.map(|v| v + first));
        self.faces.extend(moved);
    }

    /// Positions in the plane at this height (m).
    pub(super) fn at_height(&self, y: f64) -> Vec<V3d> {
        let lift = |p: &Vector2<f64>| V3d::new(p.x, y, -p.y);
        self.at.iter().map(lift).collect()
    }

    /// Elastic model of the sheet.
    pub(super) fn model(&self, fabric: ElasticFabric) -> ClothModel {
        let rest = RestSheet::flat(self.faces.clone(), &self.at).expect("a sheet");
        ClothModel::new(&rest, self.at.len(), fabric).expect("a model")
    }

    /// Cloth in a field of gravity (m/s²).
    pub(super) fn cloth_in(&self, fabric: ElasticFabric, gravity: V3d) -> OfflineCloth {
        let model = self.model(fabric);
        let mass = model.masses().to_vec();
        let terms = vec![Box::new(ElasticTerm::new(model)) as Box<_>];
        OfflineCloth::new(mass, self.faces.clone(), gravity, terms).expect("cloth")
    }

    /// Cloth under gravity along −y.
    pub(super) fn cloth(&self, fabric: ElasticFabric) -> OfflineCloth {
        self.cloth_in(fabric, V3d::new(0.0, -GRAVITY, 0.0))
    }
}

/// Isotropic fabric of 0.2 kg/m²: Young's modulus (N/m), Poisson ratio, bending rigidity (N·m).
pub(super) fn isotropic(young: f64, poisson: f64, rigidity: f64) -> ElasticFabric {
    ElasticFabric {
        area_density: 0.2,
        stretch: StretchLaw::Linear(Stretching::isotropic(young, poisson)),
        bend: BendLaw::isotropic(rigidity, poisson),
    }
}

/// Newton's method to rounding's neighbourhood: what is measured is then the model and not the end of the iteration.
pub(super) fn converged() -> NewtonSettings {
    NewtonSettings {
        tolerance: 1e-7,
        linear_share: 1e-3,
        ..NewtonSettings::default()
    }
}

/// Cloth and obstacle without motion.
pub(super) fn resting(x: &[V3d], obstacle: &[V3d]) -> OfflineState {
    OfflineState {
        now: MotionState {
            x: x.to_vec(),
            v: vec![V3d::zeros(); x.len()],
        },
        obstacle: [obstacle.to_vec(), obstacle.to_vec()],
        ..OfflineState::default()
    }
}

/// Targets of pins alone.
pub(super) fn pinned(pins: &[PinTarget]) -> FrameTargets<'_> {
    FrameTargets {
        pins,
        ..FrameTargets::default()
    }
}

/// Regular octahedron of half width `r` (m).
pub(super) fn octahedron(centre: V3d, r: f64) -> (Vec<V3d>, Vec<Face>) {
    let corner = |k: usize| centre + V3d::ith(k / 2, if k.is_multiple_of(2) { r } else { -r });
    let faces = vec![
        [2, 4, 0],
        [2, 0, 5],
        [2, 5, 1],
        [2, 1, 4],
        [3, 0, 4],
        [3, 5, 0],
        [3, 1, 5],
        [3, 4, 1],
    ];
    ((0..6).map(corner).collect(), faces)
}

/// Edges through faces, at least one of the two of the cloth: every edge with every face, in exact arithmetic, without the
/// broad phase of the solver. Positions and faces of cloth and obstacle.
pub(super) fn exhaustive_crossings(x: [&[V3d]; 2], faces: [&[Face]; 2]) -> usize {
    let cloth = x[0].len() as u32;
    let all = x.concat();
    let moved = faces[1].iter().map(|f| f.map(|v| v + cloth));
    let faces: Vec<Face> = faces[0].iter().copied().chain(moved).collect();
    let mut found = 0;
    for edge in &edges(&faces) {
        let e = edge.map(|v| all[v as usize]);
        for face in &faces {
            let is_obstacle = edge[0] >= cloth && face[0] >= cloth;
            if is_obstacle || face.iter().any(|v| edge.contains(v)) {
                continue;
            }
            let f = face.map(|v| all[v as usize]);
            found += usize::from(boxes_meet(&e, &f) && edge_meets_triangle(&e, &f));
        }
    }
    found
}

fn boxes_meet(a: &[V3d], b: &[V3d]) -> bool {
    (0..3).all(|d| {
        let range = |s: &[V3d]| {
            let on_axis = s.iter().map(|p| p[d]);
            on_axis.fold([f64::INFINITY, f64::NEG_INFINITY], |r, c| {
                [r[0].min(c), r[1].max(c)]
            })
        };
        let (a, b) = (range(a), range(b));
        a[0] <= b[1] && b[0] <= a[1]
    })
}

/// Asserts that no edge passes through a face at the solver's state; `faces` of cloth and obstacle.
pub(super) fn assert_free(solver: &OfflineSolver<'_>, faces: [&[Face]; 2]) {
    let state = solver.state();
    let found = exhaustive_crossings([&state.now.x, &state.obstacle[0]], faces);
    assert_eq!(found, 0, "crossings at {} s", state.time);
}

#[test]
fn exhaustive_count_sees_one_needle_through_a_sheet() {
    let sheet = PlanarSheet::grid([2, 2], [0.1, 0.1]);
    let x = sheet.at_height(0.0);
    let needle = |y: f64| {
        let base = V3d::new(0.03, y, 0.02);
        vec![
            base,
            base + V3d::y() * 0.1,
            base + V3d::new(0.001, 0.1, 0.0),
        ]
    };
    let count = |y| exhaustive_crossings([&x, &needle(y)], [&sheet.faces, &[[0, 1, 2]]]);
    assert_eq!(count(-0.05), 2);
    assert_eq!(count(0.001), 0);
}
