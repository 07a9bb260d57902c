//! Numbers at their limits: single precision against double, stiffness and shape at extreme ratios, meshes at fault.

use super::stability::element_limits;
use super::stable_sheet::filter;
use super::tests::{Lab, cotton, grid, sheet};
use super::{StableSheet, triangles};
use crate::cloth::{ClothError, Sheet};
use crate::math::V3d;
use crate::mesh::Face;
use nalgebra::{Vector2, Vector3};

/// The integrator in double precision, as its definition says.
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
        for (v, k, rest) in triangles(self.sheet) {
            let d = [0, 1, 2].map(|i| y[v[(i + 2) % 3] as usize] - y[v[(i + 1) % 3] as usize]);
            let t = k * Vector3::from_fn(|i, _| d[i].norm() - rest[i]);
            for i in 0..3 {
                let pull = d[i].normalize() * t[i];
                a[v[(i + 1) % 3] as usize] += pull;
                a[v[(i + 2) % 3] as usize] -= pull;
            }
        }
        for (a, m) in a.iter_mut().zip(&self.sheet.mass) {
            *a = *a / *m + V3d::new(0.0, -9.81, 0.0);
        }
        let ends = self
            .sheet
            .edges
            .iter()
            .map(|(v, _)| [v[0].min(v[1]), v[0].max(v[1])])
            .collect();
        let filter = filter(self.sheet, ends, self.smooth);
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
fn single_precision_moves_as_double_does() {
    let (x, faces, rest) = grid(9, 7, 0.02, 0.016);
    let mut m = cotton(1e-5);
    m.damping = 0.5;
    let wild: Vec<V3d> = x
        .iter()
        .map(|p| p + V3d::new(0.0, 5e-4 * (p.x * 60.0).sin() * (p.z * 70.0).cos(), 0.0))
        .collect();
    // So fast that it is taut: a sheet that buckles makes the last digit large within a tenth of a second.
    let middle = wild.iter().sum::<V3d>() / wild.len() as f64;
    let spin: Vec<V3d> = wild
        .iter()
        .map(|p| V3d::new(0.3, 20.0, -1.0).cross(&(p - middle)))
        .collect();
    for smooth in [0, 2] {
        let s = sheet(&faces, &rest, x.len(), &m);
        let h = 0.5 * StableSheet::stable_step(&s, 0.25, smooth);
        let mut lab = Lab::smooth(s, &x, h, 1, smooth);
        lab.place(&wild, &spin);
        assert_eq!(lab.plan.soft_elements, 0);
        let every = lab.bend_every;
        let s = lab.sheet.clone();
        // The step that it takes is a number of single precision.
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
        let far = |a: &[V3d], b: &[V3d]| {
            a.iter()
                .zip(b)
                .map(|(a, b)| (a - b).norm())
                .fold(0.0, f64::max)
        };
        let (went, apart) = (far(&oracle.x, &wild), far(&oracle.x, &lab.positions()));
        assert!(
            went > 0.05 && apart < 5e-6,
            "degree {smooth}: {apart} m apart after {went} m"
        );
    }
}

/// Cells of these widths along x.
fn uneven(widths: &[f64], ny: usize, dy: f64) -> (Vec<V3d>, Vec<Face>, Vec<[[f64; 2]; 3]>) {
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
fn slivers_a_thousand_times_as_long_as_wide_soften_only_themselves() {
    let (x, faces, rest) = uneven(&[0.02, 0.02, 1.5e-5, 0.02, 0.02], 6, 0.02);
    let s = sheet(&faces, &rest, x.len(), &cotton(1e-5));
    let limits = element_limits(&s, false);
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
        let mut lab = Lab::smooth(s.clone(), &x, 1e-4, 1, smooth);
        let soft = (lab.plan.soft_elements, lab.plan.softened);
        assert!(soft.0 == 12 && soft.1 > 0.999, "{soft:?}");
        lab.run(10_000, &[0, 5]);
        assert!(
            lab.positions().iter().all(|p| p.norm() < 1.0),
            "degree {smooth}: a second and where it hangs"
        );
        assert!(lab.velocities().iter().all(|v| v.norm() < 10.0));
    }
}

#[test]
fn what_has_no_area_or_no_mass_is_refused_by_name() {
    let (x, faces, mut rest) = grid(3, 3, 0.02, 0.02);
    let whole =
        |faces: &[Face], rest: &[_], n| Sheet::new(n, faces, rest, &cotton(1e-5), None).map(|_| ());
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
fn two_vertices_in_one_place_part_or_stay_but_stay_numbers() {
    // The rest shape is sound; all of the sheet starts in one point, and a hinge folded onto itself.
    let (x, faces, rest) = grid(4, 4, 0.02, 0.02);
    for squeeze in [0.0, 1e-7] {
        let s = sheet(&faces, &rest, x.len(), &cotton(1e-5));
        let mut lab = Lab::smooth(s, &x, 1e-4, 1, 1);
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
