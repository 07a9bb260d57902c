//! Closed forms: elongation, catenary, cantilever, friction, curved rest shapes.

use crate::live::Sheet;
use crate::live::solver::explicit::edge_stiffness::TriangleSprings;
use crate::live::solver::explicit::test_sheets::{Lab, cotton, distance, grid, sheet};
use crate::live::solver::explicit::{ContactPlane, V4};
use tryon_geometry::math::{P3, V3d};

#[test]
fn edge_springs_have_the_energy_of_hookes_law() {
    // Small uniform strain of one skew triangle: the energy of the edges equals area times Hooke's energy density.
    let rest = [[[0.0, 0.0], [0.03, 0.004], [0.011, 0.02]]];
    let mut m = cotton(0.0);
    m.stretch_warp *= 2.0;
    let s = sheet(&[[0, 1, 2]], &rest, 3, &m);
    let springs = TriangleSprings::new(&s, &s.elements[0]).expect("an area");
    let lengths = |p: [[f64; 2]; 3]| {
        nalgebra::Vector3::from_fn(|i, _| {
            let (a, b) = (p[(i + 1) % 3], p[(i + 2) % 3]);
            (a[0] - b[0]).hypot(a[1] - b[1])
        })
    };
    for (xx, yy, xy) in [
        (1e-4, 0.0, 0.0),
        (0.0, 1e-4, 0.0),
        (0.0, 0.0, 1e-4),
        (2e-4, -1e-4, 5e-5),
    ] {
        let p = rest[0].map(|p| [p[0] * (1.0 + xx) + p[1] * xy, p[1] * (1.0 + yy) + p[0] * xy]);
        let d = lengths(p) - lengths(rest[0]);
        let edges = 0.5 * d.dot(&(springs.stiffness * d));
        let x: Vec<V3d> = p.iter().map(|p| V3d::new(p[0], p[1], 0.0)).collect();
        let exact = s.energy(&x);
        assert!(
            (edges - exact).abs() < 2e-3 * exact,
            "{xx} {yy} {xy}: {edges:e} {exact:e}"
        );
    }
    assert_eq!(springs.v, [0, 1, 2]);
}

#[test]
fn hanging_strip_elongates_as_rho_g_l2_over_2e() {
    // Width w, hung by its upper end, without sideways coupling: elongation ρ g L² / (2 E).
    let (nx, ny, d) = (2, 20, 0.02);
    let (x, faces, rest) = grid(nx, ny, d, d);
    let mut m = cotton(0.0);
    (m.coupling, m.shear, m.damping) = (0.0, 500.0, 20.0);
    (m.stretch_warp, m.stretch_weft) = (1000.0, 1000.0);
    // It hangs along z here: gravity along +z.
    let mut lab = Lab::new(sheet(&faces, &rest, x.len(), &m), &x, 1e-4, 1);
    assert_eq!(lab.stable.soft_elements, 0);
    lab.gravity = V4::new(0.0, 0.0, 9.81);
    lab.run(20_000, &(0..=nx as u32).collect::<Vec<_>>());
    let y = lab.positions();
    let long = y[y.len() - 1].z - ny as f64 * d;
    let exact = 0.18 * 9.81 * (ny as f64 * d).powi(2) / (2.0 * 1000.0);
    assert!((long - exact).abs() < 0.03 * exact, "{long:e} {exact:e}");
}

#[test]
fn heavy_strip_hangs_in_a_catenary() {
    // A long narrow strip between two points at 0.8 of its length; bending and stretch hardly matter.
    let (nx, ny, d) = (1, 60, 0.01);
    let (x, faces, rest) = grid(nx, ny, d, d);
    let mut m = cotton(0.0);
    m.damping = 8.0;
    let mut lab = Lab::new(sheet(&faces, &rest, x.len(), &m), &x, 1e-4, 1);
    let length = ny as f64 * d;
    let span = 0.8 * length;
    let start: Vec<V3d> = x
        .iter()
        .map(|p| {
            V3d::new(
                p.x,
                -0.02 * (p.z / length * std::f64::consts::PI).sin(),
                p.z * 0.8,
            )
        })
        .collect();
    lab.place(&start, &vec![V3d::zeros(); x.len()]);
    let last = x.len() as u32;
    lab.run(25_000, &[0, 1, last - 2, last - 1]);
    // 2 a sinh(span / 2a) = length by bisection; sag a (cosh(span / 2a) − 1).
    let (mut lo, mut hi) = (0.05, 5.0);
    for _ in 0..80 {
        let a: f64 = 0.5 * (lo + hi);
        if 2.0 * a * (span / (2.0 * a)).sinh() > length {
            lo = a
        } else {
            hi = a
        }
    }
    let sag = lo * ((span / (2.0 * lo)).cosh() - 1.0);
    let deepest = lab.positions().iter().map(|p| -p.y).fold(0.0, f64::max);
    assert!((deepest - sag).abs() < 0.02 * sag, "{deepest} {sag}");
}

