//! The offline solver after the preview: an outfit at rest on a body, taken over on a finer mesh.

use crate::common::{DT, arms_down, posed};
use std::ops::ControlFlow;
use tryon::body::measure::measure;
use tryon::body::{BodyShape, Pose, embedded};
use tryon::cloth::contact::{ContactMesh, ContactSurface};
use tryon::cloth::fine::{JoinedSurfaces, OfflineSolver};
use tryon::geometry::math::{P3, Rigid, V3, V3d, World};
use tryon::geometry::par::Par;
use tryon::mirror::{Choice, DressedOutfit, OfflineOutfit, OfflineRun, PutOn, Subject};

/// A coarse skirt on the mean body, at rest; triangles and vertices of the body.
fn worn() -> (DressedOutfit, Vec<[u32; 3]>, Vec<P3>) {
    let template = embedded::template();
    let rest = template.personalise(&BodyShape::default());
    let pose: Pose<World> = arms_down(&template, &rest);
    let subject = Subject {
        template: &template,
        rest: &rest,
        pose: &pose,
        world_from_camera: Rigid::identity(),
    };
    let measures = measure(&template, &rest).expect("measures");
    let choice = Choice::library("skirt", None).expect("a garment");
    let how = PutOn {
        is_coarse: true,
        ..PutOn::default()
    };
    let sized = vec![choice.sized(&measures).expect("a size")];
    let mut outfit = DressedOutfit::put_on(&subject, sized, how).expect("dressed");
    outfit.carry_to(&subject).expect("a body");
    let body = posed(&template, &rest, &pose);
    for _ in 0..15 {
        outfit.step(&body, DT).expect("a step");
    }
    (outfit, template.mesh().faces().to_vec(), body)
}

/// Edges through faces.
fn crossings(outfit: &OfflineOutfit, faces: &[[u32; 3]], solver: &OfflineSolver<'_>) -> usize {
    let state = solver.state();
    let surface = |vertices, faces| ContactSurface { vertices, faces };
    let mesh = ContactMesh::new(
        surface(state.now.x.len(), &outfit.cloth().faces),
        surface(state.obstacle[0].len(), faces),
    )
    .expect("a mesh");
    let x: Vec<V3d> = (state.now.x.iter().chain(&state.obstacle[0]))
        .copied()
        .collect();
    JoinedSurfaces(&mesh).crossings(Par::Seq, &x).len()
}

#[test]
fn a_preview_goes_on_offline_without_intersections() {
    let (worn, faces, body) = worn();
    let coarse = worn.model.outfit.garments[0].vertices;
    let outfit = OfflineOutfit::new(&worn, &faces, 4 * coarse).expect("finer");
    let count = outfit.cloth().len();
    assert!(
        (3 * coarse..=4 * coarse).contains(&count),
        "{count} of {coarse}"
    );
    assert_eq!(outfit.drawn_positions(&vec![P3::origin(); count]).len(), 1);

    let mut steps = Vec::new();
    let (mut run, report) = outfit
        .drape(&worn, Par::Seq, |vertices, _| {
            steps.push(vertices);
            ControlFlow::Continue(())
        })
        .expect("at rest");
    assert_eq!(report.levels.len(), 2);
    let [first, last] = [0, 1].map(|k| report.levels[k].drape);
    assert!(first.settled && last.motion < 3e-3, "{report:?}");
    assert!(
        steps.contains(&coarse) && steps.contains(&count),
        "{steps:?}"
    );
    let before = run.solver().state().now.x.clone();
    assert_eq!(crossings(&outfit, &faces, run.solver()), 0);

    // The body moves aside, and the waistband with it; a sudden speed costs steps at any length.
    let aside = V3::new(0.001, 0.0, 0.0);
    let moved: Vec<P3> = worn
        .state
        .collision_body()
        .vertices()
        .iter()
        .map(|p| p + aside)
        .collect();
    assert_eq!(moved.len(), body.len());
    let pins = outfit.pins(&moved);
    assert!(!pins.is_empty(), "the waistband");
    run.follow(&moved, DT).expect("a frame");
    assert_eq!(crossings(&outfit, &faces, run.solver()), 0);
    let x = &run.solver().state().now.x;
    for pin in &pins {
        assert!(
            (x[pin.vertex as usize] - pin.target).norm() < 1e-4,
            "{pin:?}"
        );
    }
    let sums = [&before, x].map(|x| x.iter().sum::<V3d>() / count as f64);
    assert!((sums[1] - sums[0]).x > 1e-4, "the skirt follows: {sums:?}");

    let saved = run.solver().checkpoint(1);
    let resumed = OfflineRun::resumed(&outfit, &saved, Par::Seq).expect("its checkpoint");
    assert_eq!(resumed.solver().state(), run.solver().state());
    let coarse = OfflineOutfit::new(&worn, &faces, coarse).expect("coarse");
    assert!(
        OfflineRun::resumed(&coarse, &saved, Par::Seq).is_err(),
        "finer"
    );
}

#[test]
fn a_drape_that_breaks_off_leaves_finer_meshes_as_they_are() {
    let (worn, faces, _) = worn();
    let coarse = worn.model.outfit.garments[0].vertices;
    let outfit = OfflineOutfit::new(&worn, &faces, 4 * coarse).expect("finer");
    let (run, report) = outfit
        .drape(&worn, Par::Seq, |_, _| ControlFlow::Break(()))
        .expect("broken off");
    assert_eq!(run.solver().state().now.x.len(), outfit.cloth().len());
    let steps: Vec<usize> = report.levels.iter().map(|l| l.drape.steps).collect();
    assert_eq!(steps, [1, 0]);
    assert!(!report.is_settled());
    assert_eq!(crossings(&outfit, &faces, run.solver()), 0);
}
