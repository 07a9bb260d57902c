//! Dresses bodies and draws each outfit from several sides into one PNG, for looking at garments.
//!
//! `cargo run --release --example turntable -- --garment tshirt --garment longsleeve+trousers --out DIR
//!   [--garment FILE.obj|.glb|.mhclo|.json [--garment-body FILE.npz|.obj]] [--body average,slim_woman,heavy_man | FILE.npz | RECORDING] [--size auto,S,M,XL] [--pose down|tpose|rest|walk|raise]
//!   [--seconds 1.0] [--views 0,45,90,180] [--cell 220x340] [--crop] [--edge 0.021] [--fit] [--any-size] [--no-folds]
//!   [--sharpest 0.6] [--crossings] [--tangled] [--measured]`
//!
//! Bodies are drawn as cloth meets them, with room in the armpits, with `--measured` as they are.
//! A row is a body, a block of columns a size. `auto` asks the size suggestion. A recording (a folder or .mcap) shows the
//! person tracked in it, at its end; a still picture is tracked 45 times.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used)] // a development tool: stop at the first fault

mod drawing;

use drawing::{Part, draw};
use std::path::PathBuf;
use std::sync::Arc;
use tryon::body::{BodyShape, BoneTransforms, Pose, RestBody, Template, skin};
use tryon::camera::ColorImage;
use tryon::cloth::crossings;
use tryon::cloth::realtime::{Config, Input, RoomyBody, State, Workspace, step};
use tryon::dressing::{
    DressError, DressOptions, Dressed, FitProbe, MadeOn, MeshWear, Wear, dress_all, suggest,
};
use tryon::evaluate::cloth_rest::lower_arms;
use tryon::formats::image::write_png_rgb;
use tryon::garment::{Pattern, library};
use tryon::math::{Body, P3, Rigid, World};
use tryon::tracking::{self, TrackerConfig, TrackerModel, TrackerState};

struct Args {
    garments: Vec<String>,
    garment_body: Option<MadeOn>,
    bodies: Vec<String>,
    sizes: Vec<String>,
    pose: String,
    seconds: f64,
    views: Vec<f32>,
    cell: (u32, u32),
    crop: bool,
    edge: Option<f64>,
    fit: bool,
    any_size: bool,
    crossings: bool,
    folds: bool,
    untangle: bool,
    sharpest: f64,
    measured: bool,
    out: PathBuf,
}

fn args() -> Args {
    let mut a = Args {
        garments: vec![],
        garment_body: None,
        bodies: ["slim_woman", "average", "heavy_man"]
            .map(String::from)
            .to_vec(),
        sizes: vec!["auto".into()],
        pose: "down".into(),
        seconds: 1.0,
        views: vec![0.0, 45.0, 90.0, 180.0],
        cell: (220, 340),
        crop: false,
        edge: None,
        fit: false,
        any_size: false,
        crossings: false,
        folds: true,
        untangle: true,
        sharpest: Config::default().sharpest,
        measured: false,
        out: "/tmp/turntable".into(),
    };
    let list = |s: String| s.split(',').map(str::to_owned).collect::<Vec<_>>();
    let mut it = std::env::args().skip(1);
    while let Some(flag) = it.next() {
        let mut value = || it.next().expect("a value");
        match flag.as_str() {
            "--garment" => a.garments.push(value()),
            "--garment-body" => {
                let body = MadeOn::read(std::path::Path::new(&value())).expect("a body");
                println!("{}", body.said);
                a.garment_body = Some(body);
            }
            "--body" => a.bodies = list(value()),
            "--size" => a.sizes = list(value()),
            "--pose" => a.pose = value(),
            "--seconds" => a.seconds = value().parse().expect("seconds"),
            "--views" => {
                a.views = list(value())
                    .iter()
                    .map(|v| v.parse().expect("degrees"))
                    .collect()
            }
            "--cell" => {
                let v = value();
                let (w, h) = v.split_once('x').expect("WxH");
                a.cell = (w.parse().expect("width"), h.parse().expect("height"));
            }
            "--crop" => a.crop = true,
            "--crossings" => a.crossings = true,
            "--no-folds" => a.folds = false,
            "--measured" => a.measured = true,
            "--sharpest" => a.sharpest = value().parse().expect("a share"),
            "--tangled" => a.untangle = false,
            "--any-size" => a.any_size = true,
            "--fit" => a.fit = true,
            "--edge" => a.edge = Some(value().parse().expect("metres")),
            "--out" => a.out = value().into(),
            other => panic!("{other} is not known"),
        }
    }
    if a.garments.is_empty() {
        a.garments = library::names().iter().map(|n| (*n).to_owned()).collect();
    }
    a
}

