//! The compositor on the graphics card against the processor: the same pictures, timed side by side.
//!
//! `cargo run --release -p tryon-bench --features gpu --example card -- [--software] [--rounds N] [--out DIR]`
//!
//! A synthetic user in T-shirt and skirt at three sizes. Prints a Markdown row a size: medians and 99th percentiles in
//! milliseconds, those of smooth sheets in place of cloth on the processor too, and the number of pixels that differ.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used)] // a development tool: stop at the first fault

use clap::Parser;
use std::path::PathBuf;
use std::time::Instant;
use tryon::body::Pose;
use tryon::dressing::{DressOptions, Dressed, dress};
use tryon::formats::image::write_png_rgb;
use tryon::garment::{Size, library};
use tryon::geometry::camera::ColorImage;
use tryon::geometry::math::order_statistics::percentile;
use tryon::geometry::math::{P3, World};
use tryon::mirror::{CameraGarments, DrawnLook, DrawnSurface, library_appearance};
use tryon::synth::{Actor, Sequence, Setting};
use tryon::view::gpu::Renderer;
use tryon::view::{
    BodyView, Framing, GarmentView, Input, Limbs, Model, OutputFrame, RenderError, RenderReport,
    State, Workspace, render,
};

const SIZES: [[u32; 2]; 3] = [[640, 480], [1280, 720], [1920, 1080]];
/// Grey levels beyond which a pixel counts as different.
const DIFFERENT: u8 = 3;
/// Frame of the synthetic sequence.
const FRAME: u64 = 60;
/// Rounds before the timed ones.
const WARM_UP: usize = 3;

#[derive(Parser)]
struct Args {
    /// A software adapter.
    #[arg(long)]
    software: bool,
    /// Timed pictures of each size.
    #[arg(long, default_value_t = 60)]
    rounds: usize,
    /// Folder for the pictures.
    #[arg(long)]
    out: Option<PathBuf>,
}

fn main() {
    let args = Args::parse();
    let begun = Instant::now();
    let mut card = Renderer::new(args.software).expect("an adapter");
    println!("{:?}, ready after {:.0} ms", card.adapter(), ms(begun));

    let sequence = Sequence::new(Actor::default(), Setting::default());
    let (frame, truth) = sequence.frame(FRAME);
    let world_from_camera = sequence.setting().world_from_camera;
    let pose = truth.pose.transformed(&world_from_camera);
    let dressed = dressed(&sequence, &pose);
    let meshes = &dressed.model.outfit.garments;
    let world: Vec<Vec<P3>> = (meshes.iter().zip(&dressed.state.garments))
        .map(|(mesh, state)| {
            let mut world = Vec::new();
            mesh.render_positions(&state.positions, &mut world);
            world
        })
        .collect();
    let mut camera = CameraGarments::default();
    camera.place(
        &world_from_camera.inverse(),
        world.iter().map(Vec::as_slice),
    );
    let looks: Vec<DrawnLook> = meshes
        .iter()
        .map(|mesh| {
            let appearance = library_appearance(&mesh.name);
            DrawnLook::of(&mesh.render, &mesh.material.name, appearance)
        })
        .collect();
    let surfaces = (meshes.iter().zip(&looks)).map(|(mesh, look)| DrawnSurface {
        faces: &mesh.render.faces,
        uv: &look.uv,
        vertex: &mesh.render.vertex,
        places: &look.places,
        appearance: &look.appearance,
    });
    let garments = camera.views(surfaces);
    let sheets = ["tshirt", "skirt"].map(library_appearance);
    let flat: Vec<GarmentView<'_>> = (garments.iter().zip(&sheets))
        .map(|(garment, appearance)| GarmentView {
            places: &[],
            appearance,
            ..*garment
        })
        .collect();
    let template = &sequence.actor().template;
    let input = Input {
        frame: &frame,
        calibration: sequence.calibration(),
        garments: &garments,
        body: Some(BodyView {
            vertices: &truth.vertices,
            faces: template.mesh().faces(),
            limbs: &Limbs::of(template),
        }),
        output: None,
    };
    println!(
        "\n| picture | processor: p50 / p99 ms | smooth sheets: p50 / p99 ms | card: p50 / p99 ms | pixels that differ by more than {DIFFERENT} |"
    );
    println!("|---|---|---|---|---|");
    for size in SIZES {
        let input = Input {
            output: Some(OutputFrame {
                size,
                framing: Framing::Cover,
            }),
            ..input
        };
        let flat = Input {
            garments: &flat,
            ..input
        };
        compare(&args, &mut card, &input, &flat);
    }
}

fn dressed(sequence: &Sequence, pose: &Pose<World>) -> Dressed {
    let patterns = ["tshirt", "skirt"].map(|name| library::pattern(name, Size::default()).unwrap());
    dress(
        &sequence.actor().template,
        sequence.rest(),
        pose,
        &patterns,
        &DressOptions::default(),
    )
    .unwrap()
}

/// Prints the row of one size and writes its two pictures.
fn compare(args: &Args, card: &mut Renderer, input: &Input<'_>, flat: &Input<'_>) {
    let model = Model::default();
    let (mut state, mut work) = (State::default(), Workspace::default());
    let (on_processor, a) = timed(args.rounds, || render(&model, &mut state, input, &mut work));
    let (mut state, mut work) = (State::default(), Workspace::default());
    let (_, smooth) = timed(args.rounds, || render(&model, &mut state, flat, &mut work));
    let (mut state, mut work) = (State::default(), Workspace::default());
    let (on_card, b) = timed(args.rounds, || {
        card.render(&model, &mut state, input, &mut work)
    });
    let (width, height) = (on_card.width(), on_card.height());
    let count = different(&on_processor, &on_card);
    println!(
        "| {width}×{height} | {a} | {smooth} | {b} | {count} of {} |",
        width * height
    );
    if let Some(dir) = &args.out {
        std::fs::create_dir_all(dir).unwrap();
        for (name, image) in [("processor", &on_processor), ("card", &on_card)] {
            write_png_rgb(&dir.join(format!("{width}_{name}.png")), image).unwrap();
        }
    }
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// The last picture, and median and 99th percentile of the times.
fn timed(
    rounds: usize,
    mut draw: impl FnMut() -> Result<(ColorImage, RenderReport), RenderError>,
) -> (ColorImage, String) {
    let mut times = Vec::new();
    let mut last = None;
    for i in 0..rounds + WARM_UP {
        let begun = Instant::now();
        let drawn = draw().expect("drawn");
        if i >= WARM_UP {
            times.push(ms(begun));
        }
        last = Some(drawn);
    }
    let [middle, most] = [50, 99].map(|p| percentile(&mut times, p).unwrap_or(0.0));
    let (image, report) = last.expect("at least one");
    let stages: Vec<String> = report
        .stages_ms
        .iter()
        .map(|(n, t)| format!("{n} {t:.2}"))
        .collect();
    (
        image,
        format!("{middle:.2} / {most:.2} ({})", stages.join(", ")),
    )
}

/// Number of pixels that differ in some channel.
fn different(a: &ColorImage, b: &ColorImage) -> usize {
    let pixels = a.data().chunks(3).zip(b.data().chunks(3));
    pixels
        .filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > DIFFERENT))
        .count()
}
