//! Dresses a dancing body, measures, and draws a film strip.
//!
//! `cargo run --release -p tryon-bench --example dance -- [--data ../shared/data/garments/cipc_apache2] [--garment tshirt+skirt]
//!   [--edge 0.0118] [--seconds 4.8] [--threads 2] [--most-steps 72] [--patch 6000] [--sharpest 0.6] [--no-layers] [--no-folds]
//!   [--deepest 12] [--out strip.png] [--from 0] [--every 0.4]`
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used)] // a development tool: stop at the first fault

mod drawing;

use drawing::{DrawnMesh, Sheet, Turn, draw};
use std::path::PathBuf;
use tryon::body::Template;
use tryon::cloth::Config;
use tryon::cloth::contact::MapDetail;
use tryon::dressing::Dressed;
use tryon::geometry::math::P3;
use tryon::geometry::math::order_statistics::percentile;
use tryon::geometry::par::with_threads;
use tryon_bench::dance::{DanceReport, load};
use tryon_bench::{OutfitSpec, Solid};

/// One cell of the strip, pixels.
const CELL: (u32, u32) = (270, 460);
/// Steps between two lists of sunken vertices, as in the report.
const LIST_EVERY: usize = 4;
/// Vertices less deep in the body than this are not listed, metres.
const SUNKEN: f32 = 1e-3;

/// Lists vertices in the body: depth, place and time.
fn find_sunken(
    template: &Template,
    time: f64,
    body: &[P3],
    dressed: &Dressed,
    out: &mut Vec<(f32, String)>,
) {
    let solid = Solid::new(body, template.mesh().faces());
    let outfit = &dressed.model.outfit;
    for (g, s) in outfit.garments.iter().zip(&dressed.state.garments) {
        for (i, p) in s.positions.iter().enumerate() {
            let depth = solid.depth(p);
            if depth < SUNKEN {
                continue;
            }
            let far = |v: &usize| (body[*v] - p).norm_squared();
            let near = (0..body.len())
                .min_by(|a, b| far(a).total_cmp(&far(b)))
                .unwrap_or(0);
            let joint = &template.skeleton().joints()[template.weights().dominant(near)].name;
            let panels: Vec<&str> = g.corners[i]
                .iter()
                .map(|c| g.panels[usize::from(c.0)].as_str())
                .collect();
            out.push((
                depth,
                format!(
                    "at {time:.3} s, {} vertex {i} ({}, regions {:08b}) under body vertex {near} ({joint}), {} limbs deep, \
                     {:.3?}",
                    g.name,
                    panels.join("+"),
                    g.regions[i].0,
                    solid.winding(p),
                    p.coords.as_slice()
                ),
            ));
        }
    }
}

struct Args {
    data: PathBuf,
    outfit: OutfitSpec,
    seconds: f64,
    threads: usize,
    /// Number of sunken vertices to list.
    deepest: usize,
    out: Option<PathBuf>,
    /// First time on the strip and interval, seconds.
    from: f64,
    every: f64,
}

fn args() -> Args {
    let mut a = Args {
        data: PathBuf::from("../shared/data/garments/cipc_apache2"),
        outfit: OutfitSpec {
            garments: vec!["tshirt".into(), "skirt".into()],
            edge: 0.0118,
            config: Config::default(),
        },
        seconds: 4.8,
        threads: 2,
        deepest: 0,
        out: None,
        from: 0.0,
        every: 0.4,
    };
    let mut it = std::env::args().skip(1);
    while let Some(flag) = it.next() {
        let mut value = || it.next().expect("a value");
        match flag.as_str() {
            "--data" => a.data = value().into(),
            "--garment" => a.outfit.garments = value().split('+').map(str::to_owned).collect(),
            "--edge" => a.outfit.edge = value().parse().expect("metres"),
            "--seconds" => a.seconds = value().parse().expect("seconds"),
            "--threads" => a.threads = value().parse().expect("a number"),
            "--sharpest" => a.outfit.config.min_fold_ratio = value().parse().expect("a share"),
            "--most-steps" => a.outfit.config.most_steps = value().parse().expect("a number"),
            "--patch" => a.outfit.config.patch = value().parse().expect("a number"),
            "--maps" => {
                a.outfit.config.map_detail = match value().as_str() {
                    "view" => MapDetail::InView,
                    "fine" => MapDetail::Everywhere,
                    "coarse" => MapDetail::Nowhere,
                    other => panic!("--maps {other}: view, fine or coarse"),
                }
            }
            "--no-layers" => a.outfit.config.layers = false,
            "--no-folds" => a.outfit.config.self_collision = false,
            "--deepest" => a.deepest = value().parse().expect("a number"),
            "--out" => a.out = Some(value().into()),
            "--from" => a.from = value().parse().expect("seconds"),
            "--every" => a.every = value().parse().expect("seconds"),
            other => panic!("{other} is not known"),
        }
    }
    a
}

