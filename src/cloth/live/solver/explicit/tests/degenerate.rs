//! Numbers at their limits: single precision against double, extreme stiffness and shape ratios, degenerate meshes.

use crate::live::solver::explicit::edge_stiffness::TriangleSprings;
use crate::live::solver::explicit::mass_filter::MassFilter;
use crate::live::solver::explicit::stability::element_limits;
use crate::live::solver::explicit::stable_sheet::ends;
use crate::live::solver::explicit::test_sheets::{
    Lab, Mesh, cotton, distance, grid, sheet, stable_step,
};
use crate::live::{ClothError, Sheet};
use crate::settings::SolverSettings;
use nalgebra::{Matrix2, Vector2, Vector3};
use tryon_geometry::math::V3d;

/// The integrator in double precision, by its definition.
struct Oracle<'a> {
    sheet: &'a Sheet,
    x: Vec<V3d>,
    v: Vec<V3d>,
    bending: Vec<V3d>,
    h: f64,
    ahead: f64,
    smooth: usize,
}

impl Oracle<'_> {
    fn bend(&mut self, late: f64) {
        let y: Vec<V3d> = self
            .x
            .iter()
            .zip(&self.v)
            .map(|(x, v)| x + v * late)
            .collect();
        self.bending = vec![V3d::zeros(); y.len()];
        for h in &self.sheet.hinges {
            let q = (0..4).fold(V3d::zeros(), |q, k| q + y[h.v[k] as usize] * h.c[k]);
            (0..4).for_each(|k| self.bending[h.v[k] as usize] -= q * (h.w * h.c[k]));
        }
    }
    fn step(&mut self) {
        let y: Vec<V3d> = self
            .x
            .iter()
            .zip(&self.v)
            .map(|(x, v)| x + v * (self.h * self.ahead))
            .collect();
        let mut a = self.bending.clone();
        for e in &self.sheet.elements {
            let s = TriangleSprings::new(self.sheet, e).expect("an area");
            let v = s.v;
            // The shape gradients' inverse has two edges of the flat triangle as columns.
            let r = Matrix2::new(e.b[1][0], e.b[1][1], e.b[2][0], e.b[2][1]);
            let r = r.try_inverse().expect("an area");
            let (p, q) = (r.column(0), r.column(1));
            let rest = [(q - p).norm(), q.norm(), p.norm()];
            let d = [0, 1, 2].map(|i| y[v[(i + 2) % 3] as usize] - y[v[(i + 1) % 3] as usize]);
            let t = s.stiffness * Vector3::from_fn(|i, _| d[i].norm() - rest[i]);
            for i in 0..3 {
                let pull = d[i].normalize() * t[i];
                a[v[(i + 1) % 3] as usize] += pull;
                a[v[(i + 2) % 3] as usize] -= pull;
            }
        }
        for (a, m) in a.iter_mut().zip(&self.sheet.mass) {
            *a = *a / *m + V3d::new(0.0, -9.81, 0.0);
        }
        let filter = MassFilter::of_sheet(
            self.sheet,
            ends(self.sheet),
            self.smooth,
            &SolverSettings::default(),
        );
        let mut planes = [[0, 1], [2, 2]].map(|[p, q]| {
            a.iter()
                .map(|a| Vector2::new(a[p], a[q]))
                .collect::<Vec<_>>()
        });
        planes.iter_mut().for_each(|p| filter.apply(p));
        let keep = 1.0 / (1.0 + self.h * self.sheet.damping);
        for i in 0..a.len() {
            let a = V3d::new(planes[0][i].x, planes[0][i].y, planes[1][i].x);
            self.v[i] = (self.v[i] + a * self.h) * keep;
            self.x[i] += self.v[i] * self.h;
        }
    }
}

#[test]
fn single_precision_follows_double_precision() {
    let (x, faces, rest) = grid(9, 7, 0.02, 0.016);
    let mut m = cotton(1e-5);
    m.damping = 0.5;
    let wild: Vec<V3d> = x
        .iter()
        .map(|p| p + V3d::new(0.0, 5e-4 * (p.x * 60.0).sin() * (p.z * 70.0).cos(), 0.0))
        .collect();
    // Taut by its spin: buckling amplifies the last digit within a tenth of a second.
    let middle = wild.iter().sum::<V3d>() / wild.len() as f64;
    let spin: Vec<V3d> = wild
        .iter()
        .map(|p| V3d::new(0.3, 20.0, -1.0).cross(&(p - middle)))
        .collect();
    for smooth in [0, 2] {
        let s = sheet(&faces, &rest, x.len(), &m);
        let h = 0.5 * stable_step(&s, smooth);
        let mut lab = Lab::with_filter(s, &x, h, 1, smooth);
        lab.place(&wild, &spin);
        assert_eq!(lab.stable.soft_elements, 0);
        let every = lab.bending_interval;
        let s = lab.sheet.clone();
        // The substep in single precision.
        let h = f64::from(h as f32);
        let mut oracle = Oracle {
            sheet: &s,
            x: wild.clone(),
            v: spin.clone(),
            bending: Vec::new(),
            h,
            ahead: 0.25,
            smooth,
        };
        let blocks = (0.05 / (h * every as f64)) as usize;
        for _ in 0..blocks {
            lab.run(every, &[]);
            oracle.bend(h * every as f64 * 0.5);
            (0..every).for_each(|_| oracle.step());
        }
        let (went, apart) = (
            distance(&oracle.x, &wild),
            distance(&oracle.x, &lab.positions()),
        );
        assert!(
            went > 0.05 && apart < 5e-6,
            "degree {smooth}: {apart} m apart after {went} m"
        );
    }
}

