//! Newton and CG iterations of two sheets that fall onto a sphere, over barriers, Hessians and stiffnesses.
//!
//! `cargo run --release --example contact_newton [-- ROW …]`; rows by number, all without. Decision 066 has the table.
#![allow(clippy::print_stdout)]

mod barriers;
mod scene;
mod solver;

use barriers::{ContactEnergy, HessianKind, Profile};
use scene::Scene;
use solver::Simulation;
use std::env;
use tryon::cloth::contact::Barrier;

/// Time step (s).
const STEP: f64 = 1.0 / 60.0;
/// Steps of a run.
const STEPS: usize = 10;

/// Profile, Hessian, activation (m), stiffness in units of (m / h²) / E₁″ at half of the activation.
type Row = (Profile, HessianKind, f64, f64);

const ROWS: [Row; 15] = [
    (Profile::SquaredLog, HessianKind::Nearest, 2e-3, 10.0),
    (Profile::SquaredLog, HessianKind::ByTerms, 2e-3, 10.0),
    (Profile::SquaredLog, HessianKind::AlongOnly, 2e-3, 10.0),
    (Profile::Log, HessianKind::Nearest, 2e-3, 10.0),
    (Profile::QuadraticLog, HessianKind::Nearest, 2e-3, 10.0),
    (Profile::SquaredLog, HessianKind::ByTerms, 2e-3, 1.0),
    (Profile::SquaredLog, HessianKind::AlongOnly, 2e-3, 1.0),
    (Profile::QuadraticLog, HessianKind::Nearest, 2e-3, 1.0),
    (Profile::SquaredLog, HessianKind::ByTerms, 2e-3, 100.0),
    (Profile::Log, HessianKind::Nearest, 2e-3, 100.0),
    (Profile::QuadraticLog, HessianKind::Nearest, 2e-3, 100.0),
    (Profile::Cubic, HessianKind::Nearest, 2e-3, 100.0),
    (Profile::SquaredLog, HessianKind::ByTerms, 8e-3, 10.0),
    (Profile::SquaredLog, HessianKind::AlongOnly, 8e-3, 10.0),
    (Profile::Cubic, HessianKind::Nearest, 2e-3, 10.0),
];

/// Barrier whose curvature along the distance is `factor` times the inertia at half of the activation.
fn contact(row: &Row, inertia: f64) -> ContactEnergy {
    let &(profile, hessian, activation, factor) = row;
    let mut contact = ContactEnergy {
        profile,
        hessian,
        barrier: Barrier {
            stiffness: 1.0,
            activation,
            thickness: 5e-4,
        },
    };
    let half = contact.barrier.thickness + 0.5 * activation;
    let unit = contact.sample(half * half);
    let along = 4.0 * unit.second * half * half + 2.0 * unit.first;
    contact.barrier.stiffness = factor * inertia / along;
    contact
}

fn main() {
    let chosen: Vec<usize> = env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let scene = Scene::sheets_over_sphere();
    let inertia = scene.vertex_mass / (STEP * STEP);
    println!("row  profile       Hessian    d̂ [mm]      κ  Newton/step  most  CG/Newton  gap [mm]");
    for (number, row) in ROWS.iter().enumerate() {
        if !chosen.is_empty() && !chosen.contains(&number) {
            continue;
        }
        let mut simulation = Simulation::new(&scene, contact(row, inertia), STEP);
        (0..STEPS).for_each(|_| simulation.step());
        let r = &simulation.report;
        let newton = r.newton as f64;
        println!(
            "{number:3}  {:12}  {:9} {:7.1} {:6.0} {:12.1} {:5} {:10.0} {:9.4}",
            format!("{:?}", row.0),
            format!("{:?}", row.1),
            1e3 * row.2,
            row.3,
            newton / STEPS as f64,
            r.most,
            r.linear as f64 / newton,
            1e3 * r.gap
        );
    }
}
