//! Fabrics of the library in textile tests by both solvers.

use super::{FabricSolver, FabricTest, FabricTestReport, FabricTrial};
use crate::settings::FabricTestSettings;
use tryon_garment::FabricSample;

/// Silk, cotton, twill, denim of 13 oz, jersey, wool.
const FABRICS: [&str; 6] = ["silk", "cotton", "twill", "denim", "jersey", "wool"];

fn trial(test: FabricTest, fabric: &str, solver: FabricSolver, edge: f64) -> FabricTestReport {
    let trial = FabricTrial {
        test,
        fabric: FabricSample::named(fabric).expect("a fabric"),
        solver,
        edge,
    };
    trial.run(&FabricTestSettings::default()).expect("a report")
}

fn worst(report: &FabricTestReport) -> f64 {
    let errors = report
        .readings
        .iter()
        .filter_map(super::FabricReading::error);
    errors.fold(0.0, |w, e| w.max(e.abs()))
}

#[test]
fn strips_have_the_published_bending_length() {
    for fabric in FABRICS {
        let offline = trial(FabricTest::Cantilever, fabric, FabricSolver::Offline, 3e-3);
        assert!(worst(&offline) < 0.03 && offline.settled, "{offline}");
        let live = trial(
            FabricTest::Cantilever,
            fabric,
            FabricSolver::Realtime,
            0.012,
        );
        assert!(worst(&live) < 0.12 && live.settled, "{live}");
    }
}

/// On the edges of a garment the mesh is stiffer than silk, and says so.
#[test]
fn coarse_meshes_report_their_limit() {
    let silk = trial(FabricTest::Cantilever, "silk", FabricSolver::Realtime, 0.02);
    let limit = silk.resolution.expect("a limit");
    assert!(limit.stiffening() > 1.5, "{limit:?}");
    assert!(silk.to_string().contains("least bending"), "{silk}");
    let denim = trial(
        FabricTest::Cantilever,
        "denim",
        FabricSolver::Realtime,
        0.02,
    );
    let limit = denim.resolution.expect("a limit");
    assert!(limit.stiffening() == 1.0 && worst(&denim) < 0.1, "{denim}");
}

#[test]
fn frames_have_the_published_shear_stiffness() {
    for solver in [FabricSolver::Offline, FabricSolver::Realtime] {
        for fabric in ["twill", "wool", "denim"] {
            let frame = trial(FabricTest::PictureFrame, fabric, solver, 0.02);
            assert!(worst(&frame) < 0.01, "{frame}");
        }
    }
}

/// A coarse disc of the stiffest measured fabric; the others need edges of 5 mm and minutes.
#[test]
fn cotton_drapes_as_published() {
    let disc = trial(FabricTest::Cusick, "cotton", FabricSolver::Offline, 7.5e-3);
    assert!(worst(&disc) < 0.1 && disc.settled, "{disc}");
}

#[test]
fn faults_are_told() {
    let trial = FabricTrial {
        test: FabricTest::Cusick,
        fabric: FabricSample::named("wool").expect("a fabric"),
        solver: FabricSolver::Offline,
        edge: 0.5,
    };
    let why = trial
        .run(&FabricTestSettings::default())
        .expect_err("too coarse");
    assert!(why.to_string().contains("edge"), "{why}");
    assert!(FabricTest::named("heart-loop").is_none());
}