/// Cells of these widths along x.
fn uneven(widths: &[f64], ny: usize, dy: f64) -> Mesh {
    let (mut x, faces, _) = grid(widths.len(), ny, 1.0, dy);
    let mut at = vec![0.0];
    widths.iter().for_each(|w| at.push(at[at.len() - 1] + w));
    x.iter_mut().for_each(|p| p.x = at[p.x.round() as usize]);
    let rest = faces
        .iter()
        .map(|f| f.map(|v| [x[v as usize].x, x[v as usize].z]))
        .collect();
    (x, faces, rest)
}

#[test]
fn slivers_soften_only_themselves() {
    let (x, faces, rest) = uneven(&[0.02, 0.02, 1.5e-5, 0.02, 0.02], 6, 0.02);
    let s = sheet(&faces, &rest, x.len(), &cotton(1e-5));
    let limits = element_limits(&s);
    let [low, high] = [
        limits.iter().copied().fold(f64::MAX, f64::min),
        limits.iter().copied().fold(0.0, f64::max),
    ];
    assert!(
        high > 1e6 * low,
        "stiffness over mass of neighbours: {}",
        high / low
    );
    for smooth in [0, 2] {
        let mut lab = Lab::with_filter(s.clone(), &x, 1e-4, 1, smooth);
        let soft = (lab.stable.soft_elements, lab.stable.kept_stiffness);
        assert!(soft.0 == 12 && soft.1 > 0.999, "{soft:?}");
        lab.run(10_000, &[0, 5]);
        assert!(
            lab.positions().iter().all(|p| p.norm() < 1.0),
            "degree {smooth}: within a metre after a second"
        );
        assert!(lab.velocities().iter().all(|v| v.norm() < 10.0));
    }
}

#[test]
fn sheets_without_area_or_mass_are_refused_by_name() {
    let (x, faces, mut rest) = grid(3, 3, 0.02, 0.02);
    let whole = |faces: &[tryon_geometry::mesh::Face], rest: &[_], n| {
        Sheet::new(n, faces, rest, &cotton(1e-5), None).map(|_| ())
    };
    assert_eq!(whole(&faces, &rest, x.len()), Ok(()));
    // A vertex of no triangle has no mass.
    let fault = whole(&faces, &rest, x.len() + 1).expect_err("a vertex without a triangle");
    assert!(
        matches!(&fault, ClothError::Field { field, .. } if field == "vertex 16"),
        "{fault}"
    );
    // Two corners in one place, then one vertex as two corners.
    rest[7][1] = rest[7][0];
    assert!(matches!(
        whole(&faces, &rest, x.len()),
        Err(ClothError::ZeroArea { face: 7, .. })
    ));
    let (_, mut twice, rest) = grid(3, 3, 0.02, 0.02);
    twice[4][1] = twice[4][0];
    assert!(matches!(
        whole(&twice, &rest, x.len()),
        Err(ClothError::Mesh(_))
    ));
    let far = [[[0.0, 0.0], [f64::NAN, 0.0], [0.0, 1.0]]];
    assert!(
        matches!(
            whole(&[[0, 1, 2]], &far, 3),
            Err(ClothError::ZeroArea { face: 0, .. })
        ),
        "not a number"
    );
}

#[test]
fn coincident_vertices_stay_finite() {
    // The rest shape is sound; all of the sheet starts in one point, and a hinge folded onto itself.
    let (x, faces, rest) = grid(4, 4, 0.02, 0.02);
    for squeeze in [0.0, 1e-7] {
        let s = sheet(&faces, &rest, x.len(), &cotton(1e-5));
        let mut lab = Lab::with_filter(s, &x, 1e-4, 1, 1);
        let start: Vec<V3d> = x.iter().map(|p| p * squeeze).collect();
        lab.place(&start, &vec![V3d::zeros(); x.len()]);
        lab.run(2000, &[]);
        assert!(
            lab.positions()
                .iter()
                .chain(&lab.velocities())
                .all(|p| p.norm() < 1e3),
            "squeezed to {squeeze}"
        );
    }
}

#[test]
fn slivers_and_anisotropic_sheets_stay_stable() {
    // Aspect 1:1000 in one direction, and a sheet a million times stiffer along than across.
    let slivers = grid(3, 40, 0.02, 0.02 / 1000.0 * 10.0);
    let mut stiff = cotton(1e-5);
    (stiff.stretch_warp, stiff.shear, stiff.coupling) = (1e6, 1.0, 0.0);
    stiff.stretch_weft = 2.0;
    let even = grid(12, 12, 0.02, 0.02);
    for ((x, faces, rest), m) in [(slivers, cotton(1e-3)), (even, stiff)] {
        let mut lab = Lab::new(sheet(&faces, &rest, x.len(), &m), &x, 2e-4, 1);
        assert!(lab.stable.kept_stiffness < 1.0 && lab.stable.soft_elements > 0);
        lab.run(5000, &[0, 1]);
        let y = lab.positions();
        assert!(
            y.iter().all(|p| p.norm() < 20.0),
            "it neither explodes nor becomes NaN"
        );
    }
}
