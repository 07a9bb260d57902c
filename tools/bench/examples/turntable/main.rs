//! Dresses bodies and draws each outfit from several sides into one PNG.
//!
//! `cargo run --release -p tryon-bench --example turntable -- --garment tshirt --garment longsleeve+trousers --out DIR
//!   [--garment FILE.obj|.glb|.mhclo|.json [--garment-body FILE.npz|.obj]] [--body average,slim_woman,heavy_man | FILE.npz | RECORDING] [--size auto,S,M,XL] [--pose down|tpose|rest|walk|raise]
//!   [--seconds 1.0] [--views 0,45,90,180] [--cell 220x340] [--crop] [--edge 0.021] [--fit] [--any-size] [--no-folds]
//!   [--sharpest 0.6] [--crossings] [--tangled] [--measured]`
//!
//! Bodies are drawn as cloth meets them, their parts separated, with `--measured` as they are.
//! A row is a body, a block of columns a size. `auto` takes the suggested size. A recording (a folder or .mcap) shows
//! the person tracked in it, at its end; a still picture is tracked 45 times.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used)] // a development tool: stop at the first fault

mod args;
#[path = "../drawing/mod.rs"]
mod drawing;
mod fitting;
mod person;
mod wardrobe;

use args::Args;
use drawing::{DrawnMesh, Sheet, Turn, draw};
use fitting::{Fitting, height_range};
use tryon::geometry::math::P3;

/// Space around the body in a cell, and above and below a cropped garment, metres.
const BODY_MARGIN: f32 = 0.03;
const CROP_MARGIN: [f32; 2] = [0.08, 0.12];

fn main() {
    let a = args::args();
    std::fs::create_dir_all(&a.out).expect("a folder");
    for garment in &a.garments {
        let (views, rows) = (a.views.len() as u32, a.bodies.len() as u32);
        let mut sheet = Sheet::new(a.cell, views * a.sizes.len() as u32, rows);
        for (row, body) in (0..).zip(&a.bodies) {
            for (block, size) in (0..).zip(&a.sizes) {
                let (meshes, turn) = outfit(&a, garment, body, size);
                for (k, yaw) in (0..).zip(&a.views) {
                    let yaw = yaw.to_radians();
                    let picture = draw(&meshes, &Turn { yaw, ..turn });
                    sheet.put(block * views + k, row, &picture);
                }
            }
        }
        let stem = std::path::Path::new(garment).file_stem();
        let name = stem.and_then(|s| s.to_str()).unwrap_or("outfit");
        sheet.write(&a.out.join(format!("{name}.png")));
    }
}

/// Meshes of a dressed body, or of the bare one that nothing fits, and the space to show.
fn outfit(a: &Args, outfit: &str, body: &str, size: &str) -> (Vec<DrawnMesh>, Turn) {
    let person = person::load(body);
    let template = person.template.clone();
    let turn = |y: [f32; 2], centre: [f32; 2]| Turn {
        yaw: 0.0,
        cell: a.cell,
        y,
        centre,
    };
    let Some(mut fitting) = Fitting::dress(a, &person, outfit, body, size) else {
        let start = fitting::start_pose(a, &person);
        let vertices = person::posed(&template, &person.rest, &start);
        let y = height_range(&vertices);
        return (
            vec![DrawnMesh::body(&template, &vertices)],
            turn(y, [0.0; 2]),
        );
    };
    fitting.play(a, person);
    let garments = fitting.garments(a);
    let own: Vec<P3> = garments.iter().flat_map(|g| g.vertices.clone()).collect();
    let body = fitting.body();
    let [low, high] = height_range(if a.crop { &own } else { body });
    let y = if a.crop {
        [low - CROP_MARGIN[0], high + CROP_MARGIN[1]]
    } else {
        [low - BODY_MARGIN, high + BODY_MARGIN]
    };
    let sum = (body.iter()).fold([0.0; 2], |s, p| [s[0] + p.x, s[1] + p.z]);
    let centre = sum.map(|s| s / body.len() as f32);
    let mut meshes = vec![DrawnMesh::body(&template, &fitting.drawn_body(a))];
    meshes.extend(garments);
    (meshes, turn(y, centre))
}
