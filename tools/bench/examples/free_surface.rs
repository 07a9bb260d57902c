//! Free surface of a synthetic scan and one sparse system of it: times, and both as raw files for other solvers.
//!
//! `cargo run --release -p tryon-bench --example free_surface -- out/surface`, then `benches/peers/free_surface.py`.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use std::{env, fs};
use tryon::body::embedded;
use tryon::clothcap::align::{
    Aligner, Alignment, FreeSurface, SurfaceFitConfig, SurfaceMatch, find_frame,
};
use tryon::clothcap::scan::BodyScan;
use tryon::formats::scan::ScanMesh;
use tryon::geometry::linear::{Factor, SymbolicFactor, SymmetricPattern};
use tryon::geometry::math::P3;
use tryon::geometry::math::order_statistics::median;
use tryon::geometry::mesh::{TriMesh, face_normal};
use tryon::geometry::par::with_threads;
use tryon_bench::garment_capture::capture_scenes;

/// Any error.
type Fault = Box<dyn Error + Send + Sync>;

/// Runs; the median time counts.
const RUNS: usize = 5;
/// Weight of an edge: that of an even mesh, times the square of the last stage's coupling length.
const EDGE: f64 = 0.577 * 0.012 * 0.012;
/// Pull to the model beside the data's.
const ANCHOR: f64 = 1e-4;

/// Symmetric positive definite system of vertex positions: lower triangle, three right-hand sides.
struct System {
    pattern: Arc<SymmetricPattern>,
    places: Vec<[u32; 2]>,
    values: Vec<f64>,
    rhs: Vec<[f64; 3]>,
}

impl System {
    /// Edge Laplacian of a mesh and one row per matched scan point, as in the last iteration of a free surface.
    fn new(mesh: &TriMesh, alignment: &Alignment, points: &[P3]) -> Result<Self, Fault> {
        let model = &alignment.model;
        let mut places: Vec<[u32; 2]> = Vec::new();
        for f in mesh.faces() {
            let sides = [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]];
            places.extend(sides.map(|[a, b]| [a.max(b), a.min(b)]));
        }
        places.sort_unstable();
        places.dedup();
        let edges = places.clone();
        places.extend((0..model.len() as u32).map(|v| [v, v]));
        let pairs = edges.iter().map(|e| (e[0], e[1]));
        let pattern = Arc::new(SymmetricPattern::new(model.len(), pairs)?);
        let mut out = Self {
            values: vec![0.0; pattern.entries()],
            rhs: vec![[0.0; 3]; model.len()],
            pattern,
            places,
        };
        for &[a, b] in &edges {
            let d = (model[a as usize] - model[b as usize]).cast::<f64>();
            out.add(&[a, b], &[1.0, -1.0], EDGE, d.into());
        }
        let twice = |f| f64::from(face_normal(model, f).norm());
        let area = 0.5 * mesh.faces().iter().map(twice).sum::<f64>();
        let target = |p: &P3| p.coords.cast::<f64>().into();
        for (v, p) in (0..).zip(model) {
            let weight = ANCHOR * area / model.len() as f64;
            out.add(&[v], &[1.0], weight, target(p));
        }
        for (m, p) in alignment.matches.iter().zip(points) {
            let SurfaceMatch { face, corners, .. } = m;
            let weight = m.weight * area / points.len() as f64;
            let corners = corners.map(f64::from);
            out.add(&mesh.faces()[*face as usize], &corners, weight, target(p));
        }
        Ok(out)
    }

    /// Adds weight × ‖Σ factor × vertex − target‖².
    fn add(&mut self, vertices: &[u32], factors: &[f64], weight: f64, target: [f64; 3]) {
        for (k, (&v, f)) in vertices.iter().zip(factors).enumerate() {
            for (&u, g) in vertices[..=k].iter().zip(factors) {
                if let Some(slot) = self.pattern.slot(v, u) {
                    self.values[slot] += weight * f * g;
                }
            }
            for (r, t) in self.rhs[v as usize].iter_mut().zip(target) {
                *r += weight * f * t;
            }
        }
    }

    /// Solution, and times of analysis, factorisation and solve, ms.
    fn solve(&self) -> Result<(Vec<[f64; 3]>, [f64; 3]), Fault> {
        let mut clock = Clock::default();
        let mut factor = Factor::new(SymbolicFactor::new(self.pattern.clone())?);
        let analysis = clock.lap();
        factor.refactor(&self.values)?;
        let factorisation = clock.lap();
        let mut x = self.rhs.clone();
        factor.solve(&mut x);
        Ok((x, [analysis, factorisation, clock.lap()]))
    }

    /// Values in the order of `places`.
    fn entries(&self) -> Vec<f64> {
        let slot = |[row, column]: &[u32; 2]| self.pattern.slot(*row, *column);
        let value = |place| slot(place).map_or(0.0, |s| self.values[s]);
        self.places.iter().map(value).collect()
    }
}

