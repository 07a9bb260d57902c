//! Standard cloth scenes by every solver: time a frame, error against the reference, strain, penetration.
#![allow(clippy::print_stdout, clippy::unwrap_used)]
use std::path::Path;
use tryon::cloth::scene::{Method, RunConfig, load, run};
use tryon::formats::npy::read_npy;
use tryon::spatial::intersections;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let folder = std::env::var("TRYON_SHARED")
        .unwrap_or_else(|_| format!("{}/../shared/data", env!("CARGO_MANIFEST_DIR")));
    let scene = &args[1];
    let get = |k: &str| {
        args.iter()
            .find_map(|a| a.strip_prefix(&format!("{k}=")).map(str::to_owned))
    };
    let s = load(Path::new(&format!("{folder}/scenes/{scene}.json"))).unwrap();
    let mut c = RunConfig::default();
    if let Some(m) = get("method") {
        c.method = match m.as_str() {
            "small" => Method::SmallSteps,
            "qn" => Method::QuasiNewton,
            "bdf2" => Method::QuasiNewtonBdf2,
            "xpbd" => Method::Xpbd,
            "springs" => Method::MassSpring,
            _ => panic!(),
        };
    }
    if let Some(v) = get("n") {
        c.substeps = v.parse().unwrap();
    }
    if let Some(v) = get("it") {
        c.iterations = v.parse().unwrap();
    }
    if let Some(v) = get("ahead") {
        c.ahead = v.parse().unwrap();
    }
    if let Some(v) = get("bend") {
        c.every[0] = v.parse().unwrap();
    }
    if let Some(v) = get("look") {
        c.every[1] = v.parse().unwrap();
    }
    if let Some(v) = get("patches") {
        c.patches = v.parse().unwrap();
    }
    if let Some(v) = get("smooth") {
        c.smooth = Some(v.parse().unwrap());
    }
    c.self_collision = get("folds").is_some_and(|v| v != "0");
    if let Some(v) = get("thickness") {
        c.thickness = v.parse().unwrap();
    }
    if let Some(v) = get("search") {
        c.fold_search = v.parse::<f64>().unwrap() * 1e-3;
    }
    let cpu = || {
        // All threads: what the patches take together.
        let of = |p: std::path::PathBuf| {
            let s = std::fs::read_to_string(p.join("schedstat")).ok()?;
            s.split(' ').next()?.parse::<f64>().ok()
        };
        let tasks = std::fs::read_dir("/proc/self/task").unwrap();
        tasks.filter_map(|t| of(t.ok()?.path())).sum::<f64>() * 1e-6
    };
    let t0 = cpu();
    let mut positions = vec![];
    let q = run(&s, &c, |_, p| {
        positions.push(p.to_vec());
        std::ops::ControlFlow::Continue(())
    })
    .unwrap();
    let t1 = (cpu() - t0) / (s.frames() - 1) as f64;
    // From the file beside the scene, or from a run of its own with `against` small steps and nothing smoothed.
    let n = s.start.len();
    let reference: Vec<Vec<[f32; 3]>> = if let Some(steps) = get("against") {
        let mut all = vec![];
        let fine = RunConfig {
            substeps: steps.parse().unwrap(),
            smooth: Some(0),
            ..c
        };
        run(&s, &fine, |_, p| {
            all.push(p.iter().map(|p| [p.x, p.y, p.z]).collect());
            std::ops::ControlFlow::Continue(())
        })
        .unwrap();
        all
    } else if let Ok((_, all)) =
        read_npy(Path::new(&format!("{folder}/scenes/{scene}.reference.npy")))
    {
        all.chunks_exact(3 * n)
            .map(|f| f.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect())
            .collect()
    } else {
        vec![]
    };
    let (mut sum, mut at) = (0.0, vec![]);
    for (k, (now, then)) in positions.iter().zip(&reference).enumerate() {
        let (mut way, mut d2) = ([0.0f64; 3], 0.0);
        for (p, q) in now.iter().zip(then) {
            for d in 0..3 {
                let off = f64::from(p[d]) - f64::from(q[d]);
                way[d] += off / n as f64;
                d2 += off * off;
            }
        }
        sum += way.iter().map(|w| w * w).sum::<f64>();
        if k == 15 || k == 30 || k == 45 {
            at.push(format!("{:.1}", (d2 / n as f64).sqrt() * 1e3));
        }
    }
    let com = (sum / reference.len() as f64).sqrt() * 1e3;
    println!(
        "{scene} {:?} n={} it={} com={com:.1}mm verts@.25,.5,.75={at:?} cpu {t1:.2} ms med {:.2} mean {:.2} strain99 {:.2}% pen {:.2}mm soft {:.2} scaled {} energy {:.3} held off {} skipped {} most crossings {}",
        c.method,
        q.substeps,
        q.iterations,
        q.ms_median,
        q.ms_mean,
        q.p99_strain * 100.0,
        q.penetration * 1e3,
        q.softened,
        q.soft_elements,
        q.energy_end,
        q.fold_contacts,
        q.fold_searches_skipped,
        positions
            .iter()
            .skip(5)
            .step_by(5)
            .map(|p| intersections(&s.faces, p).len())
            .max()
            .unwrap_or(0)
    );
}