#[test]
fn cantilever_keeps_its_share_of_the_beam_deflection() {
    // Small deflection: w = ρ g L⁴ / (8 D) at the free end. Quadratic hinges have the rigidity of their fabric on
    // equilateral triangles; this grid of right-angled ones deflects by 1.55 of the beam.
    let (nx, ny, d) = (4, 6, 0.01);
    let (x, faces, rest) = grid(nx, ny, d, d);
    let mut m = cotton(2e-4);
    (m.damping, m.coupling) = (12.0, 0.0);
    (m.shear, m.stretch_warp, m.stretch_weft) = (500.0, 1000.0, 1000.0);
    let mut lab = Lab::new(sheet(&faces, &rest, x.len(), &m), &x, 2.5e-5, 1);
    // Two rows hold place and slope.
    let row = nx as u32 + 1;
    lab.run(40_000, &(0..2 * row).collect::<Vec<_>>());
    let y = lab.positions();
    let free = y[y.len() - 3].y;
    let length: f64 = (ny - 1) as f64 * d;
    let exact = -0.18 * 9.81 * length.powi(4) / (8.0 * 2e-4);
    assert!((1.4..1.7).contains(&(free / exact)), "{free:e} {exact:e}");
}

#[test]
fn sheet_on_an_incline_slides_by_coulomb_friction() {
    // On a plane at 30°: stays for μ above tan 30°, else accelerates with g (sin − μ cos).
    let (x, faces, rest) = grid(3, 3, 0.02, 0.02);
    let tilt = 30f64.to_radians();
    let normal = V4::new(tilt.sin() as f32, tilt.cos() as f32, 0.0);
    let down = V3d::new(tilt.cos(), -tilt.sin(), 0.0);
    for (mu, expected) in [(0.7, 0.0), (0.3, 9.81 * (tilt.sin() - 0.3 * tilt.cos()))] {
        let s = sheet(&faces, &rest, x.len(), &cotton(1e-5));
        let mut lab = Lab::new(s, &x, 2e-4, 1);
        let on: Vec<V3d> = x
            .iter()
            .map(|p| down * p.x + V3d::new(0.0, 0.0, p.z))
            .collect();
        lab.place(&on, &vec![V3d::zeros(); x.len()]);
        let planes: Vec<ContactPlane> = (0..x.len() as u32)
            .map(|vertex| ContactPlane {
                vertex,
                normal,
                offset: 0.0,
                velocity: V4::default(),
                friction: mu,
            })
            .collect();
        let n = 2500;
        lab.run_on(n, &[], &planes);
        let v = lab.velocities().iter().sum::<V3d>().dot(&down) / x.len() as f64;
        assert!(
            (v - expected * n as f64 * lab.h).abs() < 5e-3,
            "μ {mu}: {v}"
        );
        assert!(
            lab.positions()
                .iter()
                .all(|p| p.dot(&V3d::new(tilt.sin(), tilt.cos(), 0.0)) > -1e-5)
        );
    }
}

#[test]
fn curved_rest_shape_is_an_equilibrium() {
    // A cylinder segment stays when nothing pulls.
    let (flat, faces, rest) = grid(10, 4, 0.01, 0.01);
    let r = 0.05;
    let x: Vec<V3d> = flat
        .iter()
        .map(|p| V3d::new(r * (p.x / r).sin(), r * (p.x / r).cos(), p.z))
        .collect();
    let points: Vec<P3> = x.iter().map(|p| P3::from(p.cast::<f32>())).collect();
    let s = Sheet::new(x.len(), &faces, &rest, &cotton(1e-3), Some(&points)).expect("a sheet");
    let mut lab = Lab::new(s, &x, 1e-4, 1);
    lab.gravity = V4::default();
    lab.run(5000, &[]);
    let moved = distance(&lab.positions(), &x);
    assert!(moved < 1e-3, "{moved}");
}

#[test]
fn sheet_that_falls_flat_in_air_has_its_closed_form() {
    // v = v₀ tanh(g t/v₀) with ρ g = k v₀².
    const AIR: f64 = 0.7;
    let (x, faces, rest) = grid(4, 4, 0.02, 0.02);
    let mut falling = sheet(&faces, &rest, x.len(), &cotton(1e-5));
    falling.air = AIR;
    for patches in [1, 2] {
        let h = 2e-4;
        let mut lab = Lab::new(falling.clone(), &x, h, patches);
        lab.run(5_000, &[]);
        let fallen = -lab.positions()[12].y;
        let terminal = (0.18 * 9.81 / AIR).sqrt();
        let expected = terminal * terminal / 9.81 * (9.81 / terminal).cosh().ln();
        assert!(
            (fallen / expected - 1.0).abs() < 0.01,
            "{fallen} {expected}"
        );
    }
}
