//! Sleeping cloth on a body that stands, waves or walks off: share asleep, time of a step, distance from the truth.
//!
//! `cargo run --release -p tryon-bench --example standing -- [--garment skirt+tshirt] [--edge 0.0118] [--threads 2] [--steps 120]
//!   [--rounds 2] [--arms 75]`
//!
//! `--arms`: degrees below the horizontal; 75 hang, without it they are off the trunk.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used)] // a development tool: stop at the first fault

use tryon::cloth::Config;
use tryon::geometry::par::with_threads;
use tryon_bench::OutfitSpec;
use tryon_bench::rest::{Motion, RestingSubject};

fn main() {
    let mut outfit = OutfitSpec {
        garments: vec!["skirt".into(), "tshirt".into()],
        edge: 0.0118,
        config: Config::default(),
    };
    let mut arms = None;
    let (mut threads, mut steps, mut rounds) = (2, 120, 2);
    let mut it = std::env::args().skip(1);
    while let Some(flag) = it.next() {
        let value = it.next().expect("a value");
        match flag.as_str() {
            "--garment" => outfit.garments = value.split('+').map(str::to_owned).collect(),
            "--edge" => outfit.edge = value.parse().expect("metres"),
            "--threads" => threads = value.parse().expect("a number"),
            "--steps" => steps = value.parse().expect("a number"),
            "--arms" => arms = Some(value.parse::<f64>().expect("degrees").to_radians()),
            "--rounds" => rounds = value.parse().expect("a number"),
            other => panic!("{other} is not known"),
        }
    }
    with_threads(threads, || {
        let mut body = RestingSubject::new(&outfit, arms).expect("dressed");
        for (what, base, noise) in [("exact", Config::default(), 0.0), ("tracked", Config::tracked(), 1.5e-3f32)] {
            for motion in [Motion::Standing, Motion::Waving, Motion::Lifting, Motion::WalkingOff] {
                let whole = Config { sleep_regions: false, ..base.clone() };
                let never = Config { sleep: false, ..base.clone() };
                // In turn, so that the machine is equally fast for all.
                for _ in 0..rounds {
                    let truth = body.run(&never, motion, steps, noise).expect("a run");
                    println!("{what} {motion:?}, never asleep: {:.2} ms (median; mean {:.2})", truth.median_ms(), truth.mean_ms());
                    for (name, config) in [("whole outfit", &whole), ("by region", &base)] {
                        let r = body.run(config, motion, steps, noise).expect("a run");
                        let [rms, p99, most] = r.apart(&truth);
                        println!(
                            "{what} {motion:?}, {name}: {:.2} ms (median; mean {:.2}), asleep {:.0} %, {:.2} mm rms, {:.2} p99, {:.1} most; deepest {:.2} mm",
                            r.median_ms(), r.mean_ms(), r.mean_asleep() * 100.0, rms * 1e3, p99 * 1e3, most * 1e3, r.penetration * 1e3
                        );
                    }
                }
            }
        }
    })
    .expect("threads");
}