/// Stature, girth, sex, limb length, torso length, shoulders, chest, waist, hip in standard deviations.
fn shape(name: &str) -> Option<Vec<f64>> {
    Some(match name {
        "average" => vec![],
        "slim_woman" => vec![-0.4, -1.0, -1.2, 0.2, 0.0, -0.2, 0.0, -0.3, 0.1],
        "curvy_woman" => vec![-0.6, 1.0, -1.3, -0.2, 0.0, 0.0, 0.8, 0.2, 1.0],
        "heavy_man" => vec![0.3, 2.0, 1.2, -0.2, 0.2, 0.3, 0.0, 0.6, 0.0],
        "tall_man" => vec![1.8, -0.4, 1.0, 0.5, 0.0, 0.3, 0.0, 0.0, 0.0],
        _ => return None,
    })
}

struct Person {
    template: Arc<Template>,
    rest: RestBody,
    /// Of a recording: the pose in which garments are put on, and the body in each picture after it.
    film: Option<(Pose<World>, Vec<Vec<P3>>)>,
}

fn load(name: &str) -> Person {
    let path = std::path::Path::new(name);
    if let Some(coefficients) = shape(name) {
        let template = tryon::body::embedded::template();
        let rest = template.personalise(&BodyShape {
            coefficients,
            ..BodyShape::default()
        });
        return Person {
            template,
            rest,
            film: None,
        };
    }
    if path.is_dir() || name.ends_with(".mcap") {
        return tracked(path);
    }
    let arrays = tryon::formats::npz::read_smpl(path).expect("a body");
    let template =
        Arc::new(tryon::body::import::template_from_smpl("file", &arrays).expect("a body"));
    let rest = template.personalise(&BodyShape::default());
    Person {
        template,
        rest,
        film: None,
    }
}

/// The person in a recording, from the first picture in which they are tracked.
fn tracked(path: &std::path::Path) -> Person {
    const STILL: u64 = 45;
    let mut source = tryon::formats::open_recording(path).expect("a recording");
    let template = tryon::body::embedded::template();
    let model = TrackerModel::new(
        template.clone(),
        source.calibration().clone(),
        TrackerConfig::default(),
    );
    let (mut state, mut work) = (TrackerState::new(&model), tracking::Workspace::default());
    let (mut film, mut begun) = (Vec::new(), None);
    let mut see = |frame: &tryon::camera::RgbdFrame| {
        tracking::step(&model, &mut state, frame, &mut work).expect("a step");
        if state.status != tracking::Status::Tracking {
            return;
        }
        let mut body = Vec::new();
        state
            .world_from_camera
            .points_f32(work.posed(&model, &state).0, &mut body);
        film.push(body);
        begun.get_or_insert_with(|| {
            let pose = Pose {
                root: state.world_from_camera * state.pose.root,
                angles: state.pose.angles.clone(),
            };
            (template.personalise(&state.shape), pose)
        });
    };
    let still = source.len() == Some(1);
    while let Some(mut frame) = source.next_frame().expect("a picture") {
        for _ in 0..if still { STILL } else { 1 } {
            see(&frame);
            frame.time_ns += 33_333_333;
        }
    }
    let (rest, pose) = begun.expect("nobody is tracked");
    Person {
        template,
        rest,
        film: Some((pose, film)),
    }
}

