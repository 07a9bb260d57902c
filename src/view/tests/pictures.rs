//! Whole pictures: visibility against the truth, untouched pixels, skipping, faults.

use super::fixture::{Scenery, draw};
use crate::{Config, GarmentView, Margins, Model, RenderError, State, Workspace, render};
use tryon_geometry::math::P3;
use tryon_geometry::math::order_statistics::median;
use tryon_geometry::mesh::{Face, face_normal};
use tryon_geometry::par::{self, Par};

#[test]
fn only_the_arm_hides_the_shirt() {
    for seed in [1, 2] {
        let s = Scenery::new(640, 480, seed);
        let garments = [s.garment()];
        for body in [true, false] {
            let mut input = s.input(&garments, None);
            if !body {
                input.body = None;
            }
            let (image, report) = draw(&Model::default(), &input).expect("drawn");
            let [arm, shirt] = s.mistakes(&image, 3);
            assert!(
                arm < 0.01 && shirt < 0.001,
                "body {body}: arm {arm}, shirt {shirt}, {report:?}"
            );
            // The plain depth test must make holes, or this test proves nothing.
            let plain = Margins {
                plain: 0.0,
                limb: 0.0,
                covered: 0.0,
                inner: 0.0,
                clear: 0.0,
                step: 0.0,
                patch: 0.0,
                ..Margins::default()
            };
            let naive = Model::new(Config {
                margins: plain,
                ..Config::default()
            });
            let (image, _) = draw(&naive, &input).expect("drawn");
            assert!(s.mistakes(&image, 3)[1] > 0.01);
        }
    }
}

#[test]
fn pixels_outside_the_garments_equal_the_captured_ones() {
    let s = Scenery::new(320, 240, 3);
    let captured = s.frame.color.as_ref().expect("colour");
    let none = s.input(&[], None);
    let (image, report) = draw(&Model::default(), &none).expect("drawn");
    assert_eq!(
        (&image, report.tiles_drawn, report.tiles_skipped),
        (captured, 0, 80)
    );
    let garments = [s.garment()];
    let (image, report) = draw(&Model::default(), &s.input(&garments, None)).expect("drawn");
    // The shirt spans about 87 columns; far from it every byte is the captured one.
    for y in 0..240 {
        for x in (0..60).chain(260..320) {
            assert_eq!(image.at(x, y), captured.at(x, y));
        }
    }
    assert!(
        report.tiles_drawn < 50 && report.tiles_drawn + report.tiles_skipped == 80,
        "{report:?}"
    );
    assert!(
        report.pixels_drawn > 3000 && report.pixels_occluded > 300,
        "{report:?}"
    );
}

#[test]
fn the_picture_is_independent_of_threads_and_workspace() {
    let s = Scenery::new(320, 240, 4);
    let garments = [s.garment(), s.garment()];
    let input = s.input(&garments, Some([400, 300]));
    let with = |par, work: &mut Workspace| {
        render(
            &Model::new(Config {
                par,
                ..Config::default()
            }),
            &mut State::default(),
            &input,
            work,
        )
        .expect("drawn")
        .0
    };
    let alone = with(Par::Seq, &mut Workspace::default());
    let mut used = Workspace::default();
    render(
        &Model::default(),
        &mut State::default(),
        &s.input(&garments[..1], None),
        &mut used,
    )
    .expect("drawn");
    for threads in [1, 3] {
        let got = par::with_threads(threads, || with(Par::Rayon, &mut used)).expect("pool");
        assert!(got == alone, "{threads} threads");
    }
}

#[test]
fn skipping_hidden_faces_and_normals_changes_no_byte() {
    let s = Scenery::new(320, 240, 6);
    // The shirt twice, and a hidden one inside the body's outline.
    let mut under = s.garment();
    let small: Vec<_> = under
        .vertices
        .iter()
        .map(|p| P3::new(0.5 * p.x, 0.5 * p.y, p.z))
        .collect();
    under.vertices = &small;
    let garments = [under, s.garment(), s.garment()];
    let vertices: usize = garments.iter().map(|g| g.vertices.len()).sum();
    let faces: usize = garments.iter().map(|g| g.faces.len()).sum();
    for par in [Par::Seq, Par::Rayon] {
        for samples in [1, 2, 3] {
            let with = |skip_hidden, skip_unseen| {
                let config = Config {
                    skip_hidden,
                    skip_unseen,
                    par,
                    samples,
                    ..Config::default()
                };
                draw(&Model::new(config), &s.input(&garments, None)).expect("drawn")
            };
            let (all, plain) = with(false, false);
            assert_eq!(
                [
                    plain.faces_hidden,
                    plain.normals_skipped,
                    plain.garments_hidden
                ],
                [0; 3]
            );
            for switches in [[true, false], [false, true], [true, true]] {
                let (image, report) = with(switches[0], switches[1]);
                assert!(image == all, "{switches:?}");
                // Five of six walls lie behind the nearest; faces between samples and at outlines do not count.
                assert_eq!(
                    report.faces_hidden > faces * 2 / 5,
                    switches[0],
                    "{report:?} of {faces}"
                );
                assert_eq!(
                    report.normals_skipped > vertices * 3 / 5,
                    switches[1],
                    "{report:?} of {vertices}"
                );
                assert_eq!(report.garments_hidden, 2 * usize::from(switches[1]));
                assert_eq!(report.pixels_drawn, plain.pixels_drawn);
            }
        }
    }
}

