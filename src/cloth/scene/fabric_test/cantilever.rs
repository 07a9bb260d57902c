//! Cantilever (Peirce 1930, ASTM D1388): strips along warp and weft, their bending length by the heavy elastica.

use super::rest::Specimen;
use super::{FabricReading, FabricTestReport, FabricTrial};
use crate::scene::SceneError;
use crate::settings::{ElasticSettings, FabricTestSettings};
use crate::specimens::elastica::{MomentCurve, bending_length_of, elastica_tip};
use crate::specimens::strip::{StripPattern, strip};
use nalgebra::Vector2;
use tryon_garment::Bending;
use tryon_geometry::math::V3d;

/// Width of a strip (m).
const WIDTH: f64 = 0.025;
/// Seed of the mesh: real-time hinges have the rigidity of a fabric on unstructured meshes.
const SEED: u32 = 7;
/// Shortest overhang in edges: three columns of vertices are held half-way between the second and the third.
const SHORTEST: f64 = 2.5;

/// Runs the test.
pub(super) fn run(
    trial: &FabricTrial,
    settings: &FabricTestSettings,
) -> Result<FabricTestReport, SceneError> {
    let material = &trial.fabric.material;
    let load = material.area_density * settings.gravity;
    let lengths = material.bending.lengths(load);
    let mut report = trial.report();
    for (along, quantity) in ["bending length along warp", "bending length along weft"]
        .into_iter()
        .enumerate()
    {
        // At twice the bending length a strip hangs at 41.5°; a longer one hangs steeper.
        let overhang = (2.0 * lengths[along]).max(SHORTEST * trial.edge);
        let mesh = Overhang::new(overhang, trial.edge);
        let specimen = mesh.specimen(along == 0);
        let x = specimen.rest(trial, settings, &mut report)?;
        let tip = &x[x.len() - mesh.rows..];
        let mean = tip.iter().sum::<V3d>() / tip.len() as f64;
        report.readings.push(FabricReading {
            quantity,
            unit: "mm",
            measured: 1e3 * overhang * bending_length_of(-mean.y / mean.x),
            // A law measured by curvature has no one rigidity.
            published: (material.measured.is_none())
                .then(|| 1e3 * published(&material.bending, along, load, overhang)),
            origin: "Peirce's reading of the published B, HB and weight",
        });
    }
    Ok(report)
}

/// Bending length (m) that Peirce's cantilever reads from a strip with the published moment curve, along warp or weft.
fn published(bending: &Bending, along: usize, load: f64, overhang: f64) -> f64 {
    let rigidity = [bending.warp, bending.weft][along];
    let [x, y] = elastica_tip(&MomentCurve {
        rigidity: rigidity / (load * overhang.powi(3)),
        friction: bending.friction / (load * overhang * overhang),
        onset: ElasticSettings::default().friction_onset * overhang,
    });
    overhang * bending_length_of(y / x)
}

/// Mesh of an overhanging strip, along x.
struct Overhang {
    at: Vec<Vector2<f64>>,
    faces: Vec<[u32; 3]>,
    rows: usize,
}

impl Overhang {
    /// Strip of squares of about `edge` (m), as many across as come next to its width.
    fn new(length: f64, edge: f64) -> Self {
        let columns = (length / edge + 1.5).round();
        let square = length / (columns - 1.5);
        let across = (WIDTH / square).round().max(1.0);
        let mesh = strip(
            length,
            columns as usize,
            across as usize,
            StripPattern::Unstructured(SEED),
        );
        Self {
            at: mesh.at,
            faces: mesh.faces,
            rows: mesh.rows,
        }
    }

    /// Specimen cut along the warp or the weft.
    fn specimen(&self, along_warp: bool) -> Specimen {
        let turned = |p: &Vector2<f64>| match along_warp {
            true => Vector2::new(-p.y, p.x),
            false => *p,
        };
        // The material's u × v points up, along −z × x.
        let place = |p: &Vector2<f64>| V3d::new(p.x, 0.0, -p.y);
        Specimen {
            at: self.at.iter().map(turned).collect(),
            faces: self.faces.clone(),
            start: self.at.iter().map(place).collect(),
            held: 3 * self.rows,
        }
    }
}
