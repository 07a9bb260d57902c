//! The compositor on the graphics card against the processor: the same pictures, timed side by side.
//!
//! `cargo run --release --features gpu --example card -- [--software] [--rounds N] [--out DIR]`
//!
//! A synthetic shopper in T-shirt and skirt, drawn at three sizes. Prints a Markdown row a size: medians and 99th
//! percentiles in milliseconds, and how far the pictures differ.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used)] // a development tool: stop at the first fault

use std::path::PathBuf;
use std::time::Instant;
use tryon::body::Pose;
use tryon::camera::ColorImage;
use tryon::composite::{
    BodyView, GarmentView, Input, Limbs, Look, Model, RenderError, RenderReport, State, Workspace,
    render,
};
use tryon::dressing::{DressOptions, dress};
use tryon::formats::image::write_png_rgb;
use tryon::garment::{Size, library};
use tryon::gpu::Renderer;
use tryon::math::{P3, World};
use tryon::synth::{Sequence, Setting, Shopper};

const SIZES: [[u32; 2]; 3] = [[640, 480], [1280, 720], [1920, 1080]];
/// Grey levels beyond which a pixel counts as different.
const DIFFERENT: i32 = 3;

fn main() {
    let (mut software, mut rounds, mut out) = (false, 60, None::<PathBuf>);
    let mut args = std::env::args().skip(1);
    while let Some(word) = args.next() {
        match word.as_str() {
            "--software" => software = true,
            "--rounds" => rounds = args.next().unwrap().parse().unwrap(),
            "--out" => out = Some(args.next().unwrap().into()),
            other => panic!("{other} is not understood"),
        }
    }
    let begun = Instant::now();
    let mut card = Renderer::new(software).expect("an adapter");
    println!("{:?}, ready after {:.0} ms", card.adapter(), ms(begun));

    let sequence = Sequence::new(Shopper::default(), Setting::default());
    let (frame, truth) = sequence.frame(60);
    let patterns = ["tshirt", "skirt"].map(|name| library::pattern(name, Size::default()).unwrap());
    let template = &sequence.shopper().template;
    let world_from_camera = sequence.setting().world_from_camera;
    let pose: Pose<World> = Pose {
        root: world_from_camera * truth.pose.root,
        angles: truth.pose.angles.clone(),
    };
    let dressed = dress(
        template,
        sequence.rest(),
        &pose,
        &patterns,
        &DressOptions::default(),
    )
    .unwrap();
    let camera_from_world = world_from_camera.inverse();
    let meshes = &dressed.model.outfit.garments;
    let drawn: Vec<Vec<P3>> = (meshes.iter().zip(&dressed.state.garments))
        .map(|(mesh, state)| {
            let (mut world, mut camera) = (Vec::new(), Vec::new());
            mesh.render_positions(&state.positions, &mut world);
            camera_from_world.points_f32(&world, &mut camera);
            camera
        })
        .collect();
    let looks = [
        Look::default(),
        Look {
            base: [120, 40, 60],
            ..Look::default()
        },
    ];
    let garments: Vec<GarmentView<'_>> = (drawn.iter().zip(meshes).zip(&looks))
        .map(|((vertices, m), look)| GarmentView {
            vertices,
            faces: &m.render.faces,
            uv: &m.render.uv,
            normals: &[],
            look,
        })
        .collect();
    let model = Model::default();
    let limbs = Limbs::of(template);

    println!(
        "\n| picture | processor, one thread: p50 / p99 ms | card: p50 / p99 ms | pixels that differ by more than {DIFFERENT} |"
    );
    println!("|---|---|---|---|");
    for size in SIZES {
        let input = Input {
            frame: &frame,
            calibration: sequence.calibration(),
            garments: &garments,
            body: Some(BodyView {
                vertices: &truth.vertices,
                faces: template.mesh().faces(),
                limbs: &limbs,
            }),
            output: Some(size),
        };
        let (mut state, mut work) = (State::default(), Workspace::default());
        let (on_processor, a) = timed(rounds, || render(&model, &mut state, &input, &mut work));
        let (mut state, mut work) = (State::default(), Workspace::default());
        let (on_card, b) = timed(rounds, || {
            card.render(&model, &mut state, &input, &mut work)
        });
        println!(
            "| {}×{} | {a} | {b} | {} |",
            size[0],
            size[1],
            different(&on_processor, &on_card)
        );
        if let Some(dir) = &out {
            std::fs::create_dir_all(dir).unwrap();
            write_png_rgb(
                &dir.join(format!("{}_processor.png", size[0])),
                &on_processor,
            )
            .unwrap();
            write_png_rgb(&dir.join(format!("{}_card.png", size[0])), &on_card).unwrap();
        }
    }
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// The last picture, and times without the first three rounds.
fn timed(
    rounds: usize,
    mut draw: impl FnMut() -> Result<(ColorImage, RenderReport), RenderError>,
) -> (ColorImage, String) {
    let mut times = Vec::new();
    let mut last = None;
    for i in 0..rounds + 3 {
        let begun = Instant::now();
        let (image, report) = draw().expect("drawn");
        if i >= 3 {
            times.push(ms(begun));
        }
        last = Some((image, report));
    }
    times.sort_by(f64::total_cmp);
    let (image, report) = last.expect("at least one");
    let stages: Vec<String> = report
        .stages_ms
        .iter()
        .map(|(n, t)| format!("{n} {t:.2}"))
        .collect();
    (
        image,
        format!(
            "{:.2} / {:.2} ({})",
            times[times.len() / 2],
            times[times.len() * 99 / 100],
            stages.join(", ")
        ),
    )
}

fn different(a: &ColorImage, b: &ColorImage) -> String {
    let far = |a: &[u8], b: &[u8]| {
        a.iter()
            .zip(b)
            .any(|(a, b)| (i32::from(*a) - i32::from(*b)).abs() > DIFFERENT)
    };
    let n = a
        .data()
        .chunks(3)
        .zip(b.data().chunks(3))
        .filter(|(a, b)| far(a, b))
        .count();
    format!("{n} of {}", a.width() * a.height())
}
