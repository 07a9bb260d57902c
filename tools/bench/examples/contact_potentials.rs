//! Distances, barrier and friction of random and nearly degenerate contact pairs: time per pair, and all derivatives as
//! raw files.
//!
//! `cargo run --release -p tryon-bench --example contact_potentials -- out/contact`, then `benches/peers/contact_ipctk.py`.
#![allow(clippy::print_stdout)]

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;
use std::{env, fs, io};
use tryon::cloth::contact::{ActivePair, Barrier, ContactPair, Curvature, Friction, FrictionPair};
use tryon::geometry::math::{ElementEnergy, V3d, exp_so3};

/// Pairs of a set.
const PAIRS: usize = 2000;
/// Passes over a set; the fastest counts.
const PASSES: usize = 9;
/// Length of the edges (m).
const EDGE: f64 = 0.01;
const BARRIER: Barrier = Barrier {
    stiffness: 1.0,
    activation: 1e-3,
    thickness: 0.0,
};
const FRICTION: Friction = Friction {
    coefficient: 0.3,
    slip: 1e-5,
};

type Corners = [V3d; 4];

/// SplitMix64 generator.
struct Random(u64);

impl Random {
    /// Uniform in −1 to 1.
    fn sign(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
    /// Log-uniform between two magnitudes.
    fn magnitude(&mut self, from: f64, to: f64) -> f64 {
        from * (to / from).powf(0.5 * (self.sign() + 1.0))
    }
    fn vector(&mut self, size: f64) -> V3d {
        V3d::new(self.sign(), self.sign(), self.sign()) * size
    }
}

/// Kinds of pairs: name, features, and whether they are nearly degenerate.
const SETS: [(&str, ContactPair, bool); 4] = [
    ("face_random", FACE, false),
    ("face_sliver", FACE, true),
    ("edge_random", EDGES, false),
    ("edge_parallel", EDGES, true),
];
const FACE: ContactPair = ContactPair::VertexFace { v: 0, f: [1, 2, 3] };
const EDGES: ContactPair = ContactPair::EdgeEdge {
    a: [0, 1],
    b: [2, 3],
};

/// Pair within reach: edges of 10 mm; thin ones at a sine of 1e-5 to 1e-2 and a distance of 1e-6 to 1e-4 m.
fn corners(random: &mut Random, pair: ContactPair, thin: bool) -> Corners {
    loop {
        let candidate = match (pair, thin) {
            (ContactPair::VertexFace { .. }, false) => {
                let lift = V3d::y() * (5e-4 * (1.0 + random.sign()));
                let [a, b, c] = [0, 1, 2].map(|_| random.vector(EDGE));
                [
                    (a + b + c) / 3.0 + random.vector(0.4 * EDGE) + lift,
                    a,
                    b,
                    c,
                ]
            }
            (ContactPair::VertexFace { .. }, true) => {
                let height = EDGE * random.magnitude(1e-5, 1e-2);
                let along = V3d::x() * EDGE;
                let apex = along * 0.5 + V3d::z() * height + random.vector(1e-9);
                let gap = V3d::y() * random.magnitude(1e-6, 1e-4);
                let foot = along * (0.5 + 0.2 * random.sign()) + V3d::z() * (0.3 * height);
                [foot + gap, random.vector(1e-9), along, apex]
            }
            (_, false) => [0, 1, 2, 3].map(|_| random.vector(0.6 * EDGE)),
            (_, true) => {
                let half = V3d::x() * (0.5 * EDGE);
                let tilt = V3d::z() * (0.5 * EDGE * random.magnitude(1e-5, 1e-2));
                let gap = V3d::y() * random.magnitude(1e-6, 1e-4);
                let shift = V3d::x() * (0.2 * EDGE * random.sign());
                let ends = [gap - half - tilt, gap + half + tilt];
                let [b0, b1] = ends.map(|p| p + shift + random.vector(1e-9));
                [-half, half, b0, b1]
            }
        };
        let candidate = placed(random, candidate);
        let separation = pair.separation(&candidate).squared.sqrt();
        if separation > 5e-7 && separation < 0.95 * BARRIER.activation {
            return candidate;
        }
    }
}

/// The same, turned and about a metre away: where coordinates round.
fn placed(random: &mut Random, corners: Corners) -> Corners {
    let (turn, shift) = (exp_so3(&random.vector(3.0)), random.vector(1.0));
    corners.map(|p| turn * p + shift)
}

/// Everything that the peer compares of one pair.
fn derivatives(active: &ActivePair, corners: &Corners, now: &Corners) -> [ElementEnergy<12>; 3] {
    let distance = active.pair.separation(corners).expansion();
    let barrier = BARRIER.energy(active, corners, Curvature::Exact);
    let friction = FrictionPair::lagged(active, &BARRIER, corners, corners)
        .map(|pair| FRICTION.energy(&pair, now));
    [
        distance,
        barrier.unwrap_or_default(),
        friction.unwrap_or_default(),
    ]
}

fn bytes(values: impl IntoIterator<Item = f64>) -> Vec<u8> {
    values.into_iter().flat_map(f64::to_le_bytes).collect()
}

/// Nanoseconds a pair, of the fastest pass.
fn time<T>(all: &[Corners], mut f: impl FnMut(usize, &Corners) -> T) -> f64 {
    let pass = |_| {
        let start = Instant::now();
        for (i, c) in all.iter().enumerate() {
            black_box(f(i, black_box(c)));
        }
        start.elapsed().as_secs_f64() * 1e9 / all.len() as f64
    };
    (0..PASSES).map(pass).fold(f64::INFINITY, f64::min)
}

/// Times of one set (ns): distance, its Hessian, barrier with projected Hessian, friction with Hessian.
fn times(pair: ContactPair, all: &[Corners]) -> [f64; 4] {
    let active = |c: &Corners| ActivePair::new(pair, c);
    let actives: Vec<ActivePair> = all.iter().map(active).collect();
    let lagged: Vec<Option<FrictionPair>> = (actives.iter().zip(all))
        .map(|(a, c)| FrictionPair::lagged(a, &BARRIER, c, c))
        .collect();
    [
        time(all, |_, c| pair.separation(c).squared),
        time(all, |_, c| pair.separation(c).expansion::<12>()),
        time(all, |i, c| {
            BARRIER.energy(&actives[i], c, Curvature::Projected)
        }),
        time(all, |i, c| {
            lagged[i].as_ref().map(|p| FRICTION.energy(p, c))
        }),
    ]
}

fn main() -> io::Result<()> {
    let folder = env::args().nth(1).unwrap_or_else(|| "out/contact".into());
    let folder = Path::new(&folder);
    fs::create_dir_all(folder)?;
    println!("set            distance  its Hessian  barrier  friction [ns a pair]");
    let mut random = Random(1);
    for (name, pair, thin) in SETS {
        let all: Vec<Corners> = (0..PAIRS)
            .map(|_| corners(&mut random, pair, thin))
            .collect();
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        for here in &all {
            let active = ActivePair::new(pair, here);
            let now = here.map(|p| p + random.vector(1e-5));
            let features = pair.separation(here).slides().len() as f64;
            let positions = here.iter().chain(&now).flat_map(|p| [p.x, p.y, p.z]);
            inputs.extend(bytes(positions));
            outputs.extend(bytes([features, active.parallel_threshold]));
            for e in derivatives(&active, here, &now) {
                outputs.extend(bytes([e.value]));
                outputs.extend(bytes(e.gradient.iter().chain(&e.hessian).copied()));
            }
        }
        fs::write(folder.join(format!("{name}.pairs")), inputs)?;
        fs::write(folder.join(format!("{name}.ours")), outputs)?;
        let t = times(pair, &all);
        fs::write(
            folder.join(format!("{name}.times")),
            t.map(|t| format!("{t:.1}")).join(" "),
        )?;
        println!(
            "{name:14} {:8.0} {:12.0} {:8.0} {:9.0}",
            t[0], t[1], t[2], t[3]
        );
    }
    Ok(())
}