/// Named poses; `t` in seconds moves those that move.
fn pose(name: &str, template: &Template, rest: &RestBody, t: f64) -> Pose<World> {
    let sk = template.skeleton();
    let mut p = Pose::rest(sk, Rigid::<World, Body>::identity());
    let swing = 0.5 * (t * 6.0).sin();
    let down = match name {
        "tpose" => 0.0,
        "raise" => 1.3 - 2.2 * (0.5 - 0.5 * (t * 2.0).cos()),
        _ => 1.3,
    };
    if name != "rest" {
        lower_arms(template, rest, down, &mut p);
    }
    if name == "walk" {
        for (side, a) in [("left", swing), ("right", -swing)] {
            p.set(sk, &format!("{side}_hip"), &[-a - 0.1, 0.0, 0.0]);
            p.set(
                sk,
                &format!("{side}_knee"),
                &[0.3 - 0.3 * a.signum() * a.abs(), 0.0, 0.0],
            );
        }
    }
    p
}

fn posed(template: &Template, rest: &RestBody, pose: &Pose<World>) -> Vec<P3> {
    let mut bones = BoneTransforms::default();
    pose.bones(template.skeleton(), rest, &mut bones);
    let mut out = Vec::new();
    skin(
        tryon::par::Par::Seq,
        &rest.vertices,
        template.weights(),
        &bones,
        &mut out,
    );
    out
}

/// A pattern file: GarmentCode's or our own.
fn imported(file: &str) -> Pattern {
    let path = std::path::Path::new(file);
    let text = std::fs::read_to_string(path).expect("readable");
    if !tryon::formats::garmentcode::is_garmentcode(&text) {
        return Pattern::from_json(&text).expect("a pattern");
    }
    let raw = tryon::formats::garmentcode::parse_garmentcode(&text, path).expect("a pattern");
    let material = tryon::garment::Material::preset("cotton").expect("preset");
    let name = path
        .file_stem()
        .and_then(|s| s.to_str())
        .unwrap_or("garment");
    tryon::garment::import::from_garmentcode(&raw, name, tryon::garment::Size::M, material)
        .expect("a pattern")
}