#[test]
fn inner_bias_hides_a_fold_that_passes_through() {
    let s = Scenery::new(320, 240, 4);
    let shirt = s.garment();
    // Its front once more, 5 mm nearer and inside out.
    let n = shirt.vertices.len() as u32;
    let nearer = shirt.vertices.iter().map(|p| p * (1.0 - 5e-3 / p.z));
    let vertices: Vec<_> = shirt.vertices.iter().copied().chain(nearer).collect();
    let front =
        |f: &&Face| face_normal(shirt.vertices, f).dot(&shirt.vertices[f[0] as usize].coords) < 0.0;
    let through = shirt
        .faces
        .iter()
        .filter(front)
        .map(|f| [f[0] + n, f[2] + n, f[1] + n]);
    let faces: Vec<_> = shirt.faces.iter().copied().chain(through).collect();
    let uv = shirt.uv.repeat(2);
    let folded = GarmentView {
        vertices: &vertices,
        faces: &faces,
        uv: &uv,
        normals: &[],
        ..shirt
    };
    for skip_hidden in [true, false] {
        let changed = |inner_bias: f32| {
            let model = Model::new(Config {
                inner_bias,
                skip_hidden,
                ..Config::default()
            });
            let [a, b] =
                [s.garment(), folded].map(|g| draw(&model, &s.input(&[g], None)).expect("drawn").0);
            (0..240)
                .flat_map(|y| (0..320).map(move |x| (x, y)))
                .filter(|(x, y)| a.at(*x, *y) != b.at(*x, *y))
                .count()
        };
        let [shown, hidden] = [changed(0.0), changed(Config::default().inner_bias)];
        assert!(shown > 3000 && hidden < shown / 100, "{shown} {hidden}");
    }
}

#[test]
fn biases_order_garments_and_leave_their_depths() {
    let s = Scenery::new(320, 240, 4);
    let shirt = s.garment();
    // The shirt over three hidden layers, and turned inside out.
    let small: Vec<_> = (shirt.vertices.iter())
        .map(|p| P3::new(0.5 * p.x, 0.5 * p.y, p.z))
        .collect();
    let under = GarmentView {
        vertices: &small,
        ..shirt
    };
    let turned: Vec<Face> = shirt.faces.iter().map(|f| [f[0], f[2], f[1]]).collect();
    let turned = GarmentView {
        faces: &turned,
        ..shirt
    };
    let depths = |garments: &[GarmentView<'_>]| -> Vec<f32> {
        let mut work = Workspace::default();
        let (model, state) = (Model::default(), &mut State::default());
        render(&model, state, &s.input(garments, None), &mut work).expect("drawn");
        let covered = work.pixels.iter().filter(|p| p.covered == 9);
        covered.map(|p| p.depth).collect()
    };
    let mut alone = depths(&[shirt]);
    assert!(alone.len() > 3000);
    let expected = median(&mut alone).expect("pixels");
    for garments in [vec![under, under, under, shirt], vec![turned]] {
        let got = median(&mut depths(&garments)).expect("pixels");
        assert!(
            (got - expected).abs() < 5e-4,
            "{got} instead of {expected} m"
        );
    }
}

#[test]
fn invalid_input_is_named_and_degenerate_input_draws_nothing() {
    let s = Scenery::new(160, 120, 5);
    let fault = |g: GarmentView<'_>| draw(&Model::default(), &s.input(&[g], None)).err();
    let mut g = s.garment();
    let uv = [[0.0; 2]; 3];
    g.uv = &uv;
    let what = "texture coordinates";
    assert_eq!(
        fault(g),
        Some(RenderError::Length {
            garment: 0,
            what,
            got: 3,
            vertices: s.shirt.vertices.len()
        })
    );
    let mut g = s.garment();
    let faces = [[0, 1, 2], [0, 1, 99_999]];
    g.faces = &faces;
    assert_eq!(
        fault(g),
        Some(RenderError::Face {
            garment: 0,
            face: 1
        })
    );
    // Degenerate, behind the camera, beside the picture: nothing is drawn, nothing breaks.
    for points in [
        [[0.0, 0.0, 2.0]; 3],
        [[0.1, 0.0, -1.0], [0.0, 0.1, -1.0], [0.0; 3]],
        [[9.0, 0.0, 1.0]; 3],
    ] {
        let points = points.map(P3::from);
        let mut g = s.garment();
        (g.vertices, g.uv, g.faces) = (&points, &[], &[[0, 1, 2]]);
        let garments = [g];
        let (_, r) = draw(&Model::default(), &s.input(&garments, None)).expect("fine");
        assert_eq!(r.pixels_drawn, 0);
    }
}