/// Time since the last lap.
struct Clock(Instant);

impl Default for Clock {
    fn default() -> Self {
        Self(Instant::now())
    }
}

impl Clock {
    /// Milliseconds.
    fn lap(&mut self) -> f64 {
        let before = std::mem::replace(&mut self.0, Instant::now());
        (self.0 - before).as_secs_f64() * 1e3
    }
}

/// Writes values as raw little-endian bytes.
fn write<const N: usize>(path: &Path, bytes: impl Iterator<Item = [u8; N]>) -> std::io::Result<()> {
    fs::write(path, bytes.flatten().collect::<Vec<u8>>())
}

fn run(folder: &Path) -> Result<(), Fault> {
    let template = embedded::template();
    let mut scene = capture_scenes()?.swap_remove(0).scene;
    scene.scans = 1;
    let truth = scene.scans()?.swap_remove(0);
    let file = ScanMesh {
        points: truth.points,
        faces: truth.faces,
        normals: truth.normals,
        colors: truth.colors,
        ..ScanMesh::default()
    };
    let (frame, start) = find_frame(&template, &file)?;
    let scan = BodyScan::new(&file, &frame)?;
    let mut aligner = Aligner::new(template)?;
    aligner.start_at(start);
    let alignment = aligner.align(&scan)?;
    let template = aligner.cloth().template();

    let mut free = FreeSurface::new(template)?;
    let mut surface = Vec::new();
    let mut fits = Vec::new();
    for _ in 0..RUNS {
        surface.clone_from(&alignment.model);
        let mut clock = Clock::default();
        let config = SurfaceFitConfig::default();
        free.run(&scan, &alignment.model, &mut surface, &config)?;
        fits.push(clock.lap());
    }
    let system = System::new(template.mesh(), &alignment, &scan.points)?;
    let mut laps = [Vec::new(), Vec::new(), Vec::new()];
    let mut solution = Vec::new();
    for _ in 0..RUNS {
        let (x, times) = system.solve()?;
        laps.iter_mut().zip(times).for_each(|(l, t)| l.push(t));
        solution = x;
    }

    fs::create_dir_all(folder)?;
    let at = |name: &str| folder.join(name);
    let points = |p: &[P3]| -> Vec<f32> { p.iter().flat_map(|p| [p.x, p.y, p.z]).collect() };
    for (name, p) in [
        ("scan.f32", &scan.points),
        ("model.f32", &alignment.model),
        ("surface.f32", &surface),
    ] {
        write(&at(name), points(p).into_iter().map(f32::to_le_bytes))?;
    }
    let faces = template.mesh().faces().iter().flatten();
    write(&at("faces.u32"), faces.map(|v| v.to_le_bytes()))?;
    let places = system.places.iter().flatten();
    write(&at("places.u32"), places.map(|v| v.to_le_bytes()))?;
    let floats =
        |name: &str, all: Vec<f64>| write(&at(name), all.into_iter().map(f64::to_le_bytes));
    floats("entries.f64", system.entries())?;
    floats("rhs.f64", system.rhs.concat())?;
    floats("solution.f64", solution.concat())?;
    let [analysis, factorisation, solve] = laps.map(|mut ms| median(&mut ms).unwrap_or(0.0));
    let fit = median(&mut fits).unwrap_or(0.0);
    println!(
        "free surface {fit:.0} ms, analysis {analysis:.1}, factorisation {factorisation:.1}, solve {solve:.1} ms"
    );
    let times = format!("{fit} {analysis} {factorisation} {solve}\n");
    fs::write(at("times"), times)?;
    Ok(())
}

fn main() -> Result<(), Fault> {
    let folder = env::args().nth(1).ok_or("give a folder")?;
    with_threads(1, || run(Path::new(&folder)))?
}