fn outfit(a: &Args, outfit: &str, body: &str, size: &str) -> (Vec<Part>, [f32; 2], [f32; 2]) {
    let Person {
        template,
        rest,
        film,
    } = load(body);
    let measures = tryon::body::measure::measure(&template, &rest).expect("measurable");
    enum Worn {
        Pattern(Pattern),
        Mesh(MeshWear),
    }
    let edge = a
        .edge
        .unwrap_or(tryon::garment::Triangulation::default().edge_length);
    let worn: Vec<Worn> = outfit
        .split('+')
        .map(|g| {
            if g.ends_with(".json") {
                return Worn::Pattern(imported(g));
            }
            if [".obj", ".glb", ".gltf", ".mhclo"]
                .iter()
                .any(|e| g.ends_with(e))
            {
                let fabric = tryon::garment::Material::preset("cotton").expect("preset");
                let m = MeshWear::on(
                    std::path::Path::new(g),
                    a.garment_body.clone(),
                    &fabric,
                    edge,
                )
                .expect("a garment");
                m.notes.iter().for_each(|n| println!("  {n}"));
                return Worn::Mesh(m);
            }
            let chosen = match size {
                "auto" => {
                    let s = suggest(g, &measures).expect("a size");
                    println!("{body}: {g}: {}", s.reason);
                    s.size
                }
                s => s.parse().expect("a size"),
            };
            Worn::Pattern(library::pattern(g, chosen).expect("a pattern"))
        })
        .collect();
    let wear: Vec<Wear<'_>> = worn
        .iter()
        .map(|w| match w {
            Worn::Pattern(p) => Wear::Pattern(p),
            Worn::Mesh(m) => Wear::Mesh(m),
        })
        .collect();
    let mut options = DressOptions {
        any_size: a.any_size,
        untangle: a.untangle,
        ..DressOptions::default()
    };
    if let Some(e) = a.edge {
        options.triangulation.edge_length = e;
    }
    let start = film.as_ref().map_or_else(
        || pose(&a.pose, &template, &rest, 0.0),
        |(pose, _)| pose.clone(),
    );
    let config = if film.is_some() {
        Config::tracked()
    } else {
        Config::default()
    };
    options.config = Config {
        self_collision: a.folds,
        sharpest: a.sharpest,
        ..config
    };
    let dressed = match dress_all(&template, &rest, &start, &wear, &options) {
        Ok(d) => Some(d),
        Err(DressError::Misfit(m)) => {
            println!("{body} {outfit} {size}: {m}");
            None
        }
        Err(e) => panic!("{e}"),
    };
    let Some(Dressed {
        model,
        mut state,
        report,
    }) = dressed
    else {
        let vertices = posed(&template, &rest, &start);
        let y = vertices
            .iter()
            .fold([f32::MAX, f32::MIN], |y, p| [y[0].min(p.y), y[1].max(p.y)]);
        let faces = template.mesh().faces().to_vec();
        let bare = Part {
            vertices,
            faces,
            color: [0.86, 0.70, 0.60],
            uv: vec![],
            painted: vec![],
        };
        return (vec![bare], y, [0.0; 2]);
    };
    let vertices: Vec<usize> = state.garments.iter().map(|g| g.positions.len()).collect();
    println!(
        "{body} {outfit} {size}: {vertices:?} vertices, dressed in {:.0} ms, {} steps, penetration {:.1} mm, p99 stretch {:.3}; {:.0?}",
        report.ms,
        report.steps,
        report.penetration * 1e3,
        report.p99_strain,
        report.stages_ms
    );
    let crossed = |state: &State| -> Vec<usize> {
        model
            .outfit
            .garments
            .iter()
            .zip(&state.garments)
            .map(|(g, s)| crossings(&g.faces, &s.positions).len())
            .collect()
    };
    println!("  edges through its own triangles: {:?}", crossed(&state));
    let mut work = Workspace::default();
    let film = film.map_or_else(
        || {
            let at = |i| {
                posed(
                    &template,
                    &rest,
                    &pose(&a.pose, &template, &rest, f64::from(i + 1) / 30.0),
                )
            };
            (0..(a.seconds * 30.0) as i32).map(at).collect()
        },
        |(_, film)| film,
    );
    let frames = film.len();
    let (mut ms, mut last, mut rested) = (0.0, None, None);
    let mut all_crossed = vec![0; state.garments.len()];
    let (mut roomy, mut room_ms) = (
        RoomyBody::new(&template, &options.config).expect("a body"),
        0.0,
    );
    let mut verts = posed(&template, &rest, &start);
    for (call, body) in film.into_iter().enumerate() {
        verts = body;
        let r = step(
            &model,
            &mut state,
            &Input {
                body: &verts,
                dt: 1.0 / 30.0,
            },
            &mut work,
        )
        .expect("step");
        ms += r.stages_ms.total;
        rested = if r.sleeping < vertices.iter().sum() {
            None
        } else {
            rested.or(Some(call + 1))
        };
        all_crossed
            .iter_mut()
            .zip(crossed(&state))
            .for_each(|(all, now)| *all += now);
        let started = std::time::Instant::now();
        roomy.make_room(tryon::par::Par::Rayon, &verts);
        room_ms += if last.is_some() {
            started.elapsed().as_secs_f64() * 1e3
        } else {
            0.0
        };
        last = Some(r);
    }
    if let Some(r) = last {
        println!(
            "  {:.2} ms a step, {:.2} ms room for drawing, penetration left {:.2} mm, p99 {:.3} max {:.3}",
            ms / frames as f64,
            room_ms / frames as f64,
            r.penetration_left * 1e3,
            r.p99_strain,
            r.max_strain
        );
        match rested {
            Some(call) => println!("  at rest after {call} of {frames} calls"),
            None => println!("  {} vertices asleep at the end", r.sleeping),
        }
        let mean: Vec<usize> = all_crossed.iter().map(|n| n / frames).collect();
        println!(
            "  edges through its own triangles: {:?}, over all pictures {mean:?}",
            crossed(&state)
        );
    }
    let centre = {
        let n = verts.len() as f32;
        let s = verts
            .iter()
            .fold([0.0, 0.0], |s, p| [s[0] + p.x / n, s[1] + p.z / n]);
        [s[0], s[1]]
    };
    let mut y = verts
        .iter()
        .fold([f32::MAX, f32::MIN], |y, p| [y[0].min(p.y), y[1].max(p.y)]);
    let drawn = if a.measured {
        &verts
    } else {
        roomy.make_room(tryon::par::Par::Rayon, &verts)
    };
    let mut parts = vec![Part {
        vertices: drawn.to_vec(),
        faces: template.mesh().faces().to_vec(),
        color: [0.86, 0.70, 0.60],
        uv: vec![],
        painted: vec![],
    }];
    let fits = a.fit.then(|| {
        let mut probe = FitProbe::new(&template, &model).expect("a probe");
        let started = std::time::Instant::now();
        probe.measure(&model, &state, &verts).expect("fit");
        let first = started.elapsed().as_secs_f64() * 1e3;
        let started = std::time::Instant::now();
        let maps = probe.measure(&model, &state, &verts).expect("fit");
        println!("  fit map: first {first:.1} ms, then {:.1} ms", started.elapsed().as_secs_f64() * 1e3);
        for r in maps.iter().flat_map(|m| &m.regions) {
            println!(
                "  {:16} {:?}: stretch {:+.1} % (p95 {:+.1}), {:.0} Pa over {:.0} %, {:.0} mm off the skin",
                r.name,
                r.fit,
                r.stretch[0] * 100.0,
                r.stretch[1] * 100.0,
                r.pressure[0],
                r.touching * 100.0,
                r.gap * 1e3
            );
        }
        maps
    });
    let mut own = [f32::MAX, f32::MIN];
    for (k, (g, s)) in model
        .outfit
        .garments
        .iter()
        .zip(&state.garments)
        .enumerate()
    {
        let mut world = Vec::new();
        g.render_positions(&s.positions, &mut world);
        own = world
            .iter()
            .fold(own, |y, p| [y[0].min(p.y), y[1].max(p.y)]);
        let mut painted = Vec::new();
        if a.crossings {
            let mut marked = vec![[225u8, 220, 200]; g.vertices];
            for c in crossings(&g.faces, &s.positions) {
                c.edge
                    .iter()
                    .chain(&g.faces[c.face as usize])
                    .for_each(|v| marked[*v as usize] = [220, 0, 0]);
            }
            painted.extend(g.render.vertex.iter().map(|v| marked[*v as usize]));
        } else if let Some(maps) = &fits {
            painted.extend(
                g.render
                    .vertex
                    .iter()
                    .map(|v| maps[k].vertices[*v as usize].color()),
            );
        }
        let known = library::names().contains(&g.name.as_str());
        let color = (if known {
            library::dye(&g.name)
        } else {
            library::dye(library::names()[k % 9])
        })
        .map(|c| f32::from(c) / 255.0);
        parts.push(Part {
            vertices: world,
            faces: g.render.faces.clone(),
            color,
            uv: g.render.uv.clone(),
            painted,
        });
    }
    if a.crop {
        y = [own[0] - 0.08, own[1] + 0.12];
    } else {
        y = [y[0] - 0.03, y[1] + 0.03];
    }
    (parts, y, centre)
}

