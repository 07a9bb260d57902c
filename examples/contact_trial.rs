use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;
use tryon::body::measure::measure;
use tryon::cloth::{Config, Input, State, Workspace, step};
use tryon::dressing::{DressOptions, Dressed, GarmentSource, dress_all, suggest};
use tryon::evaluate::dance::load;
use tryon::evaluate::{OutfitSpec, Solid};
use tryon::math::P3;
use tryon::par::with_threads;
use tryon::spatial::intersections;

fn crossings(d: &Dressed, state: &State, w: &Workspace, body: &[P3], faces: &[[u32; 3]], explain: &mut bool) -> (usize, usize, usize) {
    let (mut x, mut f, mut owner) = (Vec::new(), Vec::new(), Vec::new());
    for (k, (g, s)) in d.model.outfit.garments.iter().zip(&state.garments).enumerate() {
        let base = x.len() as u32;
        x.extend_from_slice(&s.positions);
        owner.resize(x.len(), k);
        f.extend(g.faces.iter().map(|t| t.map(|v| v + base)));
    }
    let b = state.garments.len();
    let base = x.len() as u32;
    x.extend_from_slice(body);
    owner.resize(x.len(), b);
    f.extend(faces.iter().map(|t| t.map(|v| v + base)));
    let (mut own, mut layer, mut skin) = (0, 0, 0);
    let mut starts = vec![0u32];
    for s in &state.garments { starts.push(starts.last().unwrap() + s.positions.len() as u32); }
    let found = intersections(&f, &x);
    let cloth: Vec<_> = found.iter().filter(|i| owner[i.edge[0] as usize] != b && owner[f[i.face as usize][0] as usize] != b).collect();
    if *explain && !cloth.is_empty() {
        for i in cloth.iter().take(4) {
            println!("  crossing {:?} {:?} at {:.2?}", i.edge, f[i.face as usize], x[i.edge[0] as usize].coords.as_slice());
            for v in i.edge.iter().chain(&f[i.face as usize]) {
                let g = owner[*v as usize];
                println!("    {g} {v}: {}", w.describe(&d.model, g, v - starts[g]));
            }
        }
    }
    *explain = cloth.is_empty();
    for i in found {
        let e = owner[i.edge[0] as usize];
        let t = owner[f[i.face as usize][0] as usize];
        if e == b && t == b { continue; }
        if e == b || t == b { skin += 1 } else if e == t { own += 1 } else { layer += 1 }
    }
    (own, layer, skin)
}

#[derive(Default)]
struct Side { ms: Vec<f64>, own: f64, layer: f64, skin: f64, n: f64, deepest: f32, strain: Vec<f64>, stages: [f64; 3], faults: usize, explain: bool, pairs: [usize; 2] }

impl Side {
    fn print(&mut self, name: &str) {
        self.strain.sort_by(f64::total_cmp);
        let k = self.strain.len() * 99 / 100;
        println!("{name}: own {:.2} layer {:.2} body {:.2} | sum {:.0} ms, mean {:.2} (maps {:.2} contact {:.2} solve {:.2}) deepest {:.1} mm p99 {:.2} % max {:.1} % faults {} pairs {:?}",
            self.own / self.n, self.layer / self.n, self.skin / self.n, self.ms.iter().sum::<f64>(), self.ms.iter().sum::<f64>() / self.ms.len() as f64,
            self.stages[0] / self.ms.len() as f64, self.stages[1] / self.ms.len() as f64, self.stages[2] / self.ms.len() as f64,
            self.deepest * 1e3, self.strain[k.min(self.strain.len()-1)] * 100.0, self.strain.last().unwrap() * 100.0, self.faults, self.pairs);
    }
}

fn configs(spec: &str, base: &Config) -> Config {
    let mut c = base.clone();
    for s in spec.split(',').filter(|s| !s.is_empty()) {
        let (k, v) = s.split_once('=').unwrap_or((s, "1"));
        let v: f64 = v.parse().unwrap();
        match k {
            "old" => {}
            "pair" => { c.tune.on = true; }
            "reach" => c.tune.reach = v as f32,
            "gap" => c.tune.gap = v as f32,
            "blocks" => c.tune.block = 1.0 / (120.0 * v as f32),
            "alike" => c.tune.alike = v as f32,
            "smooth" => c.tune.smooth = v > 0.0,
            "sleeves" => c.tune.sleeves = v > 0.0,
            "far" => c.tune.farthest = v as f32,
            "friction" => c.tune.friction = v as f32,
            "edges" => c.tune.edges = v > 0.0,
            "heights" => c.tune.heights = v > 0.0,
            "x0" => c.tune.x[0] = v as f32,
            "x1" => c.tune.x[1] = v as f32,
            "x2" => c.tune.x[2] = v as f32,
            "x3" => c.tune.x[3] = v as f32,
            "folds" => c.self_collision = v > 0.0,
            "layers" => c.layers = v > 0.0,
            "untangle" => c.untangle = v,
            "sharpest" => c.min_fold_ratio = v,
            _ => panic!("{k}"),
        }
    }
    c
}


struct Film { d: Dressed, faces: Vec<[u32; 3]>, dt: f64, steps: usize }

