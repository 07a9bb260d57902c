//! Cost of a picture with and without hidden faces and the normals of unseen ones.
//!
//! `cargo run --release --example unseen -- [--input ../shared/data/rgbd/depthkit_still] [--rounds 60] [--threads 1]
//!   [--out DIR]`
//!
//! The person of a recording is tracked and dressed, then the same picture is drawn with every setting in turn, round
//! after round. "fine" divides each drawn triangle into four. Prints a Markdown row a scene: medians in milliseconds.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used)] // a development tool: stop at the first fault

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;
use tryon::body::{Pose, embedded};
use tryon::camera::RgbdFrame;
use tryon::cloth::realtime::{self, Config as ClothConfig};
use tryon::composite::{
    Appearance, BodyView, Config, GarmentView, Input, Limbs, Model, State, Workspace, render,
};
use tryon::dressing::{DressOptions, dress, suggest};
use tryon::formats::image::write_png_rgb;
use tryon::formats::open_recording;
use tryon::garment::library;
use tryon::math::{P3, World};
use tryon::mesh::Face;
use tryon::par::{Par, with_threads};
use tryon::tracking::{self, Status, TrackerConfig, TrackerModel, TrackerState};

/// Pictures of a still until the body is tracked and the cloth hangs.
const SETTLE: u64 = 60;
/// Between pictures, nanoseconds.
const INTERVAL_NS: u64 = 33_333_333;
/// Innermost first.
const OUTFITS: [&[&str]; 4] = [
    &["tshirt"],
    &["straight_skirt", "tshirt"],
    &["tank", "hoodie"],
    &["shorts", "dress"],
];
/// Hidden faces and unseen normals left out.
const SWITCHES: [(&str, bool, bool); 4] = [
    ("everything", false, false),
    ("no hidden faces", true, false),
    ("no unseen normals", false, true),
    ("neither", true, true),
];

struct Drawn {
    vertices: Vec<P3>,
    faces: Vec<Face>,
    uv: Vec<[f32; 2]>,
    appearance: Appearance,
}

impl Drawn {
    fn finer(&self) -> Self {
        let (mut vertices, mut uv, mut faces) =
            (self.vertices.clone(), self.uv.clone(), Vec::new());
        let mut middles = BTreeMap::new();
        for f in &self.faces {
            let m = [0, 1, 2].map(|k| {
                let (a, b) = (f[k].min(f[(k + 1) % 3]), f[k].max(f[(k + 1) % 3]));
                *middles.entry((a, b)).or_insert_with(|| {
                    let (a, b) = (a as usize, b as usize);
                    vertices.push(nalgebra::center(&vertices[a], &vertices[b]));
                    uv.push([0, 1].map(|c| 0.5 * (uv[a][c] + uv[b][c])));
                    vertices.len() as u32 - 1
                })
            });
            faces.extend([
                [f[0], m[0], m[2]],
                [m[0], f[1], m[1]],
                [m[2], m[1], f[2]],
                m,
            ]);
        }
        Self {
            vertices,
            faces,
            uv,
            appearance: self.appearance.clone(),
        }
    }
}

