//! Length of the offline solver's steps: motion that implicit steps damp does not shorten them.

use nalgebra::Vector2;
use tryon::cloth::elastic::RestSheet;
use tryon::cloth::fine::{
    FrameTargets, MotionState, OfflineCloth, OfflineSettings, OfflineSolver, OfflineState,
    StitchSprings,
};
use tryon::garment::Material;
use tryon::geometry::math::V3d;
use tryon::geometry::par::Par;

/// Square of 0.2 m of 10 × 10 quads: triangles and material coordinates.
fn square() -> (Vec<[u32; 3]>, Vec<Vector2<f64>>) {
    let at = |k: u32| Vector2::new(f64::from(k % 11), f64::from(k / 11)) * 0.02;
    let corner = |q: u32| q / 10 * 11 + q % 10;
    let split = |k: u32| [[k, k + 1, k + 11], [k + 1, k + 12, k + 11]];
    let faces = (0..100).flat_map(|q| split(corner(q))).collect();
    (faces, (0..121).map(at).collect())
}

/// Steps and repeated steps of the first 1/60 s of a square let go at `stretch` times its size.
fn steps(stretch: f64) -> (usize, usize) {
    let (faces, flat) = square();
    let rest = RestSheet::flat(faces, &flat).expect("a sheet");
    let seams = StitchSprings {
        stitches: Vec::new(),
        stiffness: 1.0,
    };
    let cotton = Material::preset("cotton").expect("known");
    let cloth = OfflineCloth::of_sewn_sheet(&rest, flat.len(), &cotton, seams, V3d::zeros());
    let cloth = cloth.expect("cloth");
    let x = flat.iter().map(|p| V3d::new(p.x, 0.0, p.y) * stretch);
    let state = OfflineState {
        now: MotionState {
            x: x.collect(),
            v: vec![V3d::zeros(); flat.len()],
        },
        ..OfflineState::default()
    };
    let settings = OfflineSettings::default();
    let mut solver = OfflineSolver::new(&cloth, &[], state, settings, Par::Seq).expect("a solver");
    let frame = solver.advance(1.0 / 60.0, &FrameTargets::default());
    let report = frame.expect("a frame");
    (report.steps, report.inaccurate + report.unsolved)
}

#[test]
fn a_stressed_start_takes_the_longest_steps() {
    assert_eq!(steps(1.0), (1, 0));
    // 3 % of strain move the rim by 3 mm within the step, ten times the error that is allowed.
    assert_eq!(steps(1.03), (1, 0));
}