/// The person of a recording.
fn tracked(path: &Path) -> (std::sync::Arc<tryon::body::Template>, tryon::body::RestBody, tryon::body::Pose<tryon::math::World>, Vec<Vec<P3>>) {
    use tryon::tracking::{self, TrackerConfig, TrackerModel, TrackerState};
    let mut source = tryon::formats::open_recording(path).expect("a recording");
    let template = tryon::body::embedded::template();
    let model = TrackerModel::new(template.clone(), source.calibration().clone(), TrackerConfig::default());
    let (mut state, mut work) = (TrackerState::new(&model), tracking::Workspace::default());
    let (mut film, mut begun) = (Vec::new(), None);
    while let Some(frame) = source.next_frame().expect("a picture") {
        tracking::step(&model, &mut state, &frame, &mut work).expect("a step");
        if state.status != tracking::Status::Tracking { continue; }
        let mut body = Vec::new();
        state.world_from_camera.points_f32(work.posed(&model, &state).0, &mut body);
        film.push(body);
        begun.get_or_insert_with(|| {
            let pose = tryon::body::Pose { root: state.world_from_camera * state.pose.root, angles: state.pose.angles.clone() };
            (template.personalise(&state.shape), pose)
        });
    }
    let (rest, pose) = begun.expect("nobody is tracked");
    (template, rest, pose, film)
}

fn play(film: &mut Film, specs: &[String], base: &Config, every: usize, log: bool, explain: bool, body: impl Fn(usize) -> Vec<P3>, title: &str) {
    let mut all: Vec<(State, Workspace, Side)> = specs.iter().map(|_| (film.d.state.clone(), Workspace::default(), Side::default())).collect();
    for i in 1..=film.steps {
        let skin = body(i);
        for k in 0..all.len() {
            let k = (k + i) % all.len();
            let (state, w, s) = &mut all[k];
            film.d.model.replace_config(configs(&specs[k], base));
            let at = Instant::now();
            let r = step(&film.d.model, state, &Input { body: &skin, dt: film.dt }, w).unwrap();
            s.ms.push(at.elapsed().as_secs_f64() * 1e3);
            for (a, b) in s.stages.iter_mut().zip([r.stages_ms.maps, r.stages_ms.contact, r.stages_ms.solve]) { *a += b }
            s.strain.push(r.p99_strain);
            s.faults += usize::from(r.kept_last_good.is_some());
            if i % every == 0 {
                if !explain { s.explain = false; }
                let (o, l, b) = crossings(&film.d, state, w, &skin, &film.faces, &mut s.explain);
                s.pairs = w.counts();
                s.own += o as f64; s.layer += l as f64; s.skin += b as f64; s.n += 1.0;
                if i % (4 * every) == 0 {
                    let solid = Solid::new(&skin, &film.faces);
                    for p in state.garments.iter().flat_map(|g| &g.positions) { s.deepest = s.deepest.max(solid.depth(p)) }
                }
                if log { println!("{i} {}: own {o} layer {l} body {b}", specs[k]); }
            }
        }
    }
    let base = all[0].2.ms.iter().sum::<f64>();
    for ((_, _, s), name) in all.iter_mut().zip(specs) { let r = s.ms.iter().sum::<f64>() / base; print!("{title} ratio {r:.3} "); s.print(name); }
}

fn main() {
    let a: BTreeMap<String, String> = std::env::args().skip(1).filter_map(|s| s.split_once('=').map(|(a, b)| (a.trim_start_matches("--").to_owned(), b.to_owned()))).collect();
    let get = |k: &str, d: &str| a.get(k).cloned().unwrap_or(d.into());
    let specs: Vec<String> = get("sides", "old").split('/').map(str::to_owned).collect();
    let every: usize = get("every", "3").parse().unwrap();
    let threads: usize = get("threads", "2").parse().unwrap();
    let (log, explain) = (a.contains_key("log"), a.contains_key("explain"));
    if let Some(sequence) = a.get("seq") {
        let name = if sequence == "jacks" { "jacks_f_avg_kinect1_room" } else { "charleston_m_heavy_tof_room" };
        with_threads(threads, || {
            let (template, rest, pose, bodies) = tracked(&Path::new("/work/shared/data/sequences").join(name));
            let measures = measure(&template, &rest).unwrap();
            let garments = get("garment", "tshirt/longsleeve/tank/hoodie/dress/skirt/straight_skirt/trousers/shorts");
            for g in garments.split('/') {
                let patterns: Vec<_> = g.split('+').map(|g| tryon::garment::library::pattern(g, suggest(g, &measures).unwrap().size).unwrap()).collect();
                let wear: Vec<_> = patterns.iter().map(GarmentSource::Pattern).collect();
                let options = DressOptions { config: Config::tracked(), ..DressOptions::default() };
                let d = match dress_all(&template, &rest, &pose, &wear, &options) { Ok(d) => d, Err(e) => { println!("{g}: {e}"); continue; } };
                let faces = template.mesh().faces().to_vec();
                let mut film = Film { d, faces, dt: 1.0 / 30.0, steps: bodies.len() };
                play(&mut film, &specs, &Config::tracked(), every, log, explain, |i| bodies[i - 1].clone(), &format!("{sequence} {g}"));
            }
        }).unwrap();
        return;
    }
    let dance = load(Path::new("/work/shared/data/garments/cipc_apache2")).unwrap();
    let steps = (get("seconds", "4.8").parse::<f64>().unwrap() * 60.0).round() as usize;
    with_threads(threads, || {
        for edge in get("edge", "0.0118").split('/') {
            let outfit = OutfitSpec {
                garments: get("garment", "tshirt+skirt").split('+').map(str::to_owned).collect(),
                edge: edge.parse().unwrap(),
                config: Config::default(),
            };
            let d = dance.dress(&outfit).unwrap();
            let faces = dance.template.mesh().faces().to_vec();
            let mut film = Film { d, faces, dt: 1.0 / 60.0, steps };
            play(&mut film, &specs, &Config::default(), every, log, explain, |i| dance.bodies.at(i as f64 / 60.0), edge);
        }
    }).unwrap();
}
