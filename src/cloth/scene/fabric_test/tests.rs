//! Fabrics of the library in textile tests by both solvers.

use super::{FabricSolver, FabricTest, FabricTestReport, FabricTrial};
use crate::settings::FabricTestSettings;
use tryon_garment::{Fabric, Material};

fn trial(test: FabricTest, fabric: &str, solver: FabricSolver, edge: f64) -> FabricTestReport {
    let mut fabric = Fabric::named(fabric).expect("a fabric");
    let factor: f64 = std::env::var("BEND").map_or(1.0, |b| b.parse().expect("factor"));
    fabric.material.bending.warp *= factor;
    fabric.material.bending.weft *= factor;
    if let Ok(g) = std::env::var("SHEAR") { fabric.material.shear = g.parse().expect("shear"); }
    let trial = FabricTrial {
        test,
        fabric,
        solver,
        edge,
    };
    trial.run(&FabricTestSettings::default()).expect("a report")
}

#[test]
#[ignore]
fn table() {
    let pick = |name: &str, default: &str| std::env::var(name).unwrap_or(default.into());
    let edge: f64 = pick("EDGE", "0.005").parse().expect("edge");
    let tests = pick("TESTS", "cantilever cusick picture-frame");
    let fabrics = pick("FABRICS", &Material::PRESETS.join(" "));
    let solvers = pick("SOLVERS", "offline realtime");
    for test in tests.split(' ') {
        for fabric in fabrics.split(' ') {
            for solver in solvers.split(' ') {
                let solver = match solver {
                    "offline" => FabricSolver::Offline,
                    _ => FabricSolver::Realtime,
                };
                let start = std::time::Instant::now();
                let test = FabricTest::named(test).expect("known");
                println!("{} ({:.1} s)", trial(test, fabric, solver, edge), start.elapsed().as_secs_f64());
            }
        }
    }
}