fn main() {
    let a = args();
    std::fs::create_dir_all(&a.out).expect("a folder");
    for g in &a.garments {
        let (w, h) = a.cell;
        let (columns, rows) = (
            (a.views.len() * a.sizes.len()) as u32,
            a.bodies.len() as u32,
        );
        let (width, height) = (columns * w, rows * h);
        let mut sheet = vec![255u8; (width * height * 3) as usize];
        for (row, body) in a.bodies.iter().enumerate() {
            for (block, size) in a.sizes.iter().enumerate() {
                let (parts, y, centre) = outfit(&a, g, body, size);
                for (k, yaw) in a.views.iter().enumerate() {
                    let picture = draw(&parts, yaw.to_radians(), a.cell, y, centre);
                    let column = block * a.views.len() + k;
                    for line in 0..h as usize {
                        let to =
                            ((row * h as usize + line) * width as usize + column * w as usize) * 3;
                        let from = line * w as usize * 3;
                        sheet[to..to + w as usize * 3]
                            .copy_from_slice(&picture[from..from + w as usize * 3]);
                    }
                }
            }
        }
        let name = std::path::Path::new(g)
            .file_stem()
            .and_then(|s| s.to_str())
            .unwrap_or("outfit")
            .to_owned();
        let path = a.out.join(format!("{name}.png"));
        write_png_rgb(
            &path,
            &ColorImage::new(width, height, sheet).expect("a picture"),
        )
        .expect("written");
        println!("{}", path.display());
    }
}