fn main() {
    let (mut input, mut rounds, mut threads, mut out) = (
        PathBuf::from("../shared/data/rgbd/depthkit_still"),
        60,
        1,
        None::<PathBuf>,
    );
    let mut args = std::env::args().skip(1);
    while let Some(word) = args.next() {
        let value = args.next().unwrap();
        match word.as_str() {
            "--input" => input = value.into(),
            "--rounds" => rounds = value.parse().unwrap(),
            "--threads" => threads = value.parse().unwrap(),
            "--out" => out = Some(value.into()),
            other => panic!("{other} is not understood"),
        }
    }
    let mut source = open_recording(&input).unwrap();
    let calibration = source.calibration().clone();
    let frame = source.next_frame().unwrap().unwrap();
    let template = embedded::template();
    let tracker = TrackerModel::new(
        template.clone(),
        calibration.clone(),
        TrackerConfig::default(),
    );
    let (mut tracked, mut work) = (TrackerState::new(&tracker), tracking::Workspace::default());
    for k in 0..SETTLE {
        let frame = RgbdFrame {
            time_ns: frame.time_ns + k * INTERVAL_NS,
            sequence: frame.sequence + k,
            ..frame.clone()
        };
        tracking::step(&tracker, &mut tracked, &frame, &mut work).unwrap();
    }
    assert_eq!(tracked.status, Status::Tracking);
    let body_camera = work.posed(&tracker, &tracked).0.to_vec();
    let mut body = Vec::new();
    tracked
        .world_from_camera
        .points_f32(&body_camera, &mut body);
    let rest = template.personalise(&tracked.shape);
    let measures = tryon::body::measure::measure(&template, &rest).unwrap();
    let pose: Pose<World> = Pose {
        root: tracked.world_from_camera * tracked.pose.root,
        angles: tracked.pose.angles.clone(),
    };
    let limbs = Limbs::of(&template);

    print!("| worn | vertices |");
    SWITCHES.iter().for_each(|s| print!(" {} |", s.0));
    println!(
        " drawing, normals (everything → neither) | faces hidden | no normals | garments hidden |"
    );
    println!("|---|---|{}---|---|---|---|", "---|".repeat(SWITCHES.len()));
    for names in OUTFITS {
        let patterns: Vec<_> = names
            .iter()
            .map(|n| {
                library::pattern(
                    n,
                    suggest(n, &measures).map_or(Default::default(), |s| s.size),
                )
                .unwrap()
            })
            .collect();
        let options = DressOptions {
            config: ClothConfig::tracked(),
            any_size: true,
            ..DressOptions::default()
        };
        let mut dressed = dress(&template, &rest, &pose, &patterns, &options).unwrap();
        let mut work = realtime::Workspace::default();
        for _ in 0..SETTLE {
            let input = realtime::Input {
                body: &body,
                dt: 1.0 / 30.0,
            };
            realtime::step(&dressed.model, &mut dressed.state, &input, &mut work).unwrap();
        }
        let camera_from_world = tracked.world_from_camera.inverse();
        let coarse: Vec<Drawn> = (dressed
            .model
            .outfit
            .garments
            .iter()
            .zip(&dressed.state.garments))
        .map(|(mesh, state)| {
            let (mut world, mut vertices) = (Vec::new(), Vec::new());
            mesh.render_positions(&state.positions, &mut world);
            camera_from_world.points_f32(&world, &mut vertices);
            let appearance = Appearance {
                base: library::dye(&mesh.name),
                ..Appearance::default()
            };
            Drawn {
                vertices,
                faces: mesh.render.faces.clone(),
                uv: mesh.render.uv.clone(),
                appearance,
            }
        })
        .collect();
        let fine: Vec<Drawn> = coarse.iter().map(Drawn::finer).collect();
        for (name, drawn) in [("", &coarse), (", fine", &fine)] {
            let garments: Vec<GarmentView<'_>> = drawn
                .iter()
                .map(|d| GarmentView {
                    vertices: &d.vertices,
                    faces: &d.faces,
                    uv: &d.uv,
                    normals: &[],
                    appearance: &d.appearance,
                })
                .collect();
            let input = Input {
                frame: &frame,
                calibration: &calibration,
                garments: &garments,
                body: Some(BodyView {
                    vertices: &body_camera,
                    faces: template.mesh().faces(),
                    limbs: &limbs,
                }),
                output: None,
            };
            let par = if threads == 1 { Par::Seq } else { Par::Rayon };
            let models = SWITCHES.map(|(_, skip_hidden, skip_unseen)| {
                Model::new(Config {
                    par,
                    skip_hidden,
                    skip_unseen,
                    ..Config::default()
                })
            });
            let mut works = SWITCHES.map(|_| (State::default(), Workspace::default()));
            let mut times: [[Vec<f64>; 3]; 4] = Default::default();
            let mut last = Vec::new();
            with_threads(threads, || {
                for round in 0..rounds + 3 {
                    last.clear();
                    for ((model, (state, work)), times) in
                        models.iter().zip(&mut works).zip(&mut times)
                    {
                        let begun = Instant::now();
                        let (image, report) = render(model, state, &input, work).unwrap();
                        let all = begun.elapsed().as_secs_f64() * 1e3;
                        if round >= 3 {
                            let stage = |name| {
                                report
                                    .stages_ms
                                    .iter()
                                    .find(|s| s.0 == name)
                                    .map_or(0.0, |s| f64::from(s.1))
                            };
                            for (list, ms) in
                                times
                                    .iter_mut()
                                    .zip([all, stage("garments"), stage("normals")])
                            {
                                list.push(ms);
                            }
                        }
                        last.push((image, report));
                    }
                }
            })
            .unwrap();
            let medians = times.map(|lists| {
                lists.map(|mut l| {
                    l.sort_by(f64::total_cmp);
                    l[l.len() / 2]
                })
            });
            assert!(
                last.iter().all(|(image, _)| *image == last[0].0),
                "pictures differ"
            );
            let (vertices, faces) = drawn.iter().fold((0, 0), |(v, f), d| {
                (v + d.vertices.len(), f + d.faces.len())
            });
            print!("| {}{name} | {vertices} |", names.join(" under "));
            medians.iter().for_each(|m| print!(" {:.2} |", m[0]));
            let (image, r) = &last[3];
            println!(
                " {:.2}, {:.2} → {:.2}, {:.2} | {} of {faces} | {} | {} |",
                medians[0][1],
                medians[0][2],
                medians[3][1],
                medians[3][2],
                r.faces_hidden,
                r.normals_skipped,
                r.garments_hidden
            );
            if let Some(dir) = &out {
                std::fs::create_dir_all(dir).unwrap();
                write_png_rgb(&dir.join(format!("{}{name}.png", names.join("_"))), image).unwrap();
            }
        }
    }
}