fn main() {
    let a = args();
    let dance = load(&a.data).expect("the dance");
    println!(
        "{} vertices, {:.1} s, fitted template {:.1} mm off",
        dance.rest.vertices.len(),
        dance.bodies.seconds(),
        dance.fit * 1e3
    );
    let mut cells: Vec<[Vec<u8>; 2]> = Vec::new();
    let mut next = a.from;
    let (mut steps, mut sunken) = (0, Vec::new());
    let report = with_threads(a.threads, || {
        dance.run(&a.outfit, a.seconds, |time, body, dressed| {
            steps += 1;
            if a.deepest > 0 && steps % LIST_EVERY == 0 {
                find_sunken(&dance.template, time, body, dressed, &mut sunken);
            }
            if a.out.is_some() && time + 1e-6 >= next {
                next += a.every;
                cells.push(draw_cells(&dance.template, body, dressed));
            }
        })
    });
    print_report(&report.expect("threads").expect("a dance"));
    sunken.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (depth, place) in sunken.iter().take(a.deepest) {
        println!("{:6.2} mm {place}", depth * 1e3);
    }
    let Some(out) = a.out else { return };
    let mut sheet = Sheet::new(CELL, cells.len() as u32, 2);
    for (column, pair) in (0..).zip(&cells) {
        (0..)
            .zip(pair)
            .for_each(|(row, cell)| sheet.put(column, row, cell));
    }
    sheet.write(&out);
}

/// The dressed body from two sides.
fn draw_cells(template: &Template, body: &[P3], dressed: &Dressed) -> [Vec<u8>; 2] {
    let mut meshes = vec![DrawnMesh::body(template, body)];
    let garments = dressed.model.outfit.garments.iter();
    meshes.extend(
        garments
            .zip(&dressed.state.garments)
            .map(|(g, s)| DrawnMesh::garment(g, &s.positions, &g.name)),
    );
    let turn = Turn {
        yaw: 0.0,
        cell: CELL,
        y: [0.25, 1.4],
        centre: [0.0; 2],
    };
    [0.4, 2.8].map(|yaw| draw(&meshes, &Turn { yaw, ..turn }))
}

fn print_report(report: &DanceReport) {
    println!(
        "{} vertices, dressed in {:.0} ms; {:.1} ms for 1/60 s (median; p90 {:.1}; maps {:.1}, contact {:.1}, steps {:.1}), \
         stiffness kept {:.2}, faults {}\n\
         p99 strain {:.2} %; penetration p99 {:.2} mm, max {:.2} mm (outside limbs that lie in each other {:.2}, {:.2})",
        report.vertices,
        report.dressing_ms,
        report.median_ms(),
        percentile(&mut report.ms.clone(), 90).unwrap_or(0.0),
        report.stages_ms[0],
        report.stages_ms[1],
        report.stages_ms[2],
        report.softened,
        report.faults,
        report.p99_strain * 100.0,
        report.penetration[0] * 1e3,
        report.penetration[1] * 1e3,
        report.penetration_single[0] * 1e3,
        report.penetration_single[1] * 1e3,
    );
}
