//! Alpha expansion on synthetic labellings of a tube mesh: time and energy, and the energies as raw files.
//!
//! `cargo run --release -p tryon-bench --example potts_labelling -- out/potts`, then `benches/peers/alpha_expansion.py`.
#![allow(clippy::print_stdout)]

use std::f64::consts::TAU;
use std::path::Path;
use std::time::Instant;
use std::{env, fs, io};
use tryon::geometry::math::order_statistics::median;
use tryon::geometry::mrf::{AlphaExpansion, ExpansionConfig, MrfError, MrfModel};

/// Vertices along and around the tube: 13,000 nodes, 38,800 edges.
const RINGS: usize = 130;
const SIDES: usize = 100;
/// Number of labels.
const LABELS: usize = 4;
/// Solves per energy; the median time counts.
const RUNS: usize = 21;
/// Length of the index ranges within which the vertex order is shuffled: scanned meshes are nearly local.
const SHUFFLE: usize = 256;
/// Integer costs per unit of energy.
const UNIT: f64 = 128.0;

/// Kind of energy.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// Four regions, observations with noise of 0.7 label steps.
    Smooth,
    /// Four regions, noise of 2.5 label steps, weights four times as strong.
    Weak,
    /// Uniform costs without regions.
    Random,
}

/// SplitMix64 generator.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound as u64) as usize
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.unit().max(1e-12).ln()).sqrt();
        radius * (TAU * self.unit()).cos()
    }
}

/// Energy with integer costs.
struct Labelling {
    edges: Vec<[u32; 2]>,
    weights: Vec<f32>,
    unary: Vec<f32>,
    /// Label of least unary cost per node.
    init: Vec<u32>,
}

/// Edges of a triangulated tube, and its vertices' positions along and around it [0, 1).
fn tube(random: &mut Random) -> (Vec<[u32; 2]>, Vec<[f64; 2]>) {
    let mut order: Vec<u32> = (0..(RINGS * SIDES) as u32).collect();
    for range in order.chunks_mut(SHUFFLE) {
        for i in (1..range.len()).rev() {
            range.swap(i, random.below(i + 1));
        }
    }

    let at = |ring: usize, side: usize| order[ring * SIDES + side % SIDES];
    let mut edges = Vec::new();
    let mut positions = vec![[0.0; 2]; order.len()];
    for ring in 0..RINGS {
        for side in 0..SIDES {
            let position = [ring as f64 / RINGS as f64, side as f64 / SIDES as f64];
            positions[at(ring, side) as usize] = position;
            edges.push([at(ring, side), at(ring, side + 1)]);
            if ring + 1 < RINGS {
                edges.push([at(ring, side), at(ring + 1, side)]);
                edges.push(if random.unit() < 0.5 {
                    [at(ring, side), at(ring + 1, side + 1)]
                } else {
                    [at(ring, side + 1), at(ring + 1, side)]
                });
            }
        }
    }
    (edges, positions)
}

/// Energy of one kind on a new tube.
fn labelling(kind: Kind, seed: u64) -> Labelling {
    let mut random = Random(seed);
    let (edges, positions) = tube(&mut random);
    let (noise, strength) = if kind == Kind::Weak {
        (2.5, 4.0)
    } else {
        (0.7, 1.0)
    };

    let mut unary = Vec::new();
    for [along, around] in positions {
        let region = (along * LABELS as f64 + 0.35 * (2.0 * TAU * around).sin()).floor();
        let observed = region.clamp(0.0, LABELS as f64 - 1.0) + noise * random.normal();
        unary.extend((0..LABELS).map(|label| {
            match kind {
                Kind::Random => random.below(1000) as f32,
                _ => (UNIT * (observed - label as f64).powi(2))
                    .min(2000.0)
                    .round() as f32,
            }
        }));
    }

    let mut weight = |_: &[u32; 2]| match kind {
        Kind::Random => random.below(300) as f32,
        _ => (UNIT * strength * (0.5 + random.unit())).round() as f32,
    };
    let weights = edges.iter().map(&mut weight).collect();
    let best = |costs: &[f32]| (0..LABELS).min_by(|&a, &b| costs[a].total_cmp(&costs[b]));
    let init = unary
        .chunks_exact(LABELS)
        .map(|costs| best(costs).unwrap_or(0) as u32)
        .collect();
    Labelling {
        edges,
        weights,
        unary,
        init,
    }
}

/// Median time of a solve [ms], without and with the construction of the graph, and the energy.
fn measure(energy: &Labelling) -> Result<[f64; 3], MrfError> {
    let model = MrfModel {
        edges: &energy.edges,
        weights: &energy.weights,
    };
    let config = ExpansionConfig::default();
    let mut solver = AlphaExpansion::new(energy.init.len(), model.edges)?;
    let mut times = [Vec::new(), Vec::new()];
    let mut found = 0.0;
    for _ in 0..RUNS {
        let mut labels = energy.init.clone();
        let start = Instant::now();
        found = solver
            .expand(model.weights, &energy.unary, &mut labels, &config)?
            .energy;
        times[0].push(start.elapsed().as_secs_f64() * 1e3);

        labels.copy_from_slice(&energy.init);
        let start = Instant::now();
        model.expand(&energy.unary, &mut labels, &config)?;
        times[1].push(start.elapsed().as_secs_f64() * 1e3);
    }
    let [solve, build] = times.map(|mut t| median(&mut t).unwrap_or(0.0));
    Ok([solve, build, found])
}

/// Raw little-endian arrays of an energy, and this solver's result, below `folder`.
fn write(folder: &Path, name: &str, energy: &Labelling, result: [f64; 3]) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let file = |array: &str| folder.join(format!("{name}.{array}"));
    let integers = |values: &mut dyn Iterator<Item = u32>| -> Vec<u8> {
        values.flat_map(u32::to_le_bytes).collect()
    };
    let floats = |values: &[f32]| integers(&mut values.iter().map(|v| v.to_bits()));
    fs::write(
        file("edges"),
        integers(&mut energy.edges.iter().flatten().copied()),
    )?;
    fs::write(file("init"), integers(&mut energy.init.iter().copied()))?;
    fs::write(file("weights"), floats(&energy.weights))?;
    fs::write(file("unary"), floats(&energy.unary))?;
    let [solve, build, found] = result;
    fs::write(file("result"), format!("{solve} {build} {found}\n"))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = env::args().nth(1);
    println!("energy     solve [ms]  with graph [ms]  energy");
    for (name, kind) in [
        ("smooth", Kind::Smooth),
        ("weak", Kind::Weak),
        ("random", Kind::Random),
    ] {
        for seed in [1, 2] {
            let name = format!("{name}{seed}");
            let energy = labelling(kind, seed);
            let result = measure(&energy)?;
            println!(
                "{name:10} {:10.2}  {:15.2}  {:.0}",
                result[0], result[1], result[2]
            );
            if let Some(folder) = &folder {
                write(Path::new(folder), &name, &energy, result)?;
            }
        }
    }
    Ok(())
}
