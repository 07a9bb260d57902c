//! Standard cloth scenes by every solver: time a frame, error against the reference, strain, penetration.
//!
//! `cloth_scenes SCENE [method=explicit|qn|bdf2|xpbd|springs] [n=SUBSTEPS] [against=SUBSTEPS] …`
#![allow(clippy::print_stdout)]
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use tryon::cloth::scene::{Method, RunConfig, Scene, load, run};
use tryon::formats::npy::read_npy;
use tryon::geometry::math::P3;
use tryon::geometry::spatial::intersections;

/// Frames between two counts of self-intersections.
const CROSSINGS_EVERY: usize = 5;
/// Frames whose vertex error is printed: ¼, ½ and ¾ s.
const ERROR_FRAMES: [usize; 3] = [15, 30, 45];

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Arguments of the form `key=value`.
struct Arguments(Vec<String>);

impl Arguments {
    fn get<T: FromStr>(&self, key: &str) -> Result<Option<T>>
    where
        T::Err: std::fmt::Display,
    {
        let prefix = format!("{key}=");
        let found = self.0.iter().find_map(|a| a.strip_prefix(&prefix));
        let parse = |v: &str| v.parse().map_err(|e| format!("{key}={v}: {e}").into());
        found.map(parse).transpose()
    }
    /// Replaces a setting that is given.
    fn set<T: FromStr>(&self, key: &str, to: &mut T) -> Result<()>
    where
        T::Err: std::fmt::Display,
    {
        if let Some(value) = self.get(key)? {
            *to = value;
        }
        Ok(())
    }
    fn config(&self) -> Result<RunConfig> {
        let mut c = RunConfig::default();
        if let Some(m) = self.get::<String>("method")? {
            c.method = match m.as_str() {
                "explicit" => Method::Explicit,
                "qn" => Method::QuasiNewton,
                "bdf2" => Method::QuasiNewtonBdf2,
                "xpbd" => Method::Xpbd,
                "springs" => Method::MassSpring,
                other => return Err(format!("method `{other}` is not known").into()),
            };
        }
        self.set("n", &mut c.substeps)?;
        self.set("it", &mut c.iterations)?;
        self.set("ahead", &mut c.lookahead)?;
        self.set("bend", &mut c.bending_interval)?;
        self.set("contact", &mut c.contact_interval)?;
        self.set("patches", &mut c.patches)?;
        self.set("thickness", &mut c.thickness)?;
        c.filter_degree = self.get("filter")?;
        c.self_collision = self.get("folds")?.is_some_and(|v: usize| v != 0);
        if let Some(ms) = self.get::<f64>("search")? {
            c.fold_search = ms * 1e-3;
        }
        Ok(c)
    }
}

/// Computing time of all threads so far [ms].
fn cpu_ms() -> f64 {
    let of = |task: PathBuf| {
        let s = std::fs::read_to_string(task.join("schedstat")).ok()?;
        s.split(' ').next()?.parse::<f64>().ok()
    };
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten();
    tasks.filter_map(|t| of(t.ok()?.path())).sum::<f64>() * 1e-6
}

/// Positions of every frame, from the file beside the scene, or from a run with `against` unfiltered substeps.
fn reference(
    file: &Path,
    scene: &Scene,
    config: &RunConfig,
    against: Option<usize>,
) -> Result<Vec<Vec<P3>>> {
    if let Some(substeps) = against {
        let fine = RunConfig {
            substeps,
            filter_degree: Some(0),
            ..*config
        };
        let mut all = Vec::new();
        run(scene, &fine, |_, p| {
            all.push(p.to_vec());
            ControlFlow::Continue(())
        })?;
        return Ok(all);
    }
    let Ok((_, all)) = read_npy(file) else {
        return Ok(Vec::new());
    };
    let frames = all.chunks_exact(3 * scene.start.len());
    let points = |f: &[f32]| {
        f.chunks_exact(3)
            .map(|p| P3::new(p[0], p[1], p[2]))
            .collect()
    };
    Ok(frames.map(points).collect())
}

/// Root mean square distance of the centres of mass, and of the vertices at [`ERROR_FRAMES`] [mm].
fn errors(frames: &[Vec<P3>], reference: &[Vec<P3>]) -> (f64, Vec<String>) {
    let (mut sum, mut at) = (0.0, Vec::new());
    for (k, (now, then)) in frames.iter().zip(reference).enumerate() {
        let n = now.len() as f64;
        let (mut centre, mut square) = ([0.0f64; 3], 0.0);
        for (p, q) in now.iter().zip(then) {
            for d in 0..3 {
                let off = f64::from(p[d]) - f64::from(q[d]);
                centre[d] += off / n;
                square += off * off;
            }
        }
        sum += centre.iter().map(|w| w * w).sum::<f64>();
        if ERROR_FRAMES.contains(&k) {
            at.push(format!("{:.1}", (square / n).sqrt() * 1e3));
        }
    }
    ((sum / reference.len() as f64).sqrt() * 1e3, at)
}

fn main() -> Result<()> {
    let args = Arguments(std::env::args().collect());
    let folder = std::env::var("TRYON_SHARED")
        .unwrap_or_else(|_| format!("{}/../shared/data", env!("CARGO_MANIFEST_DIR")));
    let name = args.0.get(1).ok_or("a scene is needed")?;
    let scene = load(Path::new(&format!("{folder}/scenes/{name}.json")))?;
    let config = args.config()?;
    let before = cpu_ms();
    let mut frames = Vec::new();
    let q = run(&scene, &config, |_, p| {
        frames.push(p.to_vec());
        ControlFlow::Continue(())
    })?;
    let cpu = (cpu_ms() - before) / (scene.frames() - 1) as f64;
    let file = format!("{folder}/scenes/{name}.reference.npy");
    let reference = reference(Path::new(&file), &scene, &config, args.get("against")?)?;
    let (centre, at) = errors(&frames, &reference);
    let checked = frames.iter().skip(CROSSINGS_EVERY).step_by(CROSSINGS_EVERY);
    let crossed = checked.map(|p| intersections(&scene.faces, p).len()).max();
    println!(
        "{name} {:?} n={} it={} com={centre:.1}mm verts@.25,.5,.75={at:?} cpu {cpu:.2} ms med {:.2} mean {:.2} strain99 {:.2}% pen {:.2}mm soft {:.2} scaled {} energy {:.3} fold contacts {} skipped {} most crossings {}",
        config.method,
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
        crossed.unwrap_or(0)
    );
    Ok(())
}
